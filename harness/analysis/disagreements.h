#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// What differing pairs of trackers say, a sentence each.  A pair says that one of the two is biased.  Where a tracker differs
/// from two others that agree with each other in the same scene, it is biased, or both of them are: equal biases do not show.
std::vector<std::string> disagreements(const RunRecord& run);

}  // namespace nullmark
