#include "harness/sampling/sampling.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "harness/model/in_flight.h"
#include "harness/statistics/double8.h"

namespace nullmark {
namespace {

using Clock = std::chrono::steady_clock;

/// Samples that a kernel is asked for at once.
constexpr int kBatchLevel = 14;
constexpr std::uint64_t kBatch = std::uint64_t{1} << kBatchLevel;

/// Chunks of a cell, at most about: their results are kept until they are merged.
constexpr std::uint64_t kMostChunks = std::uint64_t{1} << 18;

/// log2 of the samples of one ray that make a chunk.  A power of two, so that a chunk is a complete group of the convergence
/// data; decided by the plan alone, never by the threads.
int chunk_level(std::size_t rays, std::uint64_t samples) {
  int level = kBatchLevel;
  while (level < 62 && (samples >> level) * rays > kMostChunks && (samples >> level) > 0) ++level;
  return level;
}

/// Rays [first_ray, end_ray) with all their samples, or one ray with samples [first, first + count).
struct Chunk {
  std::size_t first_ray, end_ray;
  std::uint64_t first, count;
};

struct ChunkResult {
  std::vector<Moments> moments;
  std::vector<Real> group_sums;  ///< per channel, of a split ray's chunk
  std::vector<GroupErrors> groups;
  std::vector<BlockErrors> blocks;
  std::vector<std::uint64_t> lookups, null_collisions;
  std::vector<Real> lookups_squared;
  Counters counters;
  std::uint64_t nonfinite = 0, out_of_range = 0;
  Real largest = 0;
  std::map<std::size_t, Evidence> evidence;  ///< by test; a chunk touches few of them
  std::map<std::size_t, Evidence> variances;
  Clock::duration judging{}, statistics{}, working{};
};

std::vector<Chunk> cut(std::size_t rays, std::uint64_t samples, std::uint64_t chunk) {
  std::vector<Chunk> chunks;
  if (samples > chunk) {
    for (std::size_t r = 0; r < rays; ++r)
      for (std::uint64_t first = 0; first < samples; first += chunk)
        chunks.push_back({r, r + 1, first, std::min(chunk, samples - first)});
  } else {
    // Small cells are cut as well, so that all threads have something to do.
    constexpr std::size_t kLeastChunks = 8;
    const std::size_t together = std::max<std::size_t>(1, std::min<std::size_t>(kBatch / samples, rays / kLeastChunks));
    for (std::size_t r = 0; r < rays; r += together) chunks.push_back({r, std::min(rays, r + together), 0, samples});
  }
  return chunks;
}

/// The threads' private memory.
struct Scratch {
  std::unique_ptr<Workspace> workspace;
  PreparedRay context;
  SampleBlock block;
  std::vector<Real> errors, finite;
};

/// Rounding allowed to samples at the ends of their declared range.
constexpr Real kRangeSlack = 1e-9, kSingleRangeSlack = 1e-5;

/// errors = values - reference; whether all values lie in [low, high], which none does that is not finite; then `largest` has
/// grown to the largest of their magnitudes.
bool subtract(const Real* values, Real reference, Real low, Real high, std::span<Real> errors, Real& largest) {
  Eight value{}, most{}, least{};
  auto inside = most == least;  // in every lane
  std::size_t i = 0;
  for (; i + kEight <= errors.size(); i += kEight) {
    load(values + i, value);
    inside &= (value >= low) & (value <= high);
    most = value > most ? value : most;
    least = value < least ? value : least;
    store(value - reference, &errors[i]);
  }
  bool all = true;
  Real farthest = largest;
  for (std::size_t lane = 0; lane < kEight; ++lane) {
    all &= inside[lane] != 0;
    farthest = std::max({farthest, most[lane], -least[lane]});
  }
  for (; i < errors.size(); ++i) {
    all &= values[i] >= low && values[i] <= high;
    errors[i] = values[i] - reference;
    farthest = std::max(farthest, std::abs(values[i]));
  }
  if (all) largest = farthest;
  return all;
}

Real sum_of_squares(std::span<const std::uint32_t> counts) {
  using Counts [[gnu::vector_size(kEight * sizeof(std::uint32_t))]] = std::uint32_t;
  Eight sum{};
  Counts each;
  std::size_t i = 0;
  for (; i + kEight <= counts.size(); i += kEight) {
    std::memcpy(&each, &counts[i], sizeof each);
    const Eight count = __builtin_convertvector(each, Eight);
    sum += count * count;
  }
  Real result = total(sum);
  for (; i < counts.size(); ++i) result += static_cast<Real>(counts[i]) * counts[i];
  return result;
}

}  // namespace

Real measured(Real value, const Measurement& measurement) {
  if (measurement.clamp) value = std::min<Real>(1, std::max<Real>(0, value));
  if (measurement.quantise_bits > 0) {
    const Real steps = std::ldexp(1., measurement.quantise_bits) - 1;
    value = std::round(steps * value) / steps;
  }
  return value;
}

namespace {

using Errors = std::span<Real>;

/// What all chunks of a cell share.
class ChunkSampler {
 public:
  ChunkSampler(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets, const SampleSpan& span,
               const TestPlan* plan, KeptSamples& kept)
      : cell_(cell),
        scene_(scene),
        kernel_(kernel),
        targets_(targets),
        span_(span),
        plan_(plan),
        kept_(kept),
        key_(stream_key(cell, *scene.medium)),
        as_drawn_(cell.measurement == Measurement{}),
        varies_(plan && !plan->variances.empty() && !span.only_evidence) {
    constexpr Real kLargest = std::numeric_limits<Real>::max();
    const Real slack = cell.precision == Precision::float64 ? kRangeSlack : kSingleRangeSlack;
    low_ = plan ? std::max(plan->low - slack, -kLargest) : -kLargest;
    high_ = plan ? std::min(plan->high + slack, kLargest) : kLargest;
  }

  /// Draws a chunk; in the middle of it where `stop` says so.
  void sample(const Chunk& chunk, Scratch& mine, ChunkResult& out, const std::function<bool()>& stop) const {
    const std::size_t rays = chunk.end_ray - chunk.first_ray, outputs = targets_.outputs;
    out.moments.resize(rays * outputs);
    out.lookups.resize(rays);
    out.lookups_squared.resize(rays);
    out.null_collisions.resize(rays);
    out.groups.resize(outputs);
    out.blocks.resize(outputs);
    out.group_sums.assign(outputs, 0);
    const auto begun = Clock::now();
    const std::span<const MeanTest> tests = plan_ ? plan_->tests : std::span<const MeanTest>();
    EvidenceAccumulator evidences(plan_, tests, outputs, EvidenceAccumulator::Memory::of_this_thread(), out.evidence);
    EvidenceAccumulator variances(plan_, varies_ ? plan_->variances : std::span<const MeanTest>(), outputs,
                                  EvidenceAccumulator::Memory::of_variances(), out.variances);
    for (std::size_t ray = chunk.first_ray; ray < chunk.end_ray; ++ray)
      sample_ray(chunk, ray, mine, out, evidences, variances, stop);
    const auto drawn_at = Clock::now();
    evidences.finish();
    variances.finish();
    const auto judged_at = Clock::now();
    out.statistics += judged_at - drawn_at;
    out.judging += judged_at - drawn_at;
    out.working += judged_at - begun;
  }

 private:
  void sample_ray(const Chunk& chunk, std::size_t ray, Scratch& mine, ChunkResult& out, EvidenceAccumulator& evidences,
                  EvidenceAccumulator& variances, const std::function<bool()>& stop) const {
    const Medium& medium = *scene_.medium->medium;
    const std::size_t local = ray - chunk.first_ray, outputs = targets_.outputs;
    scene_.context(ray, kernel_, mine.context);
    kernel_.begin_ray(*mine.workspace, medium, scene_.medium->extrema, mine.context);
    const std::uint64_t lookups_before = out.counters.lookups, null_collisions_before = out.counters.null_collisions;
    for (std::uint64_t drawn = 0; drawn < chunk.count; drawn += kBatch) {
      if (drawn > 0 && stop()) return;
      const std::uint64_t first = span_.first + chunk.first + drawn, batch = std::min(kBatch, chunk.count - drawn);
      kernel_.sample(*mine.workspace, medium, mine.context, key_, first, batch, cell_.quantity, mine.block, out.counters);
      const auto drawn_at = Clock::now();
      if (span_.keep) kept_.keep(ray, first, batch, mine.block.values);
      take_moments(ray, local, batch, mine, out);
      const auto counted_at = Clock::now();
      take_evidence(ray, batch, mine, evidences, variances);
      const auto judged_at = Clock::now();
      out.statistics += judged_at - drawn_at;
      out.judging += judged_at - counted_at;
    }
    out.lookups[local] = out.counters.lookups - lookups_before;
    out.null_collisions[local] = out.counters.null_collisions - null_collisions_before;
    for (std::size_t o = 0; o < outputs; ++o) {
      out.group_sums[o] = out.moments[local * outputs + o].s1;
      out.groups[o].finish_ray();
    }
  }

  void take_moments(std::size_t ray, std::size_t local, std::uint64_t batch, Scratch& mine, ChunkResult& out) const {
    const std::size_t outputs = targets_.outputs;
    mine.errors.resize(batch * outputs);
    for (std::size_t o = 0; o < outputs; ++o) {
      const std::span<const Real> counted =
          take_errors(mine, o, targets_.mean[ray * outputs + o], errors_of(mine, o, batch), out);
      if (span_.only_evidence) continue;
      out.blocks[o].add(ray, counted, out.moments[local * outputs + o]);
      out.groups[o].add(counted);
    }
    if (!span_.only_evidence) out.lookups_squared[local] += sum_of_squares(mine.block.lookups);
  }

  void take_evidence(std::size_t ray, std::uint64_t batch, Scratch& mine, EvidenceAccumulator& evidences,
                     EvidenceAccumulator& variances) const {
    const std::size_t outputs = targets_.outputs;
    for (std::size_t o = 0; o < outputs && plan_; ++o) {
      const Errors errors = errors_of(mine, o, batch);
      if (const Real shift = plan_->shift[ray * outputs + o]; shift != 0)
        for (Real& error : errors) error -= shift;
      evidences.add_errors(ray, o, errors);
      if (!varies_) continue;
      for (Real& error : errors) error = error * error - plan_->stated_variance[ray * outputs + o];
      variances.add_errors(ray, o, errors);
    }
    evidences.add_lookups(ray, mine.block.lookups);
  }

  static Errors errors_of(Scratch& mine, std::size_t o, std::uint64_t batch) { return {&mine.errors[o * batch], batch}; }

  /// Fills `errors` of an output, 0 for samples that are not finite, and returns those that count.
  std::span<const Real> take_errors(Scratch& mine, std::size_t o, Real target, Errors errors, ChunkResult& out) const {
    const std::size_t outputs = targets_.outputs;
    const std::vector<Real>& values = mine.block.values;
    const Real reference = measured(target, cell_.measurement);
    if (as_drawn_) {
      const Real* drawn = values.data();
      if (outputs > 1) {
        mine.finite.resize(errors.size());
        for (std::size_t i = 0; i < errors.size(); ++i) mine.finite[i] = values[i * outputs + o];
        drawn = mine.finite.data();
      }
      if (subtract(drawn, reference, low_, high_, errors, out.largest)) return errors;
    }
    mine.finite.clear();
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const Real value = values[i * outputs + o];
      errors[i] = 0;
      if (!std::isfinite(value)) {
        ++out.nonfinite;
        continue;
      }
      out.out_of_range += !(value >= low_ && value <= high_);
      out.largest = std::max(out.largest, std::abs(value));
      errors[i] = measured(value, cell_.measurement) - reference;
      mine.finite.push_back(errors[i]);
    }
    return mine.finite;
  }

  const Cell& cell_;
  const Scene& scene_;
  const Kernel& kernel_;
  const Targets& targets_;
  const SampleSpan& span_;
  const TestPlan* plan_;
  KeptSamples& kept_;
  std::uint64_t key_;
  bool as_drawn_, varies_;
  Real low_, high_;  ///< the range that the estimator declares, with slack
};

/// Adds the rays of a chunk, and what does not depend on rays.
void add_chunk(const Chunk& chunk, const ChunkResult& part, std::size_t outputs, Sampled& result) {
  const auto seconds = [](Clock::duration time) { return std::chrono::duration<double>(time).count(); };
  for (std::size_t ray = chunk.first_ray; ray < chunk.end_ray; ++ray) {
    const std::size_t local = ray - chunk.first_ray;
    for (std::size_t o = 0; o < outputs; ++o) result.moments[ray * outputs + o] += part.moments[local * outputs + o];
    result.lookups[ray] += part.lookups[local];
    result.null_collisions[ray] += part.null_collisions[local];
    result.lookups_squared[ray] += part.lookups_squared[local];
  }
  for (std::size_t o = 0; o < outputs; ++o) {
    result.groups[o] += part.groups[o];
    result.blocks[o] += part.blocks[o];
  }
  result.counters += part.counters;
  result.nonfinite += part.nonfinite;
  result.out_of_range += part.out_of_range;
  result.largest = std::max(result.largest, part.largest);
  result.statistics_seconds += seconds(part.statistics);
  result.judging_seconds += seconds(part.judging);
  result.working_seconds += seconds(part.working);
  for (const auto& [test, evidence] : part.evidence) result.evidence[test] += evidence;
  for (const auto& [test, evidence] : part.variances) result.variances[test] += evidence;
}

/// Groups of samples that are larger than a chunk, within one ray: from level `level` on.
void add_groups_across(const std::vector<Chunk>& chunks, const std::vector<ChunkResult>& parts, int level, Sampled& result) {
  const std::uint64_t whole_chunk = std::uint64_t{1} << level;
  std::vector<GroupErrors> across(result.groups.size());
  for (std::size_t at = 0; at < chunks.size(); ++at)
    for (std::size_t o = 0; o < across.size(); ++o) {
      if (chunks[at].first == 0) across[o].finish_ray();
      if (chunks[at].count == whole_chunk) across[o].carry(static_cast<std::size_t>(level), parts[at].group_sums[o]);
    }
  // A chunk's own groups already hold the level at which the chunks begin.
  for (std::size_t o = 0; o < across.size(); ++o) result.groups[o].append_above(static_cast<std::size_t>(level), across[o]);
}

}  // namespace

std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets,
                                   SampleSpan span, const TestPlan* plan, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress) {
  const std::size_t rays = scene.rays->local.size();
  const std::size_t outputs = targets.outputs;
  const int level = chunk_level(rays, span.per_ray);
  const std::uint64_t whole_chunk = std::uint64_t{1} << level;
  const std::vector<Chunk> chunks = cut(rays, span.per_ray, whole_chunk);

  Sampled result;
  result.moments.resize(rays * outputs);
  result.lookups.resize(rays);
  result.null_collisions.resize(rays);
  result.blocks.resize(outputs);
  result.lookups_squared.resize(rays);
  result.groups.resize(outputs);
  if (plan) result.evidence.resize(plan->tests.size());
  if (plan) result.variances.resize(plan->variances.size());
  if (span.keep) result.kept = KeptSamples(rays, span.first, span.per_ray, outputs);

  std::vector<ChunkResult> parts(chunks.size());
  std::atomic<bool> stopped = false;
  const std::function<bool()> stops = [&] {
    if (!stopped && stop()) stopped = true;
    return stopped.load();
  };
  tbb::enumerable_thread_specific<Scratch> scratch([&] {
    Scratch fresh;
    fresh.workspace = kernel.workspace();
    fresh.workspace->stop = stops;
    return fresh;
  });
  const ChunkSampler sampler(cell, scene, kernel, targets, span, plan, result.kept);
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t at) {
    if (stops()) return;
    const InFlight named(cell.name);
    sampler.sample(chunks[at], scratch.local(), parts[at], stops);
    progress(static_cast<double>(++done) / static_cast<double>(chunks.size()));
  });
  if (stopped) return std::nullopt;

  for (std::size_t at = 0; at < chunks.size(); ++at) add_chunk(chunks[at], parts[at], outputs, result);
  if (span.per_ray > whole_chunk && !span.only_evidence) add_groups_across(chunks, parts, level, result);
  return result;
}

}  // namespace nullmark
