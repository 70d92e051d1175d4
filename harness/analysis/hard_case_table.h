#pragma once

#include <string>

#include "harness/model/record.h"

namespace nullmark {

/// One line per experiment and tracker: whether every sample was finite, verdicts, the largest sample, the worst error, lookups
/// per sample and the guards that fired.  Errors are in standard errors of the mean, or relative to the reference if samples do
/// not vary beyond rounding.
std::string stability_text(const RunRecord& run);
std::string stability_markdown(const RunRecord& run);

}  // namespace nullmark
