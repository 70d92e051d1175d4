#pragma once

#include <array>

#include "media/base/field.h"

namespace nullmark {

/// Cells of two extinctions in turn, 1/length, in all three directions: cell (i, j, k) has extinction_a where i + j + k is even.
/// Jumps everywhere, the hard case of marching, bounds and grids.
///
/// Cells that a box covers by no more than rounding are left out of its bounds: otherwise a majorant grid aligned with the
/// cells would bound each by its neighbours as well.
struct Checkerboard {
  static constexpr const char* kName = "checkerboard";
  static constexpr const char* kSummary = "cells with two alternating extinctions in three dimensions";
  static constexpr const char* kSource = "a test field of this project";

  std::array<int, 3> cells = {8, 8, 8};
  Real even = 2, odd = 0;
  Vec3 lo = Vec3::Zero(), hi = Vec3::Ones();

  void parameters(ParameterVisitor& visit) {
    visit.integer("cells_x", cells[0], 1, 1024, "cells along x");
    visit.integer("cells_y", cells[1], 1, 1024, "cells along y");
    visit.integer("cells_z", cells[2], 1, 1024, "cells along z");
    visit.number("extinction_a", even, Range::non_negative(), "1/length", "extinction of the cell at lo and every second one");
    visit.number("extinction_b", odd, Range::non_negative(), "1/length", "extinction of the other cells");
    visit.point("lo", lo, "length", "lower corner of the box");
    visit.point("hi", hi, "length", "upper corner of the box");
  }

  void prepare() const {
    if (Box{lo, hi}.empty()) throw ParameterError("hi", "box is empty: every component of hi must exceed that of lo");
  }

  Box bounds() const { return {lo, hi}; }

  Real extinction(const Vec3& p) const {
    const int sum = cell(0, lattice(0, p[0])) + cell(1, lattice(1, p[1])) + cell(2, lattice(2, p[2]));
    return sum % 2 == 0 ? even : odd;
  }

  Extrema extrema(const Box& box) const {
    bool one_cell = true;
    int corner = 0;
    Real excess = 1;  // of even over odd cells, a fraction of the box: the axes' excesses multiply
    for (int axis = 0; axis < 3; ++axis) {
      const Real a = lattice(axis, box.lo[axis]), b = lattice(axis, box.hi[axis]);
      const Real rounding = 8 * std::numeric_limits<Real>::epsilon() * cells[static_cast<std::size_t>(axis)];
      int first = cell(axis, a), last = cell(axis, b);
      if (first < last && first + 1 - a <= rounding) ++first;
      if (first < last && b - last <= rounding) --last;
      corner += first;
      if (first == last) {
        excess *= first % 2 == 0 ? 1 : -1;
      } else {
        one_cell = false;
        excess *= (to_even(b) - to_even(a)) / (b - a);
      }
    }
    if (one_cell) {
      const Real value = corner % 2 == 0 ? even : odd;
      return Extrema::grey(value, value, value);
    }
    const auto [minimum, maximum] = std::minmax({even, odd});
    const Real average = even * (1 + excess) / 2 + odd * (1 - excess) / 2;
    return Extrema::grey(minimum, std::clamp(average, minimum, maximum), maximum);
  }

  void knots(const Ray& ray, std::vector<Real>& t) const {
    for (int axis = 0; axis < 3; ++axis) append_planes(ray, axis, lo[axis], hi[axis], cells[static_cast<std::size_t>(axis)], t);
  }

  int polynomial_degree() const { return 0; }

 private:
  /// In [0, cells].
  Real lattice(int axis, Real x) const {
    const Real n = cells[static_cast<std::size_t>(axis)];
    return std::clamp<Real>((x - lo[axis]) / (hi[axis] - lo[axis]) * n, 0, n);
  }
  int cell(int axis, Real at) const { return std::min(static_cast<int>(at), cells[static_cast<std::size_t>(axis)] - 1); }

  /// Distance to the nearest even number: rises over even cells, falls over odd ones.
  static Real to_even(Real at) { return std::abs(at - 2 * std::round(at / 2)); }
};

}  // namespace nullmark
