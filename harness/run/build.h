#pragma once

#include <map>
#include <string>

#include "harness/io/json_input.h"
#include "harness/model/record.h"

namespace nullmark {

/// What made results: cells of different sources are never joined, those of different environments only where the user asks.
struct Build {
  std::string version;      ///< of nullmark
  std::string commit;       ///< of nullmark's source; "unknown" without a repository
  std::string changes;      ///< hash of what differs from the commit; empty: nothing
  std::string plugin;       ///< name and version; empty: nullmark itself
  std::string plugin_hash;  ///< of its executable
  std::string environment;  ///< compiler, flags, C library, instruction set
};

/// As the provenance of results tells it.
Build build_of(const std::map<std::string, std::string>& provenance);

/// This program.
const Build& this_build();

/// In the head of a journal.
Json build_json(const Build& build);
Build read_build(const JsonNode& node);

/// What of other builds is joined: nothing; or cells of the same source, compiled or run in another environment.
enum class Builds { same, any };
Builds builds_of(const std::string& text);

/// Throws InputError where cells of `found`, in the file, may not be joined with those of `expected`, of whom the message tells.
void expect_joinable(const std::string& file, const Build& found, const std::string& of, const Build& expected, Builds builds);

/// Marks a cell of results of one build that becomes part of results of another.
void mark_build(CellRecord& record, const Build& of_cell, const Build& of_results);

}  // namespace nullmark
