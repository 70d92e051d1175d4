#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"
#include "harness/run/build.h"

namespace nullmark {

/// Joins results of one configuration (shards, or runs with different --filter) in the order of the plan.  If parts share a cell,
/// its statistics must be bit-identical; a sampled cell replaces one that was not sampled.  Drawn parts of a split cell become
/// one record, see judge_parts.  Tables and configuration are common to all; `parts` in the provenance holds the provenance of
/// each part.  Parts of other builds than the first are refused, or their cells are marked.  A medium must have had the same data
/// in all parts.  `names` are the files of the parts, for errors. Throws InputError.
RunRecord merge_results(const std::vector<RunRecord>& parts, const std::vector<std::string>& names, Builds builds = Builds::same);

}  // namespace nullmark
