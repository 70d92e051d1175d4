#pragma once

#include <functional>
#include <vector>

#include "harness/model/plan.h"
#include "harness/model/record.h"
#include "harness/sampling/scene.h"

namespace nullmark {

struct TimedCell {
  const Cell* cell = nullptr;
  const Scene* scene = nullptr;
  const Kernel* kernel = nullptr;
};

/// Share of the wall time in which a thread did not run, because other work had its core.  0 if its clock was ahead of the wall
/// clock, which happens within the resolution of clocks.
Real waiting_share(Real wall_seconds, Real thread_seconds);

/// Wall time of every cell's kernel, traversal included, on one thread, with Google Benchmark: repetitions of all cells and of
/// two calibration loops are interleaved at random, medians and median absolute deviations are taken over them.  One sample alone
/// is timed whether the plan names it or not.  `progress` is called for each repetition.  Stops between repetitions once `stop`
/// returns true; unfinished cells get no time.
std::vector<std::optional<TimeRecord>> time_cells(const std::vector<TimedCell>& cells, const TimingPlan& plan,
                                                  const std::function<bool()>& stop, const std::function<void(double)>& progress);

}  // namespace nullmark
