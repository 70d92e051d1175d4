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

  /// x runs fastest.
  std::size_t index(const std::array<int, 3>& at) const {
    const auto of = [](int i) { return static_cast<std::size_t>(i); };
    return (of(at[2]) * of(resolution[1]) + of(at[1])) * of(resolution[0]) + of(at[0]);
  }
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

/// 3D-DDA [Amanatides and Woo 1987]: the cells of a lattice along a ray, from one of its points on.
class LatticeWalk {
 public:
  /// Begins in the cell of the point at `from`, or in the nearest one.
  void start(const Lattice& lattice, const Ray& local, Real from, Real end) {
    from_ = from;
    end_ = end;
    const Vec3 start = local.at(from);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<Eigen::Index>(axis);
      at_[axis] =
          std::clamp(static_cast<int>(std::floor((start[k] - lattice.lo[k]) / lattice.size[k])), 0, lattice.resolution[axis] - 1);
      next_[axis] = crossing(lattice, local, axis, at_[axis]);
      after_[axis] = crossing(lattice, local, axis, at_[axis] + step(local, axis));
    }
  }

  Real from() const { return from_; }

  /// Calls visit(end, at) for the cells that follow until it returns false (then true) or the walk ends (then false).
  template <class Visit>
  bool go_on(const Lattice& lattice, const Ray& local, const Visit& visit) {
    while (from_ < end_) {
      const std::array<int, 3> here = at_;
      const std::size_t axis = next_[0] <= next_[1] && next_[0] <= next_[2] ? 0 : next_[1] <= next_[2] ? 1 : 2;
      const int onwards = here[axis] + step(local, axis);
      const bool leaves = onwards < 0 || onwards >= lattice.resolution[axis];
      const Real to = leaves ? end_ : std::min(next_[axis], end_);
      if (!leaves) {
        at_[axis] = onwards;
        next_[axis] = after_[axis];
        after_[axis] = crossing(lattice, local, axis, onwards + step(local, axis));
      }
      if (!(to > from_)) continue;
      from_ = to;
      if (!visit(to, here)) return true;
    }
    return false;
  }

 private:
  static int step(const Ray& local, std::size_t axis) { return local.direction[static_cast<Eigen::Index>(axis)] > 0 ? 1 : -1; }

  /// Where the ray leaves cell `at` along an axis.  From the plane's index, not accumulated, so that it does not drift over many
  /// cells.
  static Real crossing(const Lattice& lattice, const Ray& local, std::size_t axis, int at) {
    const auto k = static_cast<Eigen::Index>(axis);
    const Real direction = local.direction[k];
    if (direction == 0) return kInfinity;
    return (lattice.lo[k] + (at + (direction > 0 ? 1 : 0)) * lattice.size[k] - local.origin[k]) / direction;
  }

  Real from_ = 0, end_ = 0;
  std::array<int, 3> at_{};
  /// Where the ray leaves its cell along each axis, and the one after it: the next step need not wait for a division.
  std::array<Real, 3> next_{}, after_{};
};

}  // namespace nullmark
