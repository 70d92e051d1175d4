#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// Joins parts of one configuration's results (shards, or runs of different --filter) in the plan's order.  Where parts share a
/// cell its statistics must be the same to the last bit; a sampled cell takes the place of one that was not.  The tables and the
/// configuration are common to all; `parts` in the provenance holds each part's own.  `names` are the parts' files, for errors.
/// Throws InputError.
RunRecord merge_results(const std::vector<RunRecord>& parts, const std::vector<std::string>& names);

}  // namespace nullmark
