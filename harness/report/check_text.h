#pragma once

#include <string>

#include "harness/analysis/check.h"

namespace nullmark {

/// For the terminal: every cell that did not pass or has a mark, with its reason or what it proves; then the totals.
std::string summary_text(const RunRecord& run, const Summary& summary);

/// The same for a pull request.
std::string summary_markdown(const RunRecord& run, const Summary& summary, const std::string& file);

}  // namespace nullmark
