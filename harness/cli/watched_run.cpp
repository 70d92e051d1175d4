#include "harness/cli/watched_run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <mutex>
#include <optional>
#include <set>

#include "harness/cli/signals.h"
#include "harness/io/json_input.h"
#include "harness/io/notice.h"
#include "harness/model/in_flight.h"
#include "harness/run/watchdog.h"

namespace nullmark {
namespace {

using Clock = std::chrono::steady_clock;

/// Finished cells by name, as the observer is told of them.
class FinishedCells {
 public:
  explicit FinishedCells(const std::vector<CellRecord>& before) {
    for (const CellRecord& record : before) cells_[record.cell.name] = std::make_shared<CellRecord>(record);
  }

  /// Keeps what the observer is told.
  RunObserver keeping(const RunObserver& observer) {
    RunObserver keeps = observer;
    keeps.cell_done = [this, &observer](const SharedRecord& record, std::size_t done, std::size_t total) {
      const std::lock_guard lock(mutex_);
      observer.cell_done(record, done, total);
      if (record->status != Status::not_run || has_samples(*record)) cells_[record->cell.name] = record;
    };
    keeps.cell_timed = [this, &observer](const SharedRecord& record) {
      const std::lock_guard lock(mutex_);
      observer.cell_timed(record);
      cells_[record->cell.name] = record;
    };
    keeps.settled = [this, &observer] {
      const std::lock_guard lock(mutex_);
      observer.settled();
    };
    keeps.progress = [this, &observer](const CellRecord& record, double fraction) {
      if (const std::unique_lock lock(mutex_, std::try_to_lock); lock) observer.progress(record, fraction);
    };
    keeps.timing = [this, &observer](double fraction, std::size_t cells) {
      if (const std::unique_lock lock(mutex_, std::try_to_lock); lock) observer.timing(fraction, cells);
    };
    keeps.warning = [this, &observer](const std::string& message) {
      const std::lock_guard lock(mutex_);
      observer.warning(message);
    };
    return keeps;
  }

  /// From here on whoever would tell the observer waits.  Nothing where the observer does not return, as on a disk that hangs.
  const std::map<std::string, SharedRecord>* close() {
    using namespace std::chrono_literals;
    return mutex_.try_lock_for(300ms) ? &cells_ : nullptr;
  }

  /// Lets go of them, once the run has ended by itself.
  void forget() { cells_.clear(); }

 private:
  std::timed_mutex mutex_;
  std::map<std::string, SharedRecord> cells_;
};

std::string what_ended() { return received_signal != 0 ? "signal" : "time budget"; }

void tell_overdue() {
  if (::isatty(STDERR_FILENO) == 1) notice("\n");
  const std::set<std::string> cells = InFlight::cells();
  for (const std::string& cell : cells)
    notice("nullmark: warning: cell {} was still under way {:.1f} s after the {} and is cut off\n", cell,
           std::chrono::duration<double>(Watchdog::kPatience).count(), what_ended());
}

}  // namespace

ExitCode watched_run(const Plan& plan, const std::vector<bool>& selected, const std::vector<CellRecord>& finished,
                     const RunOptions& options, const RunObserver& observer,
                     const std::function<ExitCode(std::vector<CellRecord>)>& conclude) {
  FinishedCells cells(finished);
  const auto start = Clock::now();
  const auto due = [&] {
    return received_signal != 0 ||
           (options.time_budget && std::chrono::duration<double>(Clock::now() - start).count() > *options.time_budget);
  };
  const auto leave = [&] {
    tell_overdue();
    ExitCode code = ExitCode::internal_error;
    try {
      if (const auto* done = cells.close())
        code = conclude(cut_off(plan, selected, *done, received_signal != 0 ? kInterrupted : kBudgetSpent));
      else
        notice("nullmark: the journal cannot be written in time; --resume goes on from what it holds\n");
    } catch (const InputError& error) {
      notice("nullmark: {}\n", error.what());
      code = ExitCode::input_error;
    } catch (const std::exception& error) {
      notice("nullmark: {}\n", error.what());
    }
    std::fflush(stdout);
    // Threads that do not end cannot be waited for.
    ::_exit(static_cast<int>(code));
  };
  Watchdog watchdog(due, leave);
  std::vector<std::shared_ptr<CellRecord>> records = run_plan(plan, selected, finished, options, cells.keeping(observer));
  watchdog.claim();
  cells.forget();
  return conclude(unshared(std::move(records)));
}

}  // namespace nullmark
