#pragma once

#include <string>

#include "harness/model/record.h"

namespace nullmark {

/// One line per experiment and tracker: whether every sample was finite, verdicts, the largest sample, the worst error, lookups a
/// sample and the guards that fired.  Errors are told relative to the reference where samples do not vary beyond rounding, and in
/// standard errors of the mean where they do.
std::string stability_text(const RunRecord& run);
std::string stability_markdown(const RunRecord& run);

}  // namespace nullmark
