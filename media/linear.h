#pragma once

#include "media/base/along_axis.h"

namespace nullmark {

/// f(s) = begin + (end - begin) s: linear up (begin < end) or down, 1/length.  With begin 0, end 1 one of the six profiles of
/// Georgiev et al. 2019.
struct LinearProfile {
  static constexpr const char* kName = "linear";
  static constexpr const char* kSummary = "extinction linear along an axis, up or down";
  static constexpr const char* kSource = "Georgiev et al. 2019, canonical profiles";

  Real begin = 0, end = 1;

  void parameters(ParameterVisitor& visit) {
    visit.number("begin", begin, Range::non_negative(), "1/length", "extinction at the lower face");
    visit.number("end", end, Range::non_negative(), "1/length", "extinction at the upper face");
  }

  template <class S>
  S value(const S& s) const {
    return begin + (end - begin) * s;
  }
  Real integral(Real a, Real b) const { return (b - a) * value((a + b) / 2); }
  std::pair<Real, Real> extrema(Real a, Real b) const { return std::minmax({value(a), value(b)}); }
  int polynomial_degree() const { return 1; }

  /// The root of f(a) x + (f(b) - f(a)) x^2/2 = mean, in the form that does not cancel.
  Real fraction_at(Real a, Real b, Real mean) const {
    const Real first = value(a), square = first * first + 2 * (value(b) - first) * mean;
    if (mean == 0) return 0;
    return square >= 0 ? 2 * mean / (first + std::sqrt(square)) : kInfinity;
  }
};

using Linear = AlongAxis<LinearProfile>;

}  // namespace nullmark
