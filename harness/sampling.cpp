#include "harness/sampling.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <map>

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
  std::vector<std::uint64_t> lookups;
  std::vector<Real> lookups_squared;
  Counters counters;
  std::uint64_t nonfinite = 0, out_of_range = 0;
  std::map<std::size_t, Evidence> evidence;  ///< by test; a chunk touches few of them
  Clock::duration judging{}, working{};
};

/// Errors on their way to the tests of a gate: summed in short runs, gathered over rays, and bet on by the thousand.
class Evidences {
 public:
  Evidences(const CellGate* gate, std::size_t channels, std::map<std::size_t, Evidence>& out)
      : gate_(gate), out_(out), pooled_(channels), grouped_(channels) {
    if (!gate_) return;
    pending_.resize(gate_->tests.size());
    for (std::size_t i = 0; i < gate_->tests.size(); ++i) {
      const MeanTest& test = gate_->tests[i];
      if (test.channel == MeanTest::kLookups) {
        lookups_ = i;
      } else if (test.group == MeanTest::kAllRays) {
        pooled_[static_cast<std::size_t>(test.channel)] = i;
      } else {
        auto& list = grouped_[static_cast<std::size_t>(test.channel)];
        list.resize(std::max(list.size(), static_cast<std::size_t>(test.group) + 1));
        list[static_cast<std::size_t>(test.group)] = i;
      }
    }
  }

  void add_errors(std::size_t ray, std::size_t channel, std::span<const Real> errors) {
    if (!gate_ || !pooled_[channel]) return;
    sum(errors, gate_->errors_per_sum);
    feed(*pooled_[channel], errors);
    if (!grouped_[channel].empty()) feed(*grouped_[channel][static_cast<std::size_t>(gate_->group_of[ray])], errors);
  }

  void add_lookups(std::size_t ray, std::span<const std::uint32_t> lookups) {
    if (!gate_ || !lookups_) return;
    errors_.resize(lookups.size());
    for (std::size_t i = 0; i < lookups.size(); ++i) errors_[i] = static_cast<Real>(lookups[i]) - gate_->lookups[ray];
    sum(errors_, gate_->lookups_per_sum);
    feed(*lookups_, errors_);
  }

  void finish() {
    for (std::size_t test = 0; test < pending_.size(); ++test) flush(test);
  }

 private:
  static constexpr std::size_t kTogether = 8192, kEnough = 2048;

  /// Which errors share a sum is free; a stride lets all sums advance together.
  void sum(std::span<const Real> errors, int together) {
    const std::size_t count = errors.size() / static_cast<std::size_t>(together);
    sums_.assign(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(count));
    for (std::size_t k = 1; k < static_cast<std::size_t>(together); ++k)
      for (std::size_t j = 0; j < count; ++j) sums_[j] += errors[k * count + j];
  }

  void feed(std::size_t test, std::span<const Real> errors) {
    Evidence& evidence = out_[test];
    if (gate_->tests[test].deterministic) {
      for (const Real error : errors) evidence.largest_error = std::max(evidence.largest_error, std::abs(error));
      evidence.sums += sums_.size();
      return;
    }
    std::vector<Real>& waiting = pending_[test];
    if (waiting.empty() && sums_.size() >= kEnough) {
      evidence.add(gate_->tests[test], sums_, sum_length(test));
      return;
    }
    waiting.insert(waiting.end(), sums_.begin(), sums_.end());
    if (waiting.size() >= kTogether) flush(test);
  }

  void flush(std::size_t test) {
    if (pending_[test].empty()) return;
    out_[test].add(gate_->tests[test], pending_[test], sum_length(test));
    pending_[test].clear();
  }

  int sum_length(std::size_t test) const {
    return gate_->tests[test].channel == MeanTest::kLookups ? gate_->lookups_per_sum : gate_->errors_per_sum;
  }

  const CellGate* gate_;
  std::map<std::size_t, Evidence>& out_;
  std::vector<std::optional<std::size_t>> pooled_;                // test by channel
  std::vector<std::vector<std::optional<std::size_t>>> grouped_;  // by channel and group
  std::optional<std::size_t> lookups_;
  std::vector<std::vector<Real>> pending_;  // by test
  std::vector<Real> sums_, errors_;
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
  RayContext context;
  SampleBlock block;
  std::vector<Real> errors;
};

/// Rounding allowed to samples at the ends of their declared range.
constexpr Real kRangeSlack = 1e-9;

}  // namespace

Real measured(Real value, const Measurement& measurement) {
  if (measurement.clamp) value = std::min<Real>(1, std::max<Real>(0, value));
  if (measurement.quantise_bits > 0) {
    const Real steps = std::ldexp(1., measurement.quantise_bits) - 1;
    value = std::round(steps * value) / steps;
  }
  return value;
}

std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, SampleSpan span,
                                   const CellGate* gate, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress) {
  const std::size_t rays = scene.rays->local.size();
  const auto channels = static_cast<std::size_t>(scene.reference->channels);
  const std::uint64_t key = stream_key(cell, *scene.medium);
  const int level = chunk_level(rays, span.per_ray);
  const std::uint64_t whole_chunk = std::uint64_t{1} << level;
  const std::vector<Chunk> chunks = cut(rays, span.per_ray, whole_chunk);

  Sampled result;
  result.moments.resize(rays * channels);
  result.reference.resize(rays * channels);
  result.lookups.resize(rays);
  result.lookups_squared.resize(rays);
  result.groups.resize(channels);

  if (gate) result.evidence.resize(gate->tests.size());

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
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t at) {
    if (stopped || stop()) {
      stopped = true;
      return;
    }
    const Chunk& chunk = chunks[at];
    ChunkResult& out = results[at];
    Scratch& mine = scratch.local();
    out.moments.resize((chunk.end_ray - chunk.first_ray) * channels);
    out.lookups.resize(chunk.end_ray - chunk.first_ray);
    out.lookups_squared.resize(chunk.end_ray - chunk.first_ray);
    out.groups.resize(channels);
    out.group_sums.assign(channels, 0);
    const auto begun = Clock::now();
    Evidences evidences(gate, channels, out.evidence);
    for (std::size_t ray = chunk.first_ray; ray < chunk.end_ray; ++ray) {
      scene.context(ray, kernel, mine.context);
      kernel.begin_ray(*mine.workspace, *scene.medium->medium, scene.medium->extrema, mine.context);
      const Spectrum expected = kernel.expected(*mine.workspace, scene.reference->at(ray), cell.quantity);
      for (std::size_t c = 0; c < channels && chunk.first == 0; ++c)
        result.reference[ray * channels + c] = measured(expected[static_cast<Eigen::Index>(c)], cell.measurement);
      const std::uint64_t lookups_before = out.counters.lookups;
      const std::size_t local = ray - chunk.first_ray;
      for (std::uint64_t drawn = 0; drawn < chunk.count && !stopped; drawn += kBatch) {
        if (drawn > 0 && stop()) stopped = true;
        const std::uint64_t batch = std::min(kBatch, chunk.count - drawn);
        kernel.sample(*mine.workspace, *scene.medium->medium, mine.context, key, span.first + chunk.first + drawn, batch,
                      cell.quantity, mine.block, out.counters);
        mine.errors.resize(batch * channels);
        for (std::size_t c = 0; c < channels; ++c) {
          Moments& moments = out.moments[local * channels + c];
          const Real reference = measured(expected[static_cast<Eigen::Index>(c)], cell.measurement);
          const Real shift = gate ? gate->shift[ray * channels + c] : 0;
          for (std::size_t i = 0; i < batch; ++i) {
            const Real value = mine.block.values[i * channels + c];
            mine.errors[c * batch + i] = 0;
            if (!std::isfinite(value)) {
              ++out.nonfinite;
              continue;
            }
            if (gate && !(value >= gate->low - kRangeSlack && value <= gate->high + kRangeSlack)) ++out.out_of_range;
            const Real error = measured(value, cell.measurement) - reference;
            const Real counted = span.about_zero ? value : error;
            moments.add(counted);
            out.groups[c].add(counted);
            mine.errors[c * batch + i] = error - shift;
          }
        }
        const auto judging = Clock::now();
        for (std::size_t c = 0; c < channels && gate; ++c) evidences.add_errors(ray, c, {&mine.errors[c * batch], batch});
        evidences.add_lookups(ray, mine.block.lookups);
        out.judging += Clock::now() - judging;
        for (const std::uint32_t n : mine.block.lookups) out.lookups_squared[local] += static_cast<Real>(n) * n;
      }
      out.lookups[local] = out.counters.lookups - lookups_before;
      for (std::size_t c = 0; c < channels; ++c) {
        out.group_sums[c] = out.moments[local * channels + c].s1;
        out.groups[c].finish_ray();
      }
    }
    const auto judging = Clock::now();
    evidences.finish();
    out.judging += Clock::now() - judging;
    out.working += Clock::now() - begun;
    progress(static_cast<double>(++done) / static_cast<double>(chunks.size()));
  });
  if (stopped) return std::nullopt;

  std::vector<GroupErrors> across(channels);  // groups larger than a chunk, within one ray
  for (std::size_t at = 0; at < chunks.size(); ++at) {
    const Chunk& chunk = chunks[at];
    const ChunkResult& part = results[at];
    for (std::size_t ray = chunk.first_ray; ray < chunk.end_ray; ++ray) {
      for (std::size_t c = 0; c < channels; ++c)
        result.moments[ray * channels + c] += part.moments[(ray - chunk.first_ray) * channels + c];
      result.lookups[ray] += part.lookups[ray - chunk.first_ray];
      result.lookups_squared[ray] += part.lookups_squared[ray - chunk.first_ray];
    }
    for (std::size_t c = 0; c < channels; ++c) {
      result.groups[c] += part.groups[c];
      if (span.per_ray <= whole_chunk) continue;
      if (chunk.first == 0) across[c].finish_ray();
      if (chunk.count == whole_chunk) across[c].carry(static_cast<std::size_t>(level), part.group_sums[c]);
    }
    result.counters += part.counters;
    result.nonfinite += part.nonfinite;
    result.out_of_range += part.out_of_range;
    result.judging_seconds += std::chrono::duration<double>(part.judging).count();
    result.working_seconds += std::chrono::duration<double>(part.working).count();
    for (const auto& [test, evidence] : part.evidence) result.evidence[test] += evidence;
  }
  if (span.per_ray > whole_chunk) {
    // A chunk's own groups already hold the level at which the chunks begin.
    for (std::size_t c = 0; c < channels; ++c) result.groups[c].append_above(static_cast<std::size_t>(level), across[c]);
  }
  return result;
}

std::vector<CellTheory> compute_theory(const Scene& scene, const std::vector<const Kernel*>& kernels,
                                       const std::vector<Quantity>& quantities) {
  const std::size_t rays = scene.rays->local.size(), count = kernels.size();
  const auto channels = static_cast<std::size_t>(scene.reference->channels);
  struct RayTheory {
    Theory theory;
    Real expected = 0;
  };
  std::vector<RayTheory> all(rays * count * channels);
  struct Memory {
    std::vector<std::unique_ptr<Workspace>> workspaces;
    RayContext context;
    std::vector<Real> knots, ends, rates, x, y, z;
  };
  tbb::enumerable_thread_specific<Memory> memory([&] {
    Memory mine;
    for (const Kernel* kernel : kernels) mine.workspaces.push_back(kernel->workspace());
    return mine;
  });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays, 8), [&](const auto& range) {
    Memory& mine = memory.local();
    for (std::size_t ray = range.begin(); ray < range.end(); ++ray) {
      const Ray& local = scene.rays->local[ray];
      const Medium& medium = *scene.medium->medium;
      const RayProfile::Lookup lookup = [&](const Real* t, std::size_t n, Real* out) {
        mine.x.resize(n);
        mine.y.resize(n);
        mine.z.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
          mine.x[i] = local.origin.x() + t[i] * local.direction.x();
          mine.y[i] = local.origin.y() + t[i] * local.direction.y();
          mine.z[i] = local.origin.z() + t[i] * local.direction.z();
        }
        medium.extinction({mine.x.data(), mine.y.data(), mine.z.data(), n}, out);
      };
      sorted_knots(medium, local, mine.knots);
      std::optional<RayProfile> profile;
      for (std::size_t k = 0; k < count; ++k) {
        scene.context(ray, *kernels[k], mine.context);
        if (!profile) {
          mine.ends.clear();
          mine.rates.clear();
          for (const Segment& segment : mine.context.segments.segments) {
            mine.ends.push_back(segment.end);
            mine.rates.push_back(segment.majorant);
          }
          profile.emplace(lookup, static_cast<int>(channels), mine.knots, mine.ends, mine.rates);
        }
        kernels[k]->begin_ray(*mine.workspaces[k], medium, scene.medium->extrema, mine.context);
        const std::vector<Theory> theory = kernels[k]->theory(*mine.workspaces[k], *profile, quantities[k]);
        const Spectrum expected = kernels[k]->expected(*mine.workspaces[k], scene.reference->at(ray), quantities[k]);
        for (std::size_t c = 0; c < channels; ++c)
          all[(ray * count + k) * channels + c] = {theory[c], expected[static_cast<Eigen::Index>(c)]};
      }
    }
  });

  std::vector<CellTheory> result(count);
  const auto n = static_cast<Real>(rays);
  const auto finite = [](const std::optional<Real>& x) { return x && std::isfinite(*x); };
  for (std::size_t k = 0; k < count; ++k) {
    CellTheory& cell = result[k];
    bool all_variances = true, all_lookups = true, all_spreads = true;
    cell.ray_expected.resize(rays * channels);
    cell.ray_shift.resize(rays * channels);
    cell.ray_variance.resize(rays * channels);
    cell.ray_lookups.resize(rays);
    cell.ray_lookups_variance.resize(rays);
    for (std::size_t c = 0; c < channels; ++c) {
      Real variance = 0, bias = 0, squared = 0, lookups = 0;
      bool known = true;
      for (std::size_t ray = 0; ray < rays; ++ray) {
        const auto& [theory, expected] = all[(ray * count + k) * channels + c];
        const Real gap = theory.mean ? *theory.mean - expected : 0;
        cell.ray_expected[ray * channels + c] = expected;
        cell.ray_shift[ray * channels + c] = gap;
        cell.ray_variance[ray * channels + c] = theory.variance.value_or(0);
        known = known && finite(theory.variance);
        variance += theory.variance.value_or(0);
        bias += gap;
        squared += gap * gap;
        if (c > 0) continue;
        all_lookups = all_lookups && finite(theory.lookups);
        all_spreads = all_spreads && finite(theory.lookups_variance);
        lookups += cell.ray_lookups[ray] = theory.lookups.value_or(0);
        cell.ray_lookups_variance[ray] = theory.lookups_variance.value_or(0);
      }
      all_variances = all_variances && known;
      const auto where_known = [&](Real x) { return known ? std::optional(x / n) : std::nullopt; };
      cell.variance.push_back(where_known(variance));
      cell.bias.push_back(where_known(bias));
      cell.squared_bias.push_back(where_known(squared));
      if (c == 0 && all_lookups) cell.lookups = lookups / n;
    }
    if (!all_variances) cell.ray_variance.clear();
    if (!all_lookups) cell.ray_lookups.clear();
    if (!all_spreads) cell.ray_lookups_variance.clear();
  }
  return result;
}

std::vector<Real> expected_of(const Scene& scene, const Kernel& kernel, Quantity quantity) {
  const std::size_t rays = scene.rays->local.size();
  const auto channels = static_cast<std::size_t>(scene.reference->channels);
  std::vector<Real> result(rays * channels);
  const auto workspace = kernel.workspace();
  RayContext context;
  for (std::size_t ray = 0; ray < rays; ++ray) {
    scene.context(ray, kernel, context);
    kernel.begin_ray(*workspace, *scene.medium->medium, scene.medium->extrema, context);
    const Spectrum expected = kernel.expected(*workspace, scene.reference->at(ray), quantity);
    for (std::size_t c = 0; c < channels; ++c) result[ray * channels + c] = expected[static_cast<Eigen::Index>(c)];
  }
  return result;
}

bool bounds_everywhere(const Scene& scene, const Kernel& kernel) {
  constexpr Real kSlack = 1e-9;
  RayContext context;
  for (std::size_t ray = 0; ray < scene.rays->local.size(); ++ray) {
    scene.context(ray, kernel, context);
    for (const Segment& segment : context.segments.segments)
      if (segment.extinction.maximum.maxCoeff() > segment.majorant * (1 + kSlack)) return false;
  }
  return true;
}

}  // namespace nullmark
