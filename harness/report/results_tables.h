#pragma once

#include <string>
#include <utility>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// The readable tables of a run: cells of one experiment, medium, majorant and quantity together, one line per estimator and
/// channel, then the configuration's own tables beside the numbers they answer.  `*` marks theory shown in place of a sample
/// value where the distribution has too heavy a tail for that to mean much (relative variance above kHeavyTail).
std::string results_tables(const RunRecord& run);

/// The configuration's own tables alone: title and lines, the first being the heading.
std::vector<std::pair<std::string, std::vector<std::vector<std::string>>>> configured_tables(const RunRecord& run);

}  // namespace nullmark
