#pragma once

#include <cstdint>
#include <functional>

#include "harness/sampling/sampling.h"

namespace nullmark {

/// If the harness draws a tracker's flights, its lookups can be verified without their mean: a walk that looks up once at each
/// collision of its flight, and flies through the whole depth that theory counts, has the expected number of lookups.
///
/// Records walks with their own streams, as many as prove at level `alpha` that at most one walk in a hundred does otherwise
/// (.99^n <= alpha), and returns their number.  Returns 0 if a walk does otherwise, if the harness does not draw the flight, if
/// theory does not state the lookups, or if `stop` returned true.  Then only the mean can decide.
std::uint64_t counted_walks(const Cell& cell, const Scene& scene, const Kernel& kernel, const CellTheory& theory, Real alpha,
                            const std::function<bool()>& stop);

}  // namespace nullmark
