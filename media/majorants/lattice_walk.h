#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "media/base/types.h"

namespace nullmark {

/// Equal cells of a box, `size` wide, told by three numbers below `resolution`.
struct Lattice {
  Vec3 lo = Vec3::Zero(), size = Vec3::Ones();
  std::array<int, 3> resolution{1, 1, 1};

  std::size_t cells() const {
    std::size_t all = 1;
    for (const int n : resolution) all *= static_cast<std::size_t>(n);
    return all;
  }

  /// The numbers of a cell told by one; x runs fastest.
  std::array<int, 3> cell(std::size_t index) const {
    const auto x = static_cast<std::size_t>(resolution[0]), y = static_cast<std::size_t>(resolution[1]);
    return {static_cast<int>(index % x), static_cast<int>(index / x % y), static_cast<int>(index / x / y)};
  }

  Vec3 corner(const std::array<int, 3>& at) const { return lo + Vec3(at[0], at[1], at[2]).cwiseProduct(size); }

  /// A cell's box, wider by 1e-9 of it: a point that rounding puts into the neighbouring cell must still be bounded.
  Box bounded_box(const std::array<int, 3>& at) const {
    const Vec3 margin = 1e-9 * size, low = corner(at);
    return {low - margin, low + size + margin};
  }
};

/// 3D-DDA [Amanatides and Woo 1987]: the cells of a lattice along a ray, from one of its points on.  A cell is told by its index
/// alone: three small integers would be stored one by one and read together, and such a read waits for the stores.
class LatticeWalk {
 public:
  /// Begins in the cell of the point at `from`, or in the nearest one.
  void start(const Lattice& lattice, const Ray& local, Real from, Real end) {
    from_ = from;
    end_ = end;
    const Vec3 start = local.at(from);
    std::ptrdiff_t stride = 1;
    cell_ = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      const int last = lattice.resolution[axis] - 1;
      const int at = std::clamp(static_cast<int>(std::floor((start[k] - lattice.lo[k]) / lattice.size[k])), 0, last);
      const bool up = local.direction[k] > 0;
      cell_ += at * stride;
      left_[axis] = up ? last - at : at;
      stride_[axis] = up ? stride : -stride;
      plane_[axis] = up ? at + 1 : at;
      next_[axis] = crossing(lattice, local, axis);
      way_[axis] = up ? 1 : -1;
      plane_[axis] += way_[axis];
      after_[axis] = crossing(lattice, local, axis);
      stride *= last + 1;
    }
  }

  Real from() const { return from_; }

  /// Calls visit(end, cell) for the cells that follow until it returns false (then true) or the walk ends (then false); `cell` is
  /// an index into the lattice.
  template <class Visit>
  bool go_on(const Lattice& lattice, const Ray& local, const Visit& visit) {
    while (from_ < end_) {
      const std::ptrdiff_t here = cell_;
      const std::size_t axis = next_[0] <= next_[1] && next_[0] <= next_[2] ? 0 : next_[1] <= next_[2] ? 1 : 2;
      const bool leaves = left_[axis] == 0;
      const Real to = leaves ? end_ : std::min(next_[axis], end_);
      if (!leaves) {
        --left_[axis];
        cell_ += stride_[axis];
        next_[axis] = after_[axis];
        plane_[axis] += way_[axis];
        after_[axis] = plane_at(lattice, local, axis);
      }
      if (!(to > from_)) continue;
      from_ = to;
      if (!visit(to, static_cast<std::size_t>(here))) return true;
    }
    return false;
  }

 private:
  /// Where the ray meets plane_ of an axis.  From the plane's index, not accumulated, so that it does not drift over many cells.
  Real crossing(const Lattice& lattice, const Ray& local, std::size_t axis) const {
    return local.direction[static_cast<Eigen::Index>(axis)] == 0 ? kInfinity : plane_at(lattice, local, axis);
  }
  Real plane_at(const Lattice& lattice, const Ray& local, std::size_t axis) const {
    const auto k = static_cast<Eigen::Index>(axis);
    return (lattice.lo[k] + plane_[axis] * lattice.size[k] - local.origin[k]) / local.direction[k];
  }

  Real from_ = 0, end_ = 0;
  std::ptrdiff_t cell_ = 0;
  std::array<std::ptrdiff_t, 3> left_{}, stride_{};  ///< cells ahead of the current one along each axis; between their indices
  /// Where the ray leaves its cell along each axis, and the one after it: the next step need not wait for a division.
  std::array<Real, 3> next_{}, after_{};
  std::array<Real, 3> plane_{}, way_{};  ///< index of the plane of `after_`; from it to that of the next, 1 or -1
};

}  // namespace nullmark
