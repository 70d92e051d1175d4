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
  static constexpr bool kLanes = true;

  Real r = 0.65;

  void parameters(ParameterVisitor& visit) {
    visit.number("r", r, {0.5, 0.93, true}, "",
                 "p(n) = r (1 - r)^n; mean lookups are finite above 1/2, variances of smooth media below 15/16");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    Real log_rest = 0;  ///< log (1 - r)
  };

  void prepare(RayData& ray) const { ray.log_rest = std::log1p(-r); }

  struct Walk {
    Value base, even, odd;          ///< means so far: of e^{-v_i}, and of mu at even and at odd i
    Distance<Value> offset, level;  ///< n
    Distance<Value> count;          ///< 2^{n+1}
  };

  void init(Walk& walk, const auto& ray, auto&, auto& rng) const {
    walk.base = walk.even = walk.odd = ray.value(0);
    walk.level = rounded_down(rng.exponential() / -ray.log_rest);
    walk.count = power_of_two(walk.level + 1);
    walk.offset = rng.uniform();
  }

  auto propose(Walk& walk, const auto& ray, auto& flight, auto&) const {
    flight.jump(ray.begin + (walk.offset + flight.lookups()) / walk.count * ray.length());
    return walk.count > (ray.length() > 0 ? flight.lookups() : kInfinity);
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto&) const {
    // Running means: sums lose digits with every lookup, and the longest marches take more than 10^4.
    const std::uint32_t done = at.lookups();
    const auto take_in = [](Value& mean, const Value& x, std::uint32_t n) { mean += (x - mean) * (1 / static_cast<Real>(n)); };
    take_in(walk.base, exponential(Value(-extinction * ray.length())), done);
    take_in(done % 2 == 1 ? walk.even : walk.odd, extinction, (done + 1) / 2);
  }

  Value result(const Walk& walk, const auto& ray) const {
    if (!(ray.length() > 0)) return ray.value(1);
    const Distance<Value> chance = r * exponential(walk.level * ray.log_rest);
    return walk.base + march_difference(Value(walk.even * ray.length()), Value(walk.odd * ray.length())) / chance;
  }

  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    if (!(ray.length() > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    const Real squares = 4 * (1 - r) < 1 ? 4 * r / (1 - 4 * (1 - r)) : kInfinity;
    const Real lookups = 2 * r / (2 * r - 1);
    return {.variance = telescoping_variance(profile, c, r), .lookups = lookups, .lookups_variance = squares - lookups * lookups};
  }
};

}  // namespace nullmark
