#pragma once

#include <functional>
#include <vector>

#include "harness/model/exit_code.h"
#include "harness/run/run.h"

namespace nullmark {

/// Runs a plan and hands its records to `conclude`, which writes results and tells the exit code.  Where a signal has arrived or
/// the time is spent and the run does not end by itself, the cells that are finished are concluded with, the others are told not
/// to have run, and the process ends.  `conclude` is called once, on either thread; no observer is called meanwhile or later.
ExitCode watched_run(const Plan& plan, const std::vector<bool>& selected, const std::vector<CellRecord>& finished,
                     const RunOptions& options, const RunObserver& observer,
                     const std::function<ExitCode(std::vector<CellRecord>)>& conclude);

}  // namespace nullmark
