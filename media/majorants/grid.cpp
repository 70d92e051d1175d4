#include "media/majorants/grid.h"

#include <tbb/parallel_for.h>

#include "media/majorants/medium_bounds.h"

namespace nullmark {

GridMajorant::GridMajorant(const Medium& medium, const std::array<int, 3>& resolution, Real looseness, Crossing crossing)
    : resolution_(resolution), looseness_(looseness), crossing_(crossing), box_(medium.bounds()) {
  const Vec3 size = box_.extent().cwiseQuotient(Vec3(resolution[0], resolution[1], resolution[2]));
  diagonal_ = world_diagonal(medium, size);
  cells_.resize(static_cast<std::size_t>(resolution[0]) * static_cast<std::size_t>(resolution[1]) *
                static_cast<std::size_t>(resolution[2]));
  // A point that rounding puts into the neighbouring cell must still be bounded.
  const Vec3 margin = 1e-9 * size;
  tbb::parallel_for(0, resolution[2], [&](int z) {
    for (int y = 0; y < resolution_[1]; ++y)
      for (int x = 0; x < resolution_[0]; ++x) {
        const Vec3 lo = box_.lo + Vec3(x, y, z).cwiseProduct(size);
        cells_[index({x, y, z})] = medium.extrema({lo - margin, lo + size + margin});
      }
  });
  for (const Extrema& cell : cells_) expect_finite(cell.maximum.maxCoeff());
}

void GridMajorant::segments(const Ray& world, const Ray& local, SegmentBuffer& out) const {
  out.clear();
  out.crossing = crossing_;
  if (!(world.length() > 0)) return;
  const Vec3 size = box_.extent().cwiseQuotient(Vec3(resolution_[0], resolution_[1], resolution_[2]));
  const Vec3 start = local.at(local.begin);
  std::array<int, 3> at{}, step{};
  std::array<Real, 3> next{};
  for (int k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    const Real d = local.direction[k];
    at[axis] = std::clamp(static_cast<int>(std::floor((start[k] - box_.lo[k]) / size[k])), 0, resolution_[axis] - 1);
    step[axis] = d > 0 ? 1 : -1;
    next[axis] = kInfinity;
  }
  // Crossings are recomputed from the plane's index, not accumulated, so that they do not drift over many cells.
  const auto crossing = [&](std::size_t axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    if (local.direction[k] == 0) return kInfinity;
    const int plane = at[axis] + (step[axis] > 0 ? 1 : 0);
    return (box_.lo[k] + plane * size[k] - local.origin[k]) / local.direction[k];
  };
  for (std::size_t axis = 0; axis < 3; ++axis) next[axis] = crossing(axis);
  Real from = world.begin;
  for (;;) {
    const std::size_t axis = next[0] <= next[1] && next[0] <= next[2] ? 0 : next[1] <= next[2] ? 1 : 2;
    const bool leaves = step[axis] > 0 ? at[axis] + 1 >= resolution_[axis] : at[axis] == 0;
    const Real to = leaves ? world.end : std::min(next[axis], world.end);
    if (to > from) {
      const Extrema& here = cell(at);
      out.segments.push_back({from, to, looseness_ * here.maximum.maxCoeff(), here, diagonal_});
      from = to;
    }
    if (leaves || !(from < world.end)) break;
    at[axis] += step[axis];
    next[axis] = crossing(axis);
  }
  if (out.segments.empty() || out.segments.back().end < world.end) {
    const Extrema& here = cell(at);
    out.segments.push_back({from, world.end, looseness_ * here.maximum.maxCoeff(), here, diagonal_});
  }
}

}  // namespace nullmark
