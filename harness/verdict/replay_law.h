#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "harness/model/plan.h"
#include "harness/model/record.h"
#include "harness/sampling/kept_samples.h"
#include "harness/sampling/scene.h"

namespace nullmark {

/// The law "replay": a sample is a function of its address (seed, medium, ray, sample) and of nothing else.  Kept samples are
/// drawn again by the same kernel in a new workspace, rays and samples from the last to the first, every other one alone and the
/// rest as the second of two, and compared bit for bit; not all of them where samples take many lookups.  A tracker that keeps
/// anything from one sample for the next breaks it.
///
/// Its evidence is 0, or certain where any number differs.  `samples` of the record are the comparisons; 0 where `stop` answered
/// true.
LawRecord replay_law(const Cell& cell, const Scene& scene, const Kernel& kernel, std::span<const KeptSamples> kept,
                     const std::function<bool()>& stop);

}  // namespace nullmark
