#pragma once

#include <numbers>

#include "media/base/along_axis.h"

namespace nullmark {

/// exp(-(s - center)^2 / (2 sigma^2)), s in [0,1]: what the bump adds and the hole takes away.
struct Bell {
  Real center = 0.32, sigma = 0.05;
  Real inverse_width = 0;  ///< 1 / (sqrt(2) sigma)

  void prepare() { inverse_width = 1 / (sigma * std::numbers::sqrt2); }

  void parameters(ParameterVisitor& visit) {
    visit.number("center", center, Range::between(-1e3, 1e3), "", "centre as a fraction of the axis, may lie outside [0,1]");
    visit.number("sigma", sigma, Range::positive(), "", "standard deviation as a fraction of the axis");
  }

  /// (s - center) / (sqrt(2) sigma); the bell is exp(-z^2), 1 minus it is -expm1(-z^2).
  template <class S>
  S z(const S& s) const {
    return (s - center) * inverse_width;
  }
  template <class S>
  S value(const S& s) const {
    return exponential(-z(s) * z(s));
  }

  /// A stretch so short that z^2 changes by less than 4 over it: differences of erf would cancel, a 15-point rule is exact.
  bool is_short(Real a, Real b) const {
    const Real u = z(a), v = z(b);
    return (v - u) * (1 + std::max(std::abs(u), std::abs(v))) < 2;
  }

  Real integral(Real a, Real b) const {
    if (is_short(a, b)) return integral_by_rule([this](Real s) { return value(s); }, a, b);
    const Real u = z(a), v = z(b);
    // Complements of the same side, so that the tails keep their relative accuracy.
    const Real difference = u >= 0   ? std::erfc(u) - std::erfc(v)
                            : v <= 0 ? std::erfc(-v) - std::erfc(-u)
                                     : std::erf(v) - std::erf(u);
    return sigma * std::sqrt(std::numbers::pi / 2) * difference;
  }

  std::pair<Real, Real> extrema(Real a, Real b) const {
    const auto ends = outward(std::minmax({value(a), value(b)}));
    return {ends.first, a <= center && center <= b ? 1 : std::min<Real>(1, ends.second)};
  }

  void knots(std::vector<Real>& s) const {
    // Unit steps where the bell matters, then wider ones down to underflow, so that relative accuracy holds in the tails.
    for (const int k : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 18, 20, 22, 24, 26, 28, 30, 32, 34, 36, 38})
      for (const int side : {-1, 1}) {
        const Real knot = center + side * k * sigma;
        if (knot > 0 && knot < 1 && (k > 0 || side > 0)) s.push_back(knot);
      }
  }
};

/// f(s) = amplitude exp(-(s - center)^2 / (2 sigma^2)), 1/length: a thin cloud layer in vacuum, the sparse profile of Georgiev et
/// al. 2019.
struct GaussianBumpProfile {
  static constexpr const char* kName = "gaussian_bump";
  static constexpr const char* kSummary = "Gaussian layer along an axis, nearly empty elsewhere";
  static constexpr const char* kSource = "Georgiev et al. 2019, canonical profiles";

  Real amplitude = 1;
  Bell bell;

  void parameters(ParameterVisitor& visit) {
    visit.number("amplitude", amplitude, Range::non_negative(), "1/length", "extinction at the centre");
    bell.parameters(visit);
  }

  void prepare() { bell.prepare(); }

  template <class S>
  S value(const S& s) const {
    return amplitude * bell.value(s);
  }
  Real integral(Real a, Real b) const { return amplitude * bell.integral(a, b); }
  std::pair<Real, Real> extrema(Real a, Real b) const {
    const auto [minimum, maximum] = bell.extrema(a, b);
    return {amplitude * minimum, amplitude * maximum};
  }
  void knots(std::vector<Real>& s) const { bell.knots(s); }
};

using GaussianBump = AlongAxis<GaussianBumpProfile>;

}  // namespace nullmark
