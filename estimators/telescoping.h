#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/debiased_theory.h"

namespace nullmark {

/// Debiased ray marching by a telescoping series [Misso, Bitterli, Georgiev, Jarosz 2022].  Marches of 1, 2, 4, ... steps with a
/// uniform offset converge to T; one of their differences is taken at random, n with p(n) = r (1 - r)^n, and over p(n).  Both of
/// its marches share K = 2^{n+1} lookups v_i = d mu((o + i) d/K): with E and O their means over even and over odd i,
///
///   T = mean_i e^{-v_i} + D/p(n),   D = e^{-(E+O)/2} - (e^{-E} + e^{-O})/2 <= 0.
///
/// In [-inf, 1].  Var = sum_n p(n) E_o[(base_n + D_n/p(n) - T)^2].  Lookups 2r/(2r - 1), of infinite variance from r = 3/4 down.
/// Constant extinction leaves no variance.  Of several channels one n and one offset.
template <class Value>
struct Telescoping {
  static constexpr const char* kName = "telescoping";
  static constexpr const char* kSummary = "debiased ray marching: one difference of a telescoping series of marches";
  static constexpr const char* kSource = "Misso, Bitterli, Georgiev, Jarosz 2022, Sec. 5";
  static constexpr SampleRange kRange = SampleRange::any_sign;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kHeavyLookups = true;

  Real r = 0.65;

  void parameters(ParameterVisitor& visit) {
    visit.number("r", r, {0.5, 0.93, true}, "",
                 "p(n) = r (1 - r)^n; mean lookups are finite above 1/2, variances of smooth media below 15/16");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    Value base, even, odd;  ///< sums of e^{-v_i}, and of mu at even and at odd i
    Real offset = 0, done = 0, count = 0, probability = 1;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto& rng) const {
    walk.base = walk.even = walk.odd = ray.value(0);
    const Real n = std::floor(rng.exponential() / -std::log1p(-r));
    walk.count = std::exp2(n + 1);
    walk.probability = r * std::pow(1 - r, n);
    walk.offset = rng.uniform();
    walk.done = 0;
  }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto&) const {
    if (!(ray.length() > 0) || walk.done == walk.count) return false;
    flight.jump(ray.begin + (walk.offset + walk.done) / walk.count * ray.length());
    return true;
  }

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight&, const Value& extinction, auto&) const {
    walk.base += exponential(Value(-extinction * ray.length()));
    (std::fmod(walk.done, 2) == 0 ? walk.even : walk.odd) += extinction;
    ++walk.done;
  }

  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    if (!(ray.length() > 0)) return ray.value(1);
    const Real of_half = ray.length() / (walk.count / 2);
    Value transmittance = walk.base / walk.count;
    for (int c = 0; c < ray.channels; ++c)
      channel(transmittance, c) +=
          march_difference(channel(walk.even, c) * of_half, channel(walk.odd, c) * of_half) / walk.probability;
    return transmittance;
  }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    if (!(ray.length() > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    const Real squares = 4 * (1 - r) < 1 ? 4 * r / (1 - 4 * (1 - r)) : kInfinity;
    const Real lookups = 2 * r / (2 * r - 1);
    return {.variance = telescoping_variance(profile, c, r), .lookups = lookups, .lookups_variance = squares - lookups * lookups};
  }
};

}  // namespace nullmark
