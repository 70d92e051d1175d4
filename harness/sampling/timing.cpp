#include "harness/sampling/timing.h"

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <boost/math/statistics/univariate_statistics.hpp>
#include <map>
#include <set>

#include "harness/model/in_flight.h"
#include "harness/model/names.h"
#include "harness/sampling/reference_loops.h"
#include "harness/statistics/median.h"
#include "media/volumes/volume.h"

namespace nullmark {
namespace {

using boost::math::statistics::median;

constexpr std::size_t kRays = 64;  ///< at most this many, spread evenly over the cell's

std::vector<std::size_t> timed_rays(const BuiltRays& rays) {
  std::vector<std::size_t> hits, chosen;
  for (std::size_t r = 0; r < rays.local.size(); ++r)
    if (rays.local[r].length() > 0) hits.push_back(r);
  const std::size_t count = std::min(kRays, hits.size());
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(hits[(2 * i + 1) * hits.size() / (2 * count)]);
  return chosen;
}

struct Repetition {
  Real ns_per_iteration = 0, samples = 0, lookups = 0;
  Real waiting = 0;  ///< see waiting_share
  Real seam = 0;     ///< nanoseconds of exchanges with a process
};

/// Google Benchmark 1.8 renamed `error_occurred` to `skipped`.
template <class Run>
bool was_skipped(const Run& run) {
  if constexpr (requires { run.error_occurred; })
    return run.error_occurred;
  else
    return static_cast<bool>(run.skipped);
}

class Collector final : public benchmark::BenchmarkReporter {
 public:
  Collector(const std::function<void(double)>& progress, std::size_t expected) : progress_(progress), expected_(expected) {}

  bool ReportContext(const Context&) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || was_skipped(run)) continue;
      const auto iterations = static_cast<Real>(run.iterations);
      all[run.run_name.function_name].push_back({run.real_accumulated_time / iterations * 1e9,
                                                 run.counters.at("samples") / iterations, run.counters.at("lookups") / iterations,
                                                 waiting_share(run.real_accumulated_time, run.cpu_accumulated_time),
                                                 seam(run) / iterations * 1e9});
      progress_(static_cast<double>(++seen_) / static_cast<double>(expected_));
    }
  }

  std::map<std::string, std::vector<Repetition>> all;

 private:
  static Real seam(const Run& run) {
    const auto told = run.counters.find("seam");
    return told == run.counters.end() ? 0 : static_cast<Real>(told->second);
  }

  std::function<void(double)> progress_;
  std::size_t expected_, seen_ = 0;
};

/// Names of the floors among the benchmarks.
std::string floor_name(Precision precision) { return "floor/" + to_string(precision); }
std::string memory_name(std::size_t bytes) { return fmt::format("memory/{}", bytes); }

template <class T>
void time_lane_floor(benchmark::State& state, std::uint64_t steps) {
  auto streams = LaneRng<T, kNativeLanes<T>>::seeded({1, 2, 3});
  volatile Real rate = 0.2;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(lane_floor_loop<T>(streams, rate, steps));
}

/// Memory of a volume's voxels; 0 for other media.
std::size_t voxel_bytes(const Medium& medium) {
  const auto* volume = dynamic_cast<const Volume*>(&medium);
  return volume ? volume->data().values.bytes() : 0;
}

/// Nanoseconds per sample of each repetition.
std::vector<Real> sample_times(const std::vector<Repetition>& repetitions) {
  std::vector<Real> ns;
  ns.reserve(repetitions.size());
  for (const Repetition& repetition : repetitions) ns.push_back(repetition.ns_per_iteration / repetition.samples);
  return ns;
}

BatchTime batch_time(std::uint64_t samples_per_traversal, std::vector<Real> ns) {
  const MedianSpread spread = median_spread(std::move(ns));
  return {samples_per_traversal, spread.median, spread.deviation};
}

/// Leaves Google Benchmark altogether: 1.7 aborts when a benchmark is skipped in one of several interleaved repetitions.
struct Interrupted {};

/// Samples a cell's rays over and over; every iteration takes new samples, so that no branch pattern is learnt by heart.
void run_cell(benchmark::State& state, const TimedCell& timed, const std::vector<std::size_t>& rays, std::uint64_t samples,
              const std::function<bool()>& stop) {
  const InFlight named(timed.cell->name);
  const std::uint64_t key = stream_key(*timed.cell, *timed.scene->medium);
  const Medium& medium = *timed.scene->medium->medium;
  const auto workspace = timed.kernel->workspace();
  PreparedRay context;
  SampleBlock block;
  Counters counters;
  std::uint64_t first = 0;
  if (stop()) throw Interrupted();
  for ([[maybe_unused]] auto _ : state) {
    for (const std::size_t ray : rays) {
      timed.scene->context(ray, *timed.kernel, context);
      timed.kernel->begin_ray(*workspace, medium, timed.scene->medium->extrema, context);
      timed.kernel->sample(*workspace, medium, context, key, first, samples, timed.cell->quantity, block, counters);
      benchmark::DoNotOptimize(block.values.data());
      benchmark::ClobberMemory();
    }
    first += samples;
  }
  state.counters["samples"] = static_cast<double>(counters.samples);
  state.counters["lookups"] = static_cast<double>(counters.lookups);
  state.counters["seam"] = timed.kernel->seam_seconds(*workspace);
}

const std::string kLoopName = "loop";

std::string batch_name(std::size_t cell, std::uint64_t samples) { return fmt::format("{}/{}", cell, samples); }

void initialise_once() {
  static const bool initialised = [] {
    char name[] = "nullmark", interleave[] = "--benchmark_enable_random_interleaving=true";
    char* arguments[] = {name, interleave, nullptr};
    int count = 2;
    benchmark::Initialize(&count, arguments);
    return true;
  }();
  (void)initialised;
}

/// Registers what is timed, interleaved, in one process.
class Registration {
 public:
  explicit Registration(const TimingPlan& plan) : plan_(plan) {}

  std::size_t count() const { return count_; }

  template <class Run>
  void add(const std::string& name, Run run) {
    ++count_;
    benchmark::RegisterBenchmark(name.c_str(), run)
        ->Repetitions(plan_.repetitions)
        ->MinTime(plan_.seconds)
        ->UseRealTime()
        ->Unit(benchmark::kNanosecond);
  }

  /// The cheapest possible steps, and reads of memory as large as the cells' volumes.
  void add_floors(const std::vector<TimedCell>& cells) {
    add_floor(floor_name(Precision::float64), time_lane_floor<Real>);
    add_floor(floor_name(Precision::float32), time_lane_floor<float>);
    std::set<std::size_t> sizes;
    for (const TimedCell& cell : cells)
      if (const std::size_t bytes = voxel_bytes(*cell.scene->medium->medium); bytes > 0 && sizes.insert(bytes).second)
        add_floor(memory_name(bytes), [bytes](benchmark::State& state, std::uint64_t steps) {
          const std::vector<float> buffer(bytes / sizeof(float), 1.f);
          std::uint64_t at = 0;
          for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(memory_floor_loop(buffer, at, steps));
        });
  }

 private:
  template <class Run>
  void add_floor(const std::string& name, Run run) {
    add(name, [run](benchmark::State& state) {
      constexpr std::uint64_t kSteps = 4096;
      run(state, kSteps);
      state.counters["samples"] = static_cast<double>(state.iterations());
      state.counters["lookups"] = static_cast<double>(static_cast<std::uint64_t>(state.iterations()) * kSteps);
    });
  }

  const TimingPlan& plan_;
  std::size_t count_ = 0;
};

/// The plain hand-written ratio loop.  Its inputs are volatile: Google Benchmark 1.7's DoNotOptimize of a double that is written
/// corrupts it under GCC.
void time_plain_loop(benchmark::State& state) {
  PlainRng rng(2);
  std::uint64_t lookups = 0, samples = 0;
  volatile Real majorant = 30, extinction = 15;
  for ([[maybe_unused]] auto _ : state) {
    const Real mu = extinction;
    for (int i = 0; i < 128; ++i)
      benchmark::DoNotOptimize(plain_ratio_loop(
          rng, majorant, [&](Real) { return mu; }, lookups));
    samples += 128;
  }
  state.counters["samples"] = static_cast<double>(samples);
  state.counters["lookups"] = static_cast<double>(lookups);
}

using Repetitions = std::map<std::string, std::vector<Repetition>>;

Real median_per_lookup(const std::vector<Repetition>& repetitions) {
  std::vector<Real> ns;
  for (const Repetition& repetition : repetitions)
    if (repetition.lookups > 0) ns.push_back(repetition.ns_per_iteration / repetition.lookups);
  return ns.empty() ? 0 : median(ns);
}

/// Nothing where repetitions are missing.
std::optional<TimeRecord> time_record(const TimedCell& cell, std::size_t index, const TimingPlan& plan, Repetitions& all) {
  const auto whole = static_cast<std::size_t>(plan.repetitions);
  const std::vector<Repetition>& repetitions = all[batch_name(index, plan.samples_per_traversal.back())];
  if (repetitions.size() != whole) return std::nullopt;
  TimeRecord time;
  time.repetition_ns = sample_times(repetitions);
  const BatchTime main = batch_time(plan.samples_per_traversal.back(), time.repetition_ns);
  time.ns_per_sample = main.ns_per_sample;
  time.mad = main.mad;
  if (plan.samples_per_traversal.size() > 1)
    for (const std::uint64_t samples : plan.samples_per_traversal)
      if (const auto& of_batch = all[batch_name(index, samples)]; of_batch.size() == whole)
        time.batches.push_back(batch_time(samples, sample_times(of_batch)));
  std::vector<Real> waiting, seam;
  for (const Repetition& repetition : repetitions) {
    waiting.push_back(repetition.waiting);
    seam.push_back(repetition.seam / repetition.samples);
  }
  time.waiting = median(waiting);
  time.seam_ns_per_sample = median(seam);
  time.ns_per_lookup = median_per_lookup(repetitions);
  const auto ratio = [&](const std::string& to) {
    const Real ns = median_per_lookup(all[to]);
    return ns > 0 ? time.ns_per_lookup / ns : 0;
  };
  time.floor_ratio = ratio(floor_name(cell.cell->precision));
  time.loop_ratio = ratio(kLoopName);
  if (const std::size_t bytes = voxel_bytes(*cell.scene->medium->medium); bytes > 0)
    time.memory_ratio = ratio(memory_name(bytes));
  time.repetitions = plan.repetitions;
  time.samples_per_traversal = plan.samples_per_traversal.back();
  return time;
}

/// What many samples share hides what each costs as renderers draw it.
TimingPlan with_a_sample_alone(TimingPlan plan) {
  std::vector<std::uint64_t>& sizes = plan.samples_per_traversal;
  if (sizes.front() != 1) sizes.insert(sizes.begin(), 1);
  return plan;
}

}  // namespace

Real waiting_share(Real wall_seconds, Real thread_seconds) {
  return wall_seconds > thread_seconds ? 1 - thread_seconds / wall_seconds : 0;
}

std::vector<std::optional<TimeRecord>> time_cells(const std::vector<TimedCell>& cells, const TimingPlan& asked,
                                                  const std::function<bool()>& stop,
                                                  const std::function<void(double)>& progress) {
  initialise_once();
  const TimingPlan plan = with_a_sample_alone(asked);
  std::vector<std::optional<TimeRecord>> result(cells.size());
  if (cells.empty()) return result;
  Registration registration(plan);
  registration.add_floors(cells);
  registration.add(kLoopName, time_plain_loop);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::vector<std::size_t> rays = timed_rays(*cells[i].scene->rays);
    if (rays.empty()) continue;
    for (const std::uint64_t samples : plan.samples_per_traversal)
      registration.add(batch_name(i, samples), [&cells, &stop, rays, i, samples](benchmark::State& state) {
        run_cell(state, cells[i], rays, samples, stop);
      });
  }
  Collector collector(progress, registration.count() * static_cast<std::size_t>(plan.repetitions));
  try {
    benchmark::RunSpecifiedBenchmarks(&collector);
  } catch (const Interrupted&) {
    return result;
  }
  benchmark::ClearRegisteredBenchmarks();
  for (std::size_t i = 0; i < cells.size(); ++i) result[i] = time_record(cells[i], i, plan, collector.all);
  return result;
}

}  // namespace nullmark
