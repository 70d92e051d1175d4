#pragma once

#include "media/base/along_axis.h"

namespace nullmark {

/// f(s) = amplitude e^(rate s), 1/length, with s in [0,1] along the axis: rate is per axis, not per world length, so the
/// extinction changes by e^rate from the lower face to the upper one whatever the size of the box.  Rate 0 is constant.
struct ExponentialProfile {
  static constexpr const char* kName = "exponential";
  static constexpr const char* kSummary = "extinction growing or decaying exponentially along an axis";
  static constexpr const char* kSource = "a test field of this project";

  Real amplitude = 3, rate = -3;

  void parameters(ParameterVisitor& visit) {
    visit.number("amplitude", amplitude, Range::non_negative(), "1/length", "extinction at the lower face");
    visit.number("rate", rate, Range::between(-700, 700), "", "logarithm of the ratio of upper to lower face");
  }

  template <class S>
  S value(const S& s) const {
    return amplitude * exponential(rate * s);
  }

  Real integral(Real a, Real b) const {
    const Real growth = rate * (b - a);
    return growth == 0 ? (b - a) * value(a) : (b - a) * value(a) * (std::expm1(growth) / growth);
  }

  /// The root of f(a) (e^{g x} - 1)/g = mean, g = rate (b - a).
  Real fraction_at(Real a, Real b, Real mean) const {
    const Real growth = rate * (b - a), scaled = mean / value(a);
    if (growth == 0) return scaled;
    return growth * scaled > -1 ? std::log1p(growth * scaled) / growth : kInfinity;
  }

  std::pair<Real, Real> extrema(Real a, Real b) const {
    const std::pair<Real, Real> ends = std::minmax({value(a), value(b)});
    return rate == 0 ? ends : outward(ends);
  }

  /// Fifteen points resolve a factor of e^8.
  void knots(std::vector<Real>& s) const {
    constexpr Real kGrowth = 8;
    const Real pieces = std::ceil(std::abs(rate) / kGrowth);
    for (Real i = 1; i < pieces; ++i) s.push_back(i / pieces);
  }
};

using Exponential = AlongAxis<ExponentialProfile>;

}  // namespace nullmark
