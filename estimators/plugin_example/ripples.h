#pragma once

#include <array>
#include <numbers>

#include "media/base/field.h"

namespace nullmark {

/// Waves along all three axes: mu(p) = peak/3 sum_i sin^2(pi n_i s_i), 1/length, in [0, peak]; s_i = (p_i - lo_i) / (hi_i - lo_i)
/// and n_i whole waves.  Everything is exact: the axes are independent, so extrema and averages add up, and along a ray every
/// term is a sine of t with an elementary integral, so tau has a closed form in all directions.
struct Ripples {
  static constexpr const char* kName = "ripples";
  static constexpr const char* kSummary = "sinusoidal waves along all three axes";
  static constexpr const char* kSource = "nullmark, example of a plug-in";

  Real peak = 3;
  std::array<int, 3> waves = {2, 3, 5};
  Vec3 lo = Vec3::Zero(), hi = Vec3::Ones();

  void parameters(ParameterVisitor& visit) {
    visit.number("peak", peak, Range::non_negative(), "1/length", "extinction where the crests of all axes meet");
    visit.integer("waves_x", waves[0], 1, 64, "waves along x");
    visit.integer("waves_y", waves[1], 1, 64, "waves along y");
    visit.integer("waves_z", waves[2], 1, 64, "waves along z");
    visit.point("lo", lo, "length", "lower corner of the box");
    visit.point("hi", hi, "length", "upper corner of the box");
  }

  void prepare() const {
    if (Box{lo, hi}.empty()) throw ParameterError("hi", "box is empty: every component of hi must exceed that of lo");
  }

  Box bounds() const { return {lo, hi}; }

  Real extinction(const Vec3& p) const {
    Real sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += wave(turns(axis, p[axis]));
    return peak / 3 * sum;
  }

  Extrema extrema(const Box& box) const {
    Real minimum = 0, average = 0, maximum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Real a = turns(axis, box.lo[axis]), b = turns(axis, box.hi[axis]);
      const auto [low, high] = std::minmax({wave(a), wave(b)});
      minimum += std::ceil(a) <= b ? 0 : low;  // troughs lie at whole turns, crests half a turn from them
      maximum += std::ceil(a - 0.5) <= b - 0.5 ? 1 : high;
      average += mean(a, b);
    }
    // sin as computed is monotone to rounding only, and the bounds must hold for the values as computed.
    constexpr Real kRounding = 16 * std::numeric_limits<Real>::epsilon();
    minimum = std::max<Real>(0, minimum - kRounding);
    maximum = std::min<Real>(3, maximum + kRounding);
    return Extrema::grey(peak / 3 * minimum, peak / 3 * std::clamp(average, minimum, maximum), peak / 3 * maximum);
  }

  void knots(const Ray& ray, std::vector<Real>& t) const {
    for (int axis = 0; axis < 3; ++axis)
      append_planes(ray, axis, lo[axis], hi[axis], 2 * waves[static_cast<std::size_t>(axis)], t);
  }

  std::optional<Real> optical_depth(const Ray& ray) const {
    if (!(ray.length() > 0)) return 0;
    const Vec3 from = ray.at(ray.begin), to = ray.at(ray.end);
    Real sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += mean(turns(axis, from[axis]), turns(axis, to[axis]));
    return peak / 3 * sum * ray.length();
  }

 private:
  /// Waves from the lower face.
  Real turns(int axis, Real x) const {
    const Real s = std::clamp<Real>((x - lo[axis]) / (hi[axis] - lo[axis]), 0, 1);
    return waves[static_cast<std::size_t>(axis)] * s;
  }

  static Real wave(Real turns) {
    const Real sine = std::sin(std::numbers::pi * turns);
    return sine * sine;
  }

  /// Of the wave between a and b: (1 - cos(pi (a + b)) sinc(pi (b - a))) / 2.
  static Real mean(Real a, Real b) {
    const Real width = std::numbers::pi * (b - a);
    const Real sinc = std::abs(width) < 1e-8 ? 1 : std::sin(width) / width;
    return (1 - std::cos(std::numbers::pi * (a + b)) * sinc) / 2;
  }
};

}  // namespace nullmark
