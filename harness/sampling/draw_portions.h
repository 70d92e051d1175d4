#pragma once

#include <functional>
#include <map>
#include <optional>

#include "harness/sampling/portion.h"
#include "harness/sampling/scene.h"
#include "harness/sampling/targets.h"
#include "harness/sampling/test_plan.h"

namespace nullmark {

/// Portions of a span, by number.
using Portions = std::map<std::size_t, Portion>;

/// Draws the portions for whose number `wanted` is true, with TBB's threads.  `stop` is called between chunks; once it returns
/// true, the result is empty.  If there is a plan, evidence is gathered for its tests.
std::optional<Portions> draw_portions(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets,
                                      const SampleSpan& span, const TestPlan* plan,
                                      const std::function<bool(std::size_t)>& wanted, const std::function<bool()>& stop,
                                      const std::function<void(double)>& progress);

}  // namespace nullmark
