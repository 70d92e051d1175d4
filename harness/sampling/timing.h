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

/// Share of the wall time in which a thread did not run, for other work had its core; 0 where its clock went ahead of the wall's,
/// as clocks may by as little as they resolve.
Real waiting_share(Real wall_seconds, Real thread_seconds);

/// Wall time of every cell's kernel, traversal included, on one thread, with Google Benchmark: repetitions of all cells and of
/// two calibration loops are interleaved at random, medians and median absolute deviations are taken over them.  `done` is told
/// of each repetition.  Stops between repetitions once `stop` answers true; unfinished cells keep no time.
std::vector<std::optional<TimeRecord>> time_cells(const std::vector<TimedCell>& cells, const TimingPlan& plan,
                                                  const std::function<bool()>& stop, const std::function<void(double)>& progress);

}  // namespace nullmark
