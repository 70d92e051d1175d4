#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "harness/model/plan.h"
#include "harness/model/record.h"

namespace nullmark {

/// How a plan is carried out; nothing here changes statistics.
struct RunOptions {
  int threads = 0;                    ///< 0: all cores
  std::optional<double> time_budget;  ///< seconds; decides which cells are started
  bool timing = true;
  std::string image_directory;                    ///< empty: no images are written
  std::string image_prefix;                       ///< path of that directory as the results file names it
  const std::atomic<int>* interrupted = nullptr;  ///< set to a signal's number to stop after the samples under way
};

/// Told of every cell as it ends (statistics), and again when its time is known.  Cells may end in any order; calls come one at a
/// time, from any thread.
struct RunObserver {
  std::function<void(const CellRecord&, std::size_t done, std::size_t total)> cell_done = [](const CellRecord&, std::size_t,
                                                                                             std::size_t) {};
  std::function<void(const CellRecord&, double fraction)> progress = [](const CellRecord&, double) {};
  std::function<void(double fraction)> timing = [](double) {};
  std::function<void(const CellRecord&)> cell_timed = [](const CellRecord&) {};
  /// Time that evidence took, and all statistics (evidence among them), over the time of the sampling they are of.
  std::function<void(double)> verdict_share = [](double) {}, statistics_share = [](double) {};
  std::function<void(const std::string&)> warning = [](const std::string&) {};
};

/// Runs the cells for which `selected` is true, begun in plan order and as many at once as there are threads; `finished` are
/// records that need not be run again.  The result holds every selected cell, in plan order.  Throws ParameterError (with a JSON
/// pointer as `parameter`) for specifications that do not fit their media.
std::vector<CellRecord> run_plan(const Plan& plan, const std::vector<bool>& selected, const std::vector<CellRecord>& finished,
                                 const RunOptions& options, const RunObserver& observer);

}  // namespace nullmark
