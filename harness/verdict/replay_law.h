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

/// The law "replay": a sample depends only on its address (seed, medium, ray, sample).  Kept samples are drawn again by the same
/// kernel in a new workspace, rays and samples from the last to the first, alternately alone and as the second of two.  They are
/// compared bit for bit; if samples take many lookups, only some of them.  A tracker that keeps anything from one sample for the
/// next breaks the law.
///
/// Its evidence is 0, or certain if any number differs.  `samples` of the record is the number of comparisons; 0 if `stop`
/// returned true.
LawRecord replay_law(const Cell& cell, const Scene& scene, const Kernel& kernel, std::span<const KeptSamples> kept,
                     const std::function<bool()>& stop);

}  // namespace nullmark
