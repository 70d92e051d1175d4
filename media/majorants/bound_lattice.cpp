#include "media/majorants/bound_lattice.h"

#include <tbb/parallel_for.h>

#include <string>

#include "media/majorants/medium_bounds.h"

namespace nullmark {

BoundLattice::BoundLattice(const Medium& medium, const std::array<int, 3>& resolution)
    : resolution_(resolution),
      channels_(medium.channels()),
      box_(medium.bounds()),
      size_(box_.extent().cwiseQuotient(Vec3(resolution[0], resolution[1], resolution[2]))) {
  const Affine to_world = medium.world_to_local().inverse();
  for (std::size_t axis = 0; axis < 3; ++axis)
    edge_[axis] = to_world.linear() * (size_[static_cast<Eigen::Index>(axis)] * Vec3::Unit(static_cast<Eigen::Index>(axis)));
  const auto cells = static_cast<std::size_t>(whole().cells()), channels = static_cast<std::size_t>(channels_);
  if (cells * channels > kMostValues)
    throw ParameterError("", "the lattice of bounds would hold " + std::to_string(cells * channels) + " values, at most " +
                                 std::to_string(kMostValues) + " are allowed: lower its resolution");
  rate_.resize(cells);
  minimum_.resize(cells * channels);
  maximum_.resize(cells * channels);
  tbb::parallel_for(0, resolution_[1] * resolution_[2], [&](int row) {
    const int y = row % resolution_[1], z = row / resolution_[1];
    for (int x = 0; x < resolution_[0]; ++x) {
      const Extrema here = medium.extrema(bounded_box({{x, y, z}, {x + 1, y + 1, z + 1}}));
      const std::size_t at = index(x, y, z);
      rate_[at] = here.maximum.maxCoeff();
      for (std::size_t c = 0; c < channels; ++c) {
        minimum_[at * channels + c] = here.minimum[static_cast<Eigen::Index>(c)];
        maximum_[at * channels + c] = here.maximum[static_cast<Eigen::Index>(c)];
      }
    }
  });
  for (const Real rate : rate_) expect_finite(rate);
}

Real BoundLattice::plane(std::size_t axis, int index) const {
  const auto k = static_cast<Eigen::Index>(axis);
  return index == resolution_[axis] ? box_.hi[k] : box_.lo[k] + index * size_[k];
}

Box BoundLattice::bounded_box(const Block& block) const {
  const Vec3 margin = 1e-9 * size_;
  return {Vec3(plane(0, block.lo[0]), plane(1, block.lo[1]), plane(2, block.lo[2])) - margin,
          Vec3(plane(0, block.hi[0]), plane(1, block.hi[1]), plane(2, block.hi[2])) + margin};
}

Real BoundLattice::volume(const Block& block) const {
  return static_cast<Real>(block.cells()) * std::abs(edge_[0].cross(edge_[1]).dot(edge_[2]));
}

Real BoundLattice::cut(const Block& block, std::size_t axis) const {
  const std::size_t i = (axis + 1) % 3, j = (axis + 2) % 3;
  return Real{1} * block.extent(i) * block.extent(j) * edge_[i].cross(edge_[j]).norm();
}

Real BoundLattice::surface(const Block& block) const { return 2 * (cut(block, 0) + cut(block, 1) + cut(block, 2)); }

Real BoundLattice::diagonal(const Block& block) const {
  return (block.extent(0) * edge_[0] + block.extent(1) * edge_[1] + block.extent(2) * edge_[2]).norm();
}

Extrema BoundLattice::bounds(const Block& block) const {
  const auto channels = static_cast<std::size_t>(channels_);
  Extrema result;
  result.minimum = Spectrum::Constant(channels_, kInfinity);
  result.maximum = Spectrum::Constant(channels_, -kInfinity);
  for (int z = block.lo[2]; z < block.hi[2]; ++z)
    for (int y = block.lo[1]; y < block.hi[1]; ++y)
      for (std::size_t at = index(block.lo[0], y, z); at < index(block.hi[0], y, z); ++at)
        for (std::size_t c = 0; c < channels; ++c) {
          Real &low = result.minimum[static_cast<Eigen::Index>(c)], &high = result.maximum[static_cast<Eigen::Index>(c)];
          low = std::min(low, minimum_[at * channels + c]);
          high = std::max(high, maximum_[at * channels + c]);
        }
  result.average = (result.minimum + result.maximum) / 2;
  return result;
}

}  // namespace nullmark
