#include "harness/sampling/sampling.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

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

std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets,
                                   SampleSpan span, const TestPlan* plan, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress) {
  const std::size_t rays = scene.rays->local.size();
  const std::size_t outputs = targets.outputs;
  const std::uint64_t key = stream_key(cell, *scene.medium);
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

  std::vector<ChunkResult> results(chunks.size());
  std::atomic<bool> stopped = false;
  tbb::enumerable_thread_specific<Scratch> scratch([&] {
    Scratch fresh;
    fresh.workspace = kernel.workspace();
    fresh.workspace->stop = [&] {
      if (stop()) stopped = true;
      return stopped.load();
    };
    return fresh;
  });
  // Fills `errors` of an output, 0 for samples that are not finite, and tells those that count.
  constexpr Real kLargest = std::numeric_limits<Real>::max();
  const Real slack = cell.precision == Precision::float64 ? kRangeSlack : kSingleRangeSlack;
  const Real low = plan ? std::max(plan->low - slack, -kLargest) : -kLargest;
  const Real high = plan ? std::min(plan->high + slack, kLargest) : kLargest;
  const bool as_drawn = cell.measurement == Measurement{};
  const auto take_errors = [&](Scratch& mine, std::size_t o, Real target, std::span<Real> errors,
                               ChunkResult& out) -> std::span<const Real> {
    const std::vector<Real>& values = mine.block.values;
    const Real reference = measured(target, cell.measurement);
    if (as_drawn) {
      const Real* drawn = values.data();
      if (outputs > 1) {
        mine.finite.resize(errors.size());
        for (std::size_t i = 0; i < errors.size(); ++i) mine.finite[i] = values[i * outputs + o];
        drawn = mine.finite.data();
      }
      if (subtract(drawn, reference, low, high, errors, out.largest)) return errors;
    }
    mine.finite.clear();
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const Real value = values[i * outputs + o];
      errors[i] = 0;
      if (!std::isfinite(value)) {
        ++out.nonfinite;
        continue;
      }
      out.out_of_range += !(value >= low && value <= high);
      out.largest = std::max(out.largest, std::abs(value));
      errors[i] = measured(value, cell.measurement) - reference;
      mine.finite.push_back(errors[i]);
    }
    return mine.finite;
  };
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t at) {
    if (stopped || stop()) {
      stopped = true;
      return;
    }
    const Chunk& chunk = chunks[at];
    ChunkResult& out = results[at];
    Scratch& mine = scratch.local();
    out.moments.resize((chunk.end_ray - chunk.first_ray) * outputs);
    out.lookups.resize(chunk.end_ray - chunk.first_ray);
    out.lookups_squared.resize(chunk.end_ray - chunk.first_ray);
    out.null_collisions.resize(chunk.end_ray - chunk.first_ray);
    out.groups.resize(outputs);
    out.blocks.resize(outputs);
    out.group_sums.assign(outputs, 0);
    const auto begun = Clock::now();
    const bool varies = plan && !plan->variances.empty() && !span.only_evidence;
    const std::span<const MeanTest> tests = plan ? plan->tests : std::span<const MeanTest>();
    EvidenceAccumulator evidences(plan, tests, outputs, EvidenceAccumulator::Memory::of_this_thread(), out.evidence);
    EvidenceAccumulator variances(plan, varies ? plan->variances : std::span<const MeanTest>(), outputs,
                                  EvidenceAccumulator::Memory::of_variances(), out.variances);
    for (std::size_t ray = chunk.first_ray; ray < chunk.end_ray; ++ray) {
      scene.context(ray, kernel, mine.context);
      kernel.begin_ray(*mine.workspace, *scene.medium->medium, scene.medium->extrema, mine.context);
      const std::uint64_t lookups_before = out.counters.lookups, null_collisions_before = out.counters.null_collisions;
      const std::size_t local = ray - chunk.first_ray;
      for (std::uint64_t drawn = 0; drawn < chunk.count && !stopped; drawn += kBatch) {
        if (drawn > 0 && stop()) stopped = true;
        const std::uint64_t batch = std::min(kBatch, chunk.count - drawn);
        kernel.sample(*mine.workspace, *scene.medium->medium, mine.context, key, span.first + chunk.first + drawn, batch,
                      cell.quantity, mine.block, out.counters);
        const auto drawn_at = Clock::now();
        if (span.keep) result.kept.keep(ray, span.first + chunk.first + drawn, batch, mine.block.values);
        mine.errors.resize(batch * outputs);
        for (std::size_t o = 0; o < outputs; ++o) {
          const Real target = targets.mean[ray * outputs + o];
          const std::span<Real> errors(&mine.errors[o * batch], batch);
          const std::span<const Real> counted = take_errors(mine, o, target, errors, out);
          if (span.only_evidence) continue;
          out.blocks[o].add(ray, counted, out.moments[local * outputs + o]);
          out.groups[o].add(counted);
        }
        if (!span.only_evidence) out.lookups_squared[local] += sum_of_squares(mine.block.lookups);
        const auto counted_at = Clock::now();
        for (std::size_t o = 0; o < outputs && plan; ++o) {
          const std::span<Real> errors(&mine.errors[o * batch], batch);
          if (const Real shift = plan->shift[ray * outputs + o]; shift != 0)
            for (Real& error : errors) error -= shift;
          evidences.add_errors(ray, o, errors);
          if (!varies) continue;
          for (Real& error : errors) error = error * error - plan->stated_variance[ray * outputs + o];
          variances.add_errors(ray, o, errors);
        }
        evidences.add_lookups(ray, mine.block.lookups);
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
    const auto drawn_at = Clock::now();
    evidences.finish();
    variances.finish();
    const auto judged_at = Clock::now();
    out.statistics += judged_at - drawn_at;
    out.judging += judged_at - drawn_at;
    out.working += judged_at - begun;
    progress(static_cast<double>(++done) / static_cast<double>(chunks.size()));
  });
  if (stopped) return std::nullopt;

  std::vector<GroupErrors> across(outputs);  // groups larger than a chunk, within one ray
  for (std::size_t at = 0; at < chunks.size(); ++at) {
    const Chunk& chunk = chunks[at];
    const ChunkResult& part = results[at];
    for (std::size_t ray = chunk.first_ray; ray < chunk.end_ray; ++ray) {
      for (std::size_t o = 0; o < outputs; ++o)
        result.moments[ray * outputs + o] += part.moments[(ray - chunk.first_ray) * outputs + o];
      result.lookups[ray] += part.lookups[ray - chunk.first_ray];
      result.null_collisions[ray] += part.null_collisions[ray - chunk.first_ray];
      result.lookups_squared[ray] += part.lookups_squared[ray - chunk.first_ray];
    }
    for (std::size_t o = 0; o < outputs; ++o) {
      result.groups[o] += part.groups[o];
      result.blocks[o] += part.blocks[o];
      if (span.per_ray <= whole_chunk || span.only_evidence) continue;
      if (chunk.first == 0) across[o].finish_ray();
      if (chunk.count == whole_chunk) across[o].carry(static_cast<std::size_t>(level), part.group_sums[o]);
    }
    result.counters += part.counters;
    result.nonfinite += part.nonfinite;
    result.out_of_range += part.out_of_range;
    result.largest = std::max(result.largest, part.largest);
    result.statistics_seconds += std::chrono::duration<double>(part.statistics).count();
    result.judging_seconds += std::chrono::duration<double>(part.judging).count();
    result.working_seconds += std::chrono::duration<double>(part.working).count();
    for (const auto& [test, evidence] : part.evidence) result.evidence[test] += evidence;
    for (const auto& [test, evidence] : part.variances) result.variances[test] += evidence;
  }
  if (span.per_ray > whole_chunk && !span.only_evidence) {
    // A chunk's own groups already hold the level at which the chunks begin.
    for (std::size_t o = 0; o < outputs; ++o) result.groups[o].append_above(static_cast<std::size_t>(level), across[o]);
  }
  return result;
}

}  // namespace nullmark
