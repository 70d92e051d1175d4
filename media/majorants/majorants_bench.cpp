#include <array>

#include "harness/sampling/scene.h"
#include "harness/testing/bench.h"
#include "harness/testing/example_media.h"
#include "media/majorants/vdb_nodes.h"

namespace nullmark {
namespace {

// Traversal of every registered majorant structure at its defaults along random chords; items are segments.

constexpr int kCells = 16;  ///< of the hand-written grid along each axis, as many as the grid's default

/// Optical depth of the bounds along a local ray by 3D-DDA [Amanatides and Woo 1987]; adds the cells it met to `segments`.
Real plain_traversal(const Ray& ray, const Box& box, const std::vector<Real>& bounds, std::uint64_t& segments) {
  std::array<int, 3> cell, step;
  std::array<Real, 3> next, width;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const Real direction = ray.direction[a], size = box.extent()[a] / kCells;
    cell[axis] = std::clamp(static_cast<int>((ray.at(ray.begin)[a] - box.lo[a]) / size), 0, kCells - 1);
    step[axis] = direction > 0 ? 1 : -1;
    width[axis] = direction == 0 ? kInfinity : size / std::abs(direction);
    const Real plane = box.lo[a] + (cell[axis] + (direction > 0)) * size;
    next[axis] = direction == 0 ? kInfinity : (plane - ray.origin[a]) / direction;
  }
  for (Real t = ray.begin, depth = 0;;) {
    const std::size_t axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    const Real end = std::min(ray.end, next[axis]);
    depth += bounds[static_cast<std::size_t>((cell[2] * kCells + cell[1]) * kCells + cell[0])] * (end - t);
    ++segments;
    cell[axis] += step[axis];
    if (!(next[axis] < ray.end) || cell[axis] < 0 || cell[axis] == kCells) return depth;
    t = next[axis];
    next[axis] += width[axis];
  }
}

void plain_grid(benchmark::State& state, const BuiltMedium& medium, const BuiltRays& rays) {
  const Box box = medium.medium->bounds();
  std::vector<Real> bounds;
  for (int i = 0; i < kCells * kCells * kCells; ++i) {
    const Vec3 size = box.extent() / kCells,
               lo = box.lo + Vec3(i % kCells, i / kCells % kCells, i / kCells / kCells).cwiseProduct(size);
    bounds.push_back(medium.medium->extrema({lo, lo + size}).maximum[0]);
  }
  std::uint64_t segments = 0;
  for ([[maybe_unused]] auto _ : state)
    for (const Ray& ray : rays.local) benchmark::DoNotOptimize(plain_traversal(ray, box, bounds, segments));
  count_items(state, "segment", segments);
}

void traverse(benchmark::State& state, const MajorantStructure& majorant, const BuiltRays& rays) {
  SegmentBuffer buffer;
  std::uint64_t segments = 0;
  for ([[maybe_unused]] auto _ : state)
    for (std::size_t i = 0; i < rays.local.size(); ++i) {
      majorant.segments(rays.world[i], rays.local[i], buffer);
      benchmark::DoNotOptimize(buffer.segments.data());
      benchmark::ClobberMemory();
      segments += buffer.segments.size();
    }
  count_items(state, "segment", segments);
}

void add(const std::string& name, const Component& field) {
  MediumSpec spec;
  spec.field = field;
  const auto medium = std::make_shared<const BuiltMedium>(build_medium(spec));
  const auto rays = std::make_shared<const BuiltRays>(build_rays({"chords", {{"count", 256}}, {}, {}}, *medium));
  const std::string group = "traversal over " + name + "/";
  benchmark::RegisterBenchmark((group + "0 grid, hand-written").c_str(),
                               [=](benchmark::State& state) { plain_grid(state, *medium, *rays); });
  for (const ComponentInfo& entry : registered(ComponentKind::majorant)) {
    if (entry.name == VdbNodesSource::kName && !medium->medium->has_nodes()) continue;
    const std::shared_ptr<const MajorantStructure> majorant = build_majorant({entry.name, {}, {}, {}}, *medium).structure;
    benchmark::RegisterBenchmark((group + entry.name).c_str(),
                                 [=](benchmark::State& state) { traverse(state, *majorant, *rays); });
  }
}

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  add("fractal noise", {"fractal_noise", {{"peak", 100.}, {"sharpness", 5}}, {}, {}});
  Component volume = example_medium("vdb");
  volume.values["extinction_per_value"] = 100.;
  add("a volume of 128^3 voxels", volume);
});

}  // namespace
}  // namespace nullmark
