#pragma once

#include <string>

#include "harness/analysis/check.h"

namespace nullmark {

/// For the terminal: every cell that did not pass or has a mark, with its reason or what it proves; then the totals.  Unless `all`,
/// one line for each verdict stands for cells that nobody need look at, where those are many.
std::string summary_text(const RunRecord& run, const Summary& summary, bool all = true);

/// The same for a pull request.
std::string summary_markdown(const RunRecord& run, const Summary& summary, const std::string& file);

}  // namespace nullmark
