#pragma once

#include <numbers>

#include "media/base/along_axis.h"

namespace nullmark {

/// f(s) = 1 + cos(frequency s + phase), 1/length, in [0,2]; s in [0,1], frequency and phase in radians.  The oscillating profile
/// of Georgiev et al. 2019.
struct CosineProfile {
  static constexpr const char* kName = "cosine";
  static constexpr const char* kSummary = "extinction oscillating between 0 and a peak along an axis";
  static constexpr const char* kSource = "Georgiev et al. 2019, canonical profiles";

  Real frequency = 20, phase = 0.8;

  void parameters(ParameterVisitor& visit) {
    visit.number("frequency", frequency, Range::between(0, 1e4), "", "radians from the lower to the upper face");
    visit.number("phase", phase, Range::between(-1e3, 1e3), "", "radians at the lower face");
  }

  // 1 + cos x = 2 cos^2(x/2) keeps relative accuracy where f touches zero.
  template <class S>
  S value(const S& s) const {
    return from_half_angle((frequency * s + phase) / 2);
  }

  // (b - a) (1 + cos(middle) sinc(y)), y half the angle between the ends, again as a sum of terms that do not cancel.
  Real integral(Real a, Real b) const {
    const Real y = frequency * (b - a) / 2;
    const Real lost = one_minus_sinc(y);
    return (b - a) * (lost + (1 - lost) * value((a + b) / 2));
  }

  std::pair<Real, Real> extrema(Real a, Real b) const {
    if (frequency == 0) return {value(a), value(a)};
    const auto ends = outward(std::minmax({value(a), value(b)}));
    // Slightly widened, so that a crest at an end is not missed by rounding.
    const Real from = frequency * a + phase, to = frequency * b + phase;
    const Real slack = 8 * std::numeric_limits<Real>::epsilon() * (1 + std::max(std::abs(from), std::abs(to)));
    const auto holds = [&](Real first) {  // a point first + 2 pi k in [from, to]
      constexpr Real kPeriod = 2 * std::numbers::pi;
      return std::ceil((from - slack - first) / kPeriod) <= (to + slack - first) / kPeriod;
    };
    return {holds(std::numbers::pi) ? 0 : ends.first, holds(0) ? 2 : std::min<Real>(2, ends.second)};
  }

  void knots(std::vector<Real>& s) const {
    if (frequency == 0) return;
    constexpr Real kQuarter = std::numbers::pi / 2;
    for (Real k = std::ceil(phase / kQuarter); k * kQuarter < frequency + phase; ++k)
      s.push_back((k * kQuarter - phase) / frequency);
  }

 private:
  template <class S>
  static S from_half_angle(const S& x) {
    return 2 * cosine(x) * cosine(x);
  }

  static Real one_minus_sinc(Real y) {
    if (std::abs(y) > 1) return 1 - std::sin(y) / y;
    const Real q = y * y;
    Real sum = 1;
    for (int k = 9; k >= 1; --k) sum = 1 - sum * q / ((2 * k + 2) * (2 * k + 3));
    return sum * q / 6;
  }
};

using Cosine = AlongAxis<CosineProfile>;

}  // namespace nullmark
