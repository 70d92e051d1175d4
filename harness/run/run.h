#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/plan.h"
#include "harness/model/record.h"

namespace nullmark {

/// A part of a cell's samples: one of each `parts` consecutive portions.
struct CellShare {
  std::size_t part = 0, parts = 1;

  /// Whether it has the portion, by its number among those of all spans.  Each group of portions begins with another part, so
  /// that no part has the same column of every row of a picture.
  bool has(std::size_t portion) const { return (portion + portion / parts) % parts == part; }
  std::string text() const;  ///< "2/4" for part 1
};

/// Options of a run; none changes statistics.
struct RunOptions {
  int threads = 0;                    ///< 0: all cores
  std::optional<double> time_budget;  ///< seconds; cells and times that are not done by then are left out
  bool timing = true;
  std::vector<CellShare> shares;                  ///< by cell of the plan; empty: all cells are whole
  bool may_draw = true;                           ///< false: cells are judged by the samples that are stored
  std::string image_directory;                    ///< empty: no images are written
  std::string image_prefix;                       ///< path of that directory as the results file names it
  const std::atomic<int>* interrupted = nullptr;  ///< set to a signal's number to stop after the samples under way
};

/// A finished record, which others keep as well.
using SharedRecord = std::shared_ptr<const CellRecord>;

/// What a part of a run took: preparation (of media, bounds, rays, references), theory, sampling (with verdicts), timing.
struct Phase {
  std::string name;
  double wall = 0, cpu = 0;  ///< seconds; cpu: of all threads
};

/// Called for every cell when its statistics are done, and again when its time is known.  Cells end in any order.  Calls come one
/// at a time, from any thread.
struct RunObserver {
  std::function<void(const SharedRecord&, std::size_t done, std::size_t total)> cell_done = [](const SharedRecord&, std::size_t,
                                                                                               std::size_t) {};
  std::function<void(const CellRecord&, double fraction)> progress = [](const CellRecord&, double) {};
  std::function<void(double fraction, std::size_t cells)> timing = [](double, std::size_t) {};
  std::function<void(const SharedRecord&)> cell_timed = [](const SharedRecord&) {};
  /// No cell waits that `cell_done` or `cell_timed` has yet to be called for.
  std::function<void()> settled = [] {};
  /// Time of evidence, and of all statistics including evidence, divided by the time of their sampling.
  std::function<void(double)> verdict_share = [](double) {}, statistics_share = [](double) {};
  std::function<void(const Phase&)> phase = [](const Phase&) {};
  std::function<void(const std::string&)> warning = [](const std::string&) {};
};

/// Whether a record holds samples: of a cell that was run, or of parts of one.
bool has_samples(const CellRecord& record);

/// Whether a run of that share of a cell can use a record of an earlier run: a whole cell's, or the same part's; for a whole cell
/// also those of any parts.  Parts that another build drew are drawn again.
bool is_kept(const CellRecord& record, const CellShare& share);

/// Why cells were not run.
inline constexpr const char *kInterrupted = "interrupted", *kBudgetSpent = "time budget spent";

/// Records in plan order of a run that was cut off: those that are `finished`, by name, and for the others that they were not
/// run.
std::vector<CellRecord> cut_off(const Plan& plan, const std::vector<bool>& selected,
                                const std::map<std::string, SharedRecord>& finished, const std::string& reason);

/// Runs the cells for which `selected` is true.  They start in plan order, as many at once as there are threads.  `finished`
/// holds records that need not run again, and those whose cells are wanted whole though parts of them are drawn: their samples
/// are used.  The result holds every selected cell, in plan order.  Throws ParameterError (with a JSON pointer as `parameter`)
/// for specifications that do not fit their media, and InputError where the data of a medium are not those that a finished cell
/// was sampled in.
std::vector<std::shared_ptr<CellRecord>> run_plan(const Plan& plan, const std::vector<bool>& selected,
                                                  const std::vector<CellRecord>& finished, const RunOptions& options,
                                                  const RunObserver& observer);

/// The records themselves; those that nothing else holds are moved.
std::vector<CellRecord> unshared(std::vector<std::shared_ptr<CellRecord>> records);

}  // namespace nullmark
