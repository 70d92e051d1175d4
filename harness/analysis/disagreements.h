#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// What differing pairs of trackers say, a sentence each.  A pair says that one of the two is biased.  A tracker that differs
/// from two others which agree with each other in the same scene is the biased one; equal biases of those two would not show.
std::vector<std::string> disagreements(const RunRecord& run);

}  // namespace nullmark
