#pragma once

#include <string>

#include "harness/analysis/check.h"

namespace nullmark {

/// For the terminal: the totals; then every cell that did not pass or has a mark, with its reason or what it proves.  Unless
/// `all`, one line for each verdict stands for cells that nobody need look at, where those are many; `command` lists them.
std::string summary_text(const RunRecord& run, const Summary& summary, bool all = true,
                         const std::string& command = "nullmark check --all");

/// For the terminal, of results of one cell: its verdict with its reason or what it proves, then the rest as above.
std::string judgement_text(const RunRecord& run, const Summary& summary);

/// The same as `summary_text` for a pull request.
std::string summary_markdown(const RunRecord& run, const Summary& summary, const std::string& file);

}  // namespace nullmark
