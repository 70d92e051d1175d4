#pragma once

namespace nullmark {

/// What this program was compiled from.  In a file of its own: it changes with every edit.
struct SourceState {
  const char* commit;   ///< "unknown" without a repository
  const char* changes;  ///< hash of the sources that differ from the commit, or of all without a repository; empty: none
  bool dirty;           ///< any tracked file has uncommitted changes
  const char* compiler_flags;
};
SourceState source_state();

}  // namespace nullmark
