#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/performance_gate/performance_gate.h"

namespace nullmark {

/// The words of `--require`: "counts", "expected", "instructions", "wall-time", "misses", "start-up".
std::vector<std::string> required_words();

/// Throws InputError for any other word.
Tier required_tier(const std::string& word);

/// What had to be compared and was not, one sentence for each tier: PerformanceReport::missing.
/// Without `required`: each cell and tier that `before` holds and `after` lacks.  With it: each of its tiers in each cell that
/// `before` holds it of, and at least in one; the other tiers may be missing.  Cells that a partial `after` was not asked for are
/// not missed, either way.
std::vector<std::string> missing_tiers(const PerformanceReport& report, const Counts& before, const Counts& after,
                                       const std::optional<std::vector<Tier>>& required = {});

}  // namespace nullmark
