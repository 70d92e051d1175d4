#pragma once

#include "media/base/along_axis.h"

namespace nullmark {

/// f(s) = -ln x, 1/length, x = x0 + s (x1 - x0) in [0,1]: rays perpendicular to the axis have the transmittance T = x^d, so one
/// image shows all transmittances from x0 to x1 (the test scene of Kozelj's comparison).  At x = 0 the extinction is unbounded:
/// lookups there see the smallest normal double in place of x (mu = 708.4), bounds over boxes that touch it are +infinity.
struct ExponentialCubeProfile {
  static constexpr const char* kName = "exponential_cube";
  static constexpr const char* kSummary = "extinction -ln x: rays perpendicular to the axis have the transmittance x^d";
  static constexpr const char* kSource = "Kozelj, Comparison of transmittance and distance estimators";

  Real x0 = 0, x1 = 1;

  void parameters(ParameterVisitor& visit) {
    visit.number("x0", x0, Range::between(0, 1), "", "x at the lower face, below 1");
    visit.number("x1", x1, Range::between(0, 1), "", "x at the upper face, above 0");
  }

  void prepare() const {
    if (!(x0 >= 0 && x0 < 1)) throw ParameterError("x0", "x0 = " + std::to_string(x0) + "; expected 0 <= x0 < 1");
    if (!(x1 > 0 && x1 <= 1)) throw ParameterError("x1", "x1 = " + std::to_string(x1) + "; expected 0 < x1 <= 1");
  }

  template <class S>
  S x(const S& s) const {
    return smaller(1, larger(0, x0 + s * (x1 - x0)));
  }
  template <class S>
  S value(const S& s) const {
    return negative_logarithm(larger(S(least_normal(s)), x(s))) + 0;
  }

  // With y = (u - v) / v the mean of -ln over [v, u] is -ln u + 1 - ln(1 + y) / y: nothing cancels as v -> u.
  Real integral(Real a, Real b) const {
    const auto [v, u] = std::minmax({x(a), x(b)});
    if (u == v) return (b - a) * value(a);
    const Real y = (u - v) / v;
    const Real excess = std::isinf(y) ? 1 : 1 - std::log1p(y) / y;
    return (b - a) * (excess - std::log(u));
  }

  std::pair<Real, Real> extrema(Real a, Real b) const {
    const auto [minimum, maximum] = outward(std::minmax({value(a), value(b)}));
    return {minimum, std::min(x(a), x(b)) < least_normal(x(a)) ? kInfinity : maximum};
  }

  // Halving x towards the logarithm's singularity keeps every piece smooth; what is left below 2^-64 weighs nothing.
  void knots(std::vector<Real>& s) const {
    if (x0 == x1) return;
    for (int halvings = 1; halvings <= 64; ++halvings) {
      const Real knot = (std::ldexp(Real{1}, -halvings) - x0) / (x1 - x0);
      if (knot > 0 && knot < 1) s.push_back(knot);
    }
  }
};

using ExponentialCube = AlongAxis<ExponentialCubeProfile>;

}  // namespace nullmark
