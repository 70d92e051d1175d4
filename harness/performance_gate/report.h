#pragma once

#include <string>

#include "harness/performance_gate/performance_gate.h"

namespace nullmark {

/// For the terminal: a line for each comparison that is not "same", regressions first, then the number of each finding by tier.
std::string performance_text(const PerformanceReport& report);

/// The same for a pull request, with all comparisons folded away.
std::string performance_markdown(const PerformanceReport& report);

/// One test case per cell, tier and metric: regressions are failures; what was changed, undecided, advisory or not compared is
/// skipped with its reason.  What is missing is an error.
std::string performance_junit(const PerformanceReport& report);

}  // namespace nullmark
