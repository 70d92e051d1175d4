#include "harness/run/run.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_for_each.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <exception>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string_view>
#include <thread>

#include "harness/io/json_input.h"
#include "harness/run/cell_record.h"
#include "harness/run/cpu_clock.h"
#include "harness/run/run_cell.h"
#include "harness/run/task_thread.h"
#include "harness/sampling/cell_theory.h"
#include "harness/sampling/test_families.h"
#include "harness/sampling/timing.h"
#include "harness/verdict/judge.h"

namespace nullmark {
namespace {

using Clock = std::chrono::steady_clock;

using Records = std::map<std::size_t, std::shared_ptr<CellRecord>>;  // by place in the plan

CellShare share_of(const RunOptions& options, std::size_t cell) {
  return options.shares.empty() ? CellShare() : options.shares[cell];
}

/// Calls `work` for 0 .. count - 1, begun in this order, one on each thread; threads that find none left help with the chunks of
/// those under way.  Throws what the first that failed threw; `failed` is then set, and no further ones are begun.
template <class F>
void for_each_in_order(std::size_t count, int threads, std::atomic<bool>& failed, F&& work) {
  std::atomic<std::size_t> next = 0;
  std::exception_ptr error;
  const auto take = [&](int) {
    for (std::size_t i = next++; i < count && !failed; i = next++) {
      // An exception that reached TBB would cut the others' chunks short in silence.
      try {
        // While it waits for chunks of its own, a thread must not begin another cell.
        tbb::this_task_arena::isolate([&] { work(i); });
      } catch (...) {
        if (!failed.exchange(true)) error = std::current_exception();
      }
    }
  };
  tbb::parallel_for(0, std::max(1, threads), take, tbb::simple_partitioner{});
  if (error) std::rethrow_exception(error);
}

/// Samples and judges cells on all threads, and tells of each when it is done.
std::vector<CellOutcome> run_cells(const Plan& plan, std::vector<PreparedCell>& cells, const Records& drawn, int threads,
                                   const RunOptions& options, const RunObserver& observer, const std::function<bool()>& late,
                                   const std::function<bool()>& stop) {
  const Families families{mean_family(plan), lookups_family(plan), laws_family(plan)};
  std::vector<CellOutcome> outcomes(cells.size());
  std::mutex telling;
  Background teller([&] {
    const std::lock_guard lock(telling);
    observer.settled();
  });
  std::size_t done = 0;
  std::atomic<bool> failed = false;
  const auto given_up = [&] { return stop() || failed || teller.failed(); };
  RunObserver guarded = observer;
  guarded.warning = [&](const std::string& message) {
    const std::lock_guard lock(telling);
    observer.warning(message);
  };
  // Some progress untold is better than samples that wait.
  guarded.progress = [&](const CellRecord& record, double fraction) {
    if (const std::unique_lock lock(telling, std::try_to_lock); lock) observer.progress(record, fraction);
  };
  for_each_in_order(cells.size(), threads, failed, [&](std::size_t i) {
    const auto before = drawn.find(cells[i].index);
    const CellTask task{cells[i], share_of(options, cells[i].index), before == drawn.end() ? nullptr : before->second.get(),
                        options.may_draw};
    outcomes[i] = run_cell(plan, task, families, late, options, guarded, given_up);
    // Many cells at once should hold no more than their records.
    cells[i].targets = {};
    cells[i].theory = {};
    teller.add([&, i] {
      const std::lock_guard lock(telling);
      observer.cell_done(outcomes[i].record, ++done, cells.size());
    });
  });
  teller.finish();
  return outcomes;
}

/// Whether a cell is timed here: one that was sampled; of a split one, with its first part.
bool is_timed(const CellRecord& record, const CellShare& share) {
  return record.status == Status::ok || (!record.drawn_parts.empty() && share.parts > 1 && share.part == 0);
}

/// Tells what each phase took, one after another.
class PhaseClock {
 public:
  explicit PhaseClock(const RunObserver& observer) : observer_(observer) {}

  void end(const char* name) {
    const Clock::time_point wall = Clock::now();
    const double cpu = cpu_seconds();
    observer_.phase({name, std::chrono::duration<double>(wall - wall_).count(), cpu - cpu_});
    wall_ = wall;
    cpu_ = cpu;
  }

 private:
  const RunObserver& observer_;
  Clock::time_point wall_ = Clock::now();
  double cpu_ = cpu_seconds();
};

void time_records(const std::vector<const PreparedCell*>& cells, const TimingPlan& plan, Records& records,
                  const RunObserver& observer, const std::function<bool()>& stop) {
  std::vector<TimedCell> timed;
  timed.reserve(cells.size());
  for (const PreparedCell* prepared : cells) timed.push_back({prepared->cell, prepared->scene.get(), prepared->kernel.get()});
  const auto times = time_cells(timed, plan, stop, [&](double fraction) { observer.timing(fraction, timed.size()); });
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!times[i]) continue;
    // Others keep the record without a time, so the one with it is another.
    std::shared_ptr<CellRecord>& record = records[cells[i]->index];
    record = std::make_shared<CellRecord>(*record);
    record->time = times[i];
    record->time->majorant_build_seconds = cells[i]->scene->majorant->build_seconds;
    observer.cell_timed(record);
  }
  observer.settled();
}

/// Throws InputError where a finished cell was sampled in other data than its medium has now.
void expect_same_media(CellPreparer& preparer, const Plan& plan, const Records& finished) {
  for (const auto& [index, shared] : finished) {
    const CellRecord& record = *shared;
    const std::string now = record.medium_hash.empty() ? "" : preparer.medium_hash(plan.cells[index].medium);
    if (now.empty() || now == record.medium_hash) continue;
    throw InputError(
        fmt::format("cell \"{}\": found the medium {} of hash {}; expected {}, as when the cell was sampled: its data "
                    "were replaced; --force runs all cells again",
                    record.cell.name, record.medium->label, now, record.medium_hash));
  }
}

/// Throws InputError where a finished cell was sampled with other code of a tracker from outside than there is now.
void expect_same_trackers(CellPreparer& preparer, const Records& finished) {
  for (const auto& [index, shared] : finished) {
    const CellRecord& record = *shared;
    if (record.tracker.hash.empty()) continue;
    const PreparedCell now = preparer.prepare(index);
    const auto identity = now.source ? now.source->identity() : std::nullopt;
    if (!identity || hash_text(*identity) == record.tracker.hash) continue;
    throw InputError(
        fmt::format("cell \"{}\": found the tracker {} of hash {}; expected {}, as when the cell was sampled: its code was "
                    "replaced; --force runs all cells again",
                    record.cell.name, record.tracker.name, hash_text(*identity), record.tracker.hash));
  }
}

}  // namespace

std::string CellShare::text() const { return fmt::format("{}/{}", part + 1, parts); }

bool has_samples(const CellRecord& record) {
  return record.status == Status::ok || record.status == Status::error || !record.drawn_parts.empty();
}

bool is_kept(const CellRecord& record, const CellShare& share) {
  if (record.drawn_parts.empty()) return record.status == Status::ok;
  return record.build.empty() && (share.parts == 1 || record.part == share.text());
}

std::vector<CellRecord> cut_off(const Plan& plan, const std::vector<bool>& selected,
                                const std::map<std::string, SharedRecord>& finished, const std::string& reason) {
  std::vector<CellRecord> records;
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    if (!selected[i]) continue;
    if (const auto at = finished.find(plan.cells[i].name); at != finished.end()) {
      records.push_back(*at->second);
      continue;
    }
    records.push_back(blank_record(plan, unprepared(plan, i)));
    records.back().reason = reason;
  }
  return records;
}

std::vector<CellRecord> unshared(std::vector<std::shared_ptr<CellRecord>> records) {
  std::vector<CellRecord> result;
  result.reserve(records.size());
  for (std::shared_ptr<CellRecord>& record : records) {
    if (record.use_count() == 1)
      result.push_back(std::move(*record));
    else
      result.push_back(*record);
    record.reset();
  }
  return result;
}

std::vector<std::shared_ptr<CellRecord>> run_plan(const Plan& plan, const std::vector<bool>& selected,
                                                  const std::vector<CellRecord>& finished, const RunOptions& options,
                                                  const RunObserver& observer) {
  const int threads = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(std::max(1, threads)));
  const auto start = Clock::now();
  const std::function<bool()> stop = [&] { return options.interrupted && options.interrupted->load() != 0; };
  const std::function<bool()> late = [&] {
    return options.time_budget && std::chrono::duration<double>(Clock::now() - start).count() > *options.time_budget;
  };
  const std::function<bool()> ended = [&] { return stop() || late(); };

  Records records, drawn;
  std::map<std::string_view, const CellRecord*> by_id, parts_by_name;
  for (const CellRecord& record : finished) {
    if (record.drawn_parts.empty())
      by_id[record.cell.id] = &record;
    else
      parts_by_name[record.cell.name] = &record;
  }
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    if (!selected[i]) continue;
    if (const auto at = by_id.find(plan.cells[i].id); at != by_id.end())
      records[i] = std::make_shared<CellRecord>(*at->second);
    else if (const auto parts = parts_by_name.find(plan.cells[i].name); parts != parts_by_name.end())
      (share_of(options, i).parts > 1 ? records : drawn)[i] = std::make_shared<CellRecord>(*parts->second);
  }

  PhaseClock clock(observer);
  const bool timing = options.timing && plan.timing.enabled;
  CellPreparer preparer(plan);
  expect_same_media(preparer, plan, records);
  expect_same_media(preparer, plan, drawn);
  expect_same_trackers(preparer, records);
  std::vector<PreparedCell> cells = prepare_all(
      preparer, plan, [&](std::size_t i) { return selected[i] && !records.contains(i); }, ended);
  // Statistics of a resumed run stand; a run that was stopped before or while timing still owes the times.
  const std::vector<PreparedCell> untimed = prepare_all(
      preparer, plan,
      [&](std::size_t i) {
        const auto record = records.find(i);
        return timing && record != records.end() && is_timed(*record->second, share_of(options, i)) && !record->second->time &&
               record->second->build.empty() && !plan.cells[i].minus;
      },
      ended);
  clock.end("preparation");
  for (PreparedCell& prepared : cells)
    prepared.theory_later = drawn.contains(prepared.index) ||
                            (prepared.kernel && share_of(options, prepared.index).part > 0 && !needs_theory(prepared));
  add_theory(cells, ended);
  clock.end("theory");
  std::vector<CellOutcome> outcomes = run_cells(plan, cells, drawn, threads, options, observer, late, stop);
  clock.end("sampling");

  std::vector<const PreparedCell*> to_time;
  to_time.reserve(untimed.size() + cells.size());
  for (const PreparedCell& prepared : untimed)
    if (prepared.scene) to_time.push_back(&prepared);
  Effort effort;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    effort += outcomes[i].effort;
    if (is_timed(*outcomes[i].record, share_of(options, cells[i].index)) && !cells[i].subtracted) to_time.push_back(&cells[i]);
    records[cells[i].index] = std::move(outcomes[i].record);
  }
  if (timing && !to_time.empty() && !ended()) {
    time_records(to_time, plan.timing, records, observer, ended);
    clock.end("timing");
  }
  if (effort.working > 0) {
    observer.verdict_share(effort.judging / (effort.working - effort.judging));
    observer.statistics_share(effort.statistics / (effort.working - effort.statistics));
  }
  std::vector<std::shared_ptr<CellRecord>> result;
  result.reserve(records.size());
  for (auto& [index, record] : records) result.push_back(std::move(record));
  return result;
}

}  // namespace nullmark
