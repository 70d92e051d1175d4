#pragma once

#include "media/gaussian_bump.h"

namespace nullmark {

/// f(s) = level - depth exp(-(s - center)^2 / (2 sigma^2)), 1/length, 0 <= depth <= level: a dense medium with a thin gap
/// (Georgiev et al. 2019).
struct GaussianHoleProfile {
  static constexpr const char* kName = "gaussian_hole";
  static constexpr const char* kSummary = "constant extinction with a Gaussian hole along an axis";
  static constexpr const char* kSource = "Georgiev et al. 2019, canonical profiles";

  Real level = 1, depth = 0.95;
  Bell bell;

  void parameters(ParameterVisitor& visit) {
    visit.number("level", level, Range::non_negative(), "1/length", "extinction far from the hole");
    visit.number("depth", depth, Range::non_negative(), "1/length", "reduction of the extinction at the centre, at most level");
    bell.parameters(visit);
  }

  void prepare() {
    bell.prepare();
    if (!(depth <= level))
      throw ParameterError("depth", "depth " + std::to_string(depth) + " exceeds level " + std::to_string(level) +
                                        ": the extinction would be negative at the centre; expected depth <= level");
  }

  // Written as rest + depth (1 - bell): with depth = level no cancellation where f touches zero.
  template <class S>
  S value(const S& s) const {
    return (level - depth) + depth * complement(s);
  }

  Real integral(Real a, Real b) const {
    const Real filled =
        bell.is_short(a, b) ? integral_by_rule([this](Real s) { return complement(s); }, a, b) : (b - a) - bell.integral(a, b);
    return (level - depth) * (b - a) + depth * filled;
  }

  std::pair<Real, Real> extrema(Real a, Real b) const {
    const auto ends = outward(std::minmax({value(a), value(b)}));
    return {a <= bell.center && bell.center <= b ? level - depth : ends.first, ends.second};
  }

  void knots(std::vector<Real>& s) const { bell.knots(s); }

 private:
  template <class S>
  S complement(const S& s) const {
    return one_minus_exponential(-bell.z(s) * bell.z(s));
  }
};

using GaussianHole = AlongAxis<GaussianHoleProfile>;

}  // namespace nullmark
