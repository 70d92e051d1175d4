#pragma once

#include <array>
#include <vector>

#include "media/base/medium.h"

namespace nullmark {

/// Cells lo <= index < hi of a lattice.
struct Block {
  std::array<int, 3> lo{}, hi{};

  int extent(std::size_t axis) const { return hi[axis] - lo[axis]; }
  std::int64_t cells() const { return std::int64_t{extent(0)} * extent(1) * extent(2); }

  /// The parts below and above a lattice plane.
  Block below(std::size_t axis, int plane) const {
    Block part = *this;
    part.hi[axis] = plane;
    return part;
  }
  Block above(std::size_t axis, int plane) const {
    Block part = *this;
    part.lo[axis] = plane;
    return part;
  }

  bool operator==(const Block&) const = default;
};

/// Bounds of the extinction on a regular lattice over a medium's local box, from which bounds of all its blocks follow; with the
/// world measures of blocks, which an affine frame makes parallelepipeds.  Filled in parallel; holds 16 bytes per cell and
/// channel, and 8 per cell.
class BoundLattice {
 public:
  /// Throws ParameterError where the medium has no finite bound or the lattice is too large.
  BoundLattice(const Medium& medium, const std::array<int, 3>& resolution);

  Block whole() const { return {{0, 0, 0}, resolution_}; }

  /// Local coordinate of a lattice plane.
  Real plane(std::size_t axis, int index) const;

  /// Local box of a block, wider by 1e-9 of a lattice cell: a point that rounding puts into the neighbouring block must still be
  /// bounded.
  Box bounded_box(const Block& block) const;

  /// World volume, length^3; area of a cut across an axis, length^2; surface, length^2; and diagonal, length.
  Real volume(const Block& block) const;
  Real cut(const Block& block, std::size_t axis) const;
  Real surface(const Block& block) const;
  Real diagonal(const Block& block) const;

  /// Largest channel's bound in a lattice cell, 1/length; cells of one x row are neighbours.
  const Real* rates(int y, int z) const { return rate_.data() + index(0, y, z); }

  /// Least and greatest extinction in a block, per channel; `average` is the middle of the two.
  Extrema bounds(const Block& block) const;

 private:
  static constexpr std::size_t kMostValues = std::size_t{1} << 26;

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(resolution_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(resolution_[0]) +
           static_cast<std::size_t>(x);
  }

  std::array<int, 3> resolution_;
  int channels_;
  Box box_;
  Vec3 size_;                 // of a cell, local
  std::array<Vec3, 3> edge_;  // of a cell, world
  std::vector<Real> rate_;
  std::vector<Real> minimum_, maximum_;  // [cell * channels + c]
};

}  // namespace nullmark
