#include "harness/sampling.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <cmath>

namespace nullmark {
namespace {

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
  Counters counters;
  std::uint64_t nonfinite = 0;
};

std::vector<Chunk> cut(std::size_t rays, std::uint64_t samples, std::uint64_t chunk) {
  std::vector<Chunk> chunks;
  if (samples > chunk) {
    for (std::size_t r = 0; r < rays; ++r)
      for (std::uint64_t first = 0; first < samples; first += chunk)
        chunks.push_back({r, r + 1, first, std::min(chunk, samples - first)});
  } else {
    const std::size_t together = std::max<std::size_t>(1, kBatch / samples);
    for (std::size_t r = 0; r < rays; r += together) chunks.push_back({r, std::min(rays, r + together), 0, samples});
  }
  return chunks;
}

/// The threads' private memory.
struct Scratch {
  std::unique_ptr<Workspace> workspace;
  RayContext context;
  SampleBlock block;
};

}  // namespace

Real measured(Real value, const Measurement& measurement) {
  if (measurement.clamp) value = std::min<Real>(1, std::max<Real>(0, value));
  if (measurement.quantise_bits > 0) {
    const Real steps = std::ldexp(1., measurement.quantise_bits) - 1;
    value = std::round(steps * value) / steps;
  }
  return value;
}

std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress) {
  const std::size_t rays = scene.rays->local.size();
  const auto channels = static_cast<std::size_t>(scene.reference->channels);
  const std::uint64_t key = stream_key(cell, *scene.medium);
  const int level = chunk_level(rays, cell.samples_per_ray);
  const std::uint64_t whole_chunk = std::uint64_t{1} << level;
  const std::vector<Chunk> chunks = cut(rays, cell.samples_per_ray, whole_chunk);

  Sampled result;
  result.moments.resize(rays * channels);
  result.reference.resize(rays * channels);
  result.lookups.resize(rays);
  result.groups.resize(channels);

  std::vector<ChunkResult> results(chunks.size());
  std::atomic<bool> stopped = false;
  tbb::enumerable_thread_specific<Scratch> scratch([&] {
    Scratch fresh{kernel.workspace(), {}, {}};
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
    out.groups.resize(channels);
    out.group_sums.assign(channels, 0);
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
        kernel.sample(*mine.workspace, *scene.medium->medium, mine.context, key, chunk.first + drawn, batch, cell.quantity,
                      mine.block, out.counters);
        for (std::size_t c = 0; c < channels; ++c) {
          Moments& moments = out.moments[local * channels + c];
          const Real reference = measured(expected[static_cast<Eigen::Index>(c)], cell.measurement);
          for (std::size_t i = 0; i < batch; ++i) {
            const Real value = mine.block.values[i * channels + c];
            if (!std::isfinite(value)) {
              ++out.nonfinite;
              continue;
            }
            const Real error = measured(value, cell.measurement) - reference;
            moments.add(error);
            out.groups[c].add(error);
          }
        }
      }
      out.lookups[local] = out.counters.lookups - lookups_before;
      for (std::size_t c = 0; c < channels; ++c) {
        out.group_sums[c] = out.moments[local * channels + c].s1;
        out.groups[c].finish_ray();
      }
    }
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
    }
    for (std::size_t c = 0; c < channels; ++c) {
      result.groups[c] += part.groups[c];
      if (cell.samples_per_ray <= whole_chunk) continue;
      if (chunk.first == 0) across[c].finish_ray();
      if (chunk.count == whole_chunk) across[c].carry(static_cast<std::size_t>(level), part.group_sums[c]);
    }
    result.counters += part.counters;
    result.nonfinite += part.nonfinite;
  }
  if (cell.samples_per_ray > whole_chunk) {
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
  for (std::size_t k = 0; k < count; ++k) {
    CellTheory& cell = result[k];
    for (std::size_t c = 0; c < channels; ++c) {
      std::optional<Real> variance = 0, bias = 0, squared = 0, lookups = 0;
      for (std::size_t ray = 0; ray < rays; ++ray) {
        const auto& [theory, expected] = all[(ray * count + k) * channels + c];
        const Real gap = theory.mean ? *theory.mean - expected : 0;
        variance = variance && theory.variance && std::isfinite(*theory.variance) ? std::optional(*variance + *theory.variance)
                                                                                  : std::nullopt;
        bias = *bias + gap;
        squared = *squared + gap * gap;
        lookups = lookups && theory.lookups ? std::optional(*lookups + *theory.lookups) : std::nullopt;
      }
      cell.variance.push_back(variance ? std::optional(*variance / n) : std::nullopt);
      cell.bias.push_back(variance ? std::optional(*bias / n) : std::nullopt);
      cell.squared_bias.push_back(variance ? std::optional(*squared / n) : std::nullopt);
      if (c == 0 && lookups) cell.lookups = *lookups / n;
    }
  }
  return result;
}

}  // namespace nullmark
