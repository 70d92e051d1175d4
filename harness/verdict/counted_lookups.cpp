#include "harness/verdict/counted_lookups.h"

#include <algorithm>
#include <cmath>

namespace nullmark {
namespace {

/// Lookups may be off by this part, and theory's by a quadrature's error.
constexpr Real kOther = 0.01, kTheoryError = 1e-6;

/// One lookup for each collision, and the flight flown to its end.
bool counts_collisions(const Recording::Walk& walk, Real expected) {
  return walk.steps.size() == walk.collisions && walk.depth >= walk.total_depth &&
         std::abs(walk.total_depth - expected) <= kTheoryError * expected;
}

}  // namespace

std::uint64_t counted_walks(const Cell& cell, const Scene& scene, const Kernel& kernel, const CellTheory& theory, Real alpha,
                            const std::function<bool()>& stop) {
  const std::size_t rays = scene.rays->world.size();
  if (!kernel.flies() || theory.ray_lookups.empty() || rays == 0) return 0;
  const auto wanted = static_cast<std::size_t>(std::ceil(std::log(alpha) / std::log1p(-kOther)));
  const std::size_t taken = std::min(rays, wanted), per_ray = (wanted + taken - 1) / taken;
  const auto workspace = kernel.workspace();
  const std::uint64_t key = stream_key(cell, *scene.medium);
  PreparedRay context;
  Recording recording;
  SampleBlock block;
  Counters counters;
  for (std::size_t i = 0; i < taken; ++i) {
    const std::size_t ray = i * rays / taken;
    if (stop()) return 0;
    scene.context(ray, kernel, context);
    kernel.begin_ray(*workspace, *scene.medium->medium, scene.medium->extrema, context);
    recording.restart();
    workspace->recording = &recording;
    kernel.sample(*workspace, *scene.medium->medium, context, key, first_sample::kCountedLookups, per_ray, cell.quantity, block,
                  counters);
    workspace->recording = nullptr;
    const Real expected = theory.ray_lookups[ray];
    if (counters.overruns > 0 || !std::all_of(recording.walks.begin(), recording.walks.end(),
                                              [&](const Recording::Walk& walk) { return counts_collisions(walk, expected); }))
      return 0;
  }
  return taken * per_ray;
}

}  // namespace nullmark
