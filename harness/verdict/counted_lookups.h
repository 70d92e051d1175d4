#pragma once

#include <cstdint>
#include <functional>

#include "harness/sampling/sampling.h"

namespace nullmark {

/// Lookups of trackers whose flights the harness draws need no mean: a walk that looks up once at each collision of its flight,
/// and flies through the whole depth that theory counts, has the expected number of lookups by construction of the flight.
///
/// Records walks with streams of their own, as many as prove with level `alpha` that at most one in a hundred does otherwise
/// (.99^n <= alpha), and returns their number.  0 where a walk does otherwise, where the flight is not the harness's, where
/// theory does not tell the lookups, and where `stop` answered true: then only the mean can tell.
std::uint64_t counted_walks(const Cell& cell, const Scene& scene, const Kernel& kernel, const CellTheory& theory, Real alpha,
                            const std::function<bool()>& stop);

}  // namespace nullmark
