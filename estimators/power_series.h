#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "estimators/estimator.h"
#include "estimators/theory/log_factorial.h"

namespace nullmark {

// The power series of transmittance [Georgiev et al. 2019; Jonsson et al. 2020]: T = e^{-M} sum_k (int (mub - mu))^k / k!, M =
// int mub.  Each factor int (mub - mu) = M E[a] is looked up at a point of its own, of density mub/M, where a = 1 - mu/mub:
// uniform in majorant depth, in no order, whatever the cells.  So W_i = prod_{k<=i} (M/k) a(x_k) has mean (int (mub - mu))^i /
// i!, and the trackers differ in the chance P_i with which they get to term i, which divides it.

/// The uniform number of a walk that goes on while it is below a chance.  At 0 the walk would go on whatever the chance, so a 0
/// is taken for half the least number above it.
template <class Value>
Distance<Value> uniform_above_zero(auto& rng) {
  return larger(rng.uniform(), Distance<Value>(kInFloat<Value> ? 0x1p-25 : 0x1p-54));
}

/// The next lookup of the walks that go on: a point uniform in majorant depth.
template <class GoesOn>
[[gnu::always_inline]] inline void land_anywhere(const auto& ray, auto& flight, auto& rng, const GoesOn& goes_on) {
  const auto depth = rng.uniform(goes_on) * ray.majorant.total_depth();
  const auto inside = flight.land(depth);
  if (!none(!inside)) flight.land(select(inside, depth, decltype(depth)(0)));  // denormal depths round up
}

/// e^{-M} (W_0 + W_1 + ...), W_0 = 1.  W may pass e^M, and e^{-M} is 0 from M = 746 on, so W is kept as a number near 1 times a
/// power of 2, which a term's e^{-M} takes in: a term underflows where it is 0 in double, and none overflows.
template <class Value>
struct SeriesSum {
  /// W = weight * 2^(64 scale), scale >= 0; factor = e^{-M} 2^(64 scale).
  struct Scaled {
    Value weight;
    Distance<Value> factor, scale;
  };
  Scaled at;
  Value total;

  void start(const auto& ray) {
    at = {ray.value(1), factor(0, ray.majorant.total_depth()), 0};
    total = at.weight * at.factor;
  }

  /// W *= by; powers of 2 are exact, so W is the same however it is kept.
  void multiply(const auto& ray, const Value& by) {
    at.weight *= by;
    const Distance<Value> most = largest(Value(magnitude(at.weight)));
    if (!none((most > kBig) | ((at.scale > 0) & (most < 1 / kBig)))) at = rescaled(at, ray.majorant.total_depth());
  }

  /// Adds e^{-M} W / `chance`.
  void add(const Distance<Value>& chance) { total += at.weight * (at.factor / chance); }

  /// min(1, |W|), the largest channel's; no number where W is none.
  Distance<Value> magnitude_to_one() const {
    const Distance<Value> most = largest(Value(magnitude(at.weight)));
    return select((most > 1) | (at.scale > 0), Distance<Value>(1), most);
  }

 private:
  static constexpr Real kBig = 0x1p64, kLogBig = 44.36141955583649979;  // 64 log 2

  /// e^{-M} 2^(64 scale).  In float what is no normal number is 0: a CPU takes hundreds of cycles for others.
  static Real factor(Real scale, Real depth) {
    const Real factor = exponential(scale * kLogBig - depth);
    return kInFloat<Value> && factor < 0x1p-126 ? 0 : factor;
  }

  /// Powers of 2 go over between weight and factor.  By value: what a call could reach would not stay in registers.
  [[gnu::noinline]] static Scaled rescaled(Scaled at, Real depth) {
    for (;;) {
      const Distance<Value> most = largest(Value(magnitude(at.weight)));
      const auto large = (most > kBig) & (most < kInfinity), small = (most < 1 / kBig) & (at.scale > 0);
      if (none(large | small)) break;
      at.weight *= select(large, Distance<Value>(1 / kBig), select(small, Distance<Value>(kBig), Distance<Value>(1)));
      at.scale += select(large, Distance<Value>(1), select(small, Distance<Value>(-1), Distance<Value>(0)));
    }
    at.factor = one_by_one(at.scale, [&](Real scale) { return factor(scale, depth); });
    return at;
  }
};

/// P(N >= i) of a Poisson number N, as a table over the some 20 standard deviations where it is neither 1 nor below 2^-100, which
/// is beyond what a uniform number of 53 bits tells apart.  Made in as many steps, by sums of positive terms from the far end.
class PoissonTail {
 public:
  void set_up(Real mean);

  /// P(N >= i).
  Real at_least(std::int64_t i) const {
    if (i < first_) return 1;
    const auto k = static_cast<std::size_t>(i - first_);
    return k < tail_.size() ? tail_[k] : 0;
  }

  /// Least i with P(N >= i) <= chance.
  std::int64_t first_at_most(Real chance) const;

  /// log P(N >= i), beyond the table as well.
  Real log_at_least(std::int64_t i) const;

 private:
  Real mean_ = 0;
  std::int64_t first_ = 1;
  std::vector<Real> tail_;
};

/// The first two moments of a factor: int (mub - mu), and M int (mub - mu)^2/mub over the square of the former.
struct SeriesMoments {
  Real depth = 0;   ///< M
  Real first = 0;   ///< int (mub - mu); never 0 where the ratio is not
  Real spread = 0;  ///< M int (mub - mu)^2/mub over first^2, less 1
};
template <class Value>
SeriesMoments series_moments(const MediumRay<Value>& ray, const RayProfile& profile, int c);

/// Variance of X = e^{-M} sum_{i<=K} W_i/P_i.  With t_i = e^{-M} first^i/i! and E[W_i^2/P_i] = growth_i (first^i/i!)^2, later
/// factors being independent, Var X = sum_i (growth_i - 1) t_i^2 (2 B_i - 1), B_i = sum_{j>=i} t_j/t_i = 1 + first/(i+1) B_{i+1}:
/// no difference of large numbers, and 0 where it should be.  `last`: no later i matters.  Nothing where the terms alternate in
/// sign and cancel, or are too many.
std::optional<Real> series_variance(Real depth, Real first, const std::function<Real(std::int64_t)>& log_growth, Real last);

/// A last term for series_variance where P_i is at least that of a Poisson number of mean M.
Real last_poisson_term(const SeriesMoments& moments);

template <class Value>
SeriesMoments series_moments(const MediumRay<Value>& ray, const RayProfile& profile, int c) {
  SeriesMoments moments{.depth = ray.majorant.total_depth()};
  if (!(moments.depth > 0)) return moments;
  const auto rate = [&](const RayProfile::Node& at) { return ray.majorant.rate(at.piece); };
  const auto ratio = [&](const RayProfile::Node& at) { return rate(at) > 0 ? (rate(at) - at.extinction) / rate(at) : 0; };
  moments.first = profile.integrate(c, [&](const RayProfile::Node& at) { return rate(at) * ratio(at); });
  const Real mean = moments.first / moments.depth;
  const Real centred = moments.depth * profile.integrate(c, [&](const RayProfile::Node& at) {
    return rate(at) > 0 ? rate(at) * (ratio(at) - mean) * (ratio(at) - mean) : 0;
  });
  const Real least = 1e-30 * std::sqrt(centred);  // only its products with the spread count then
  if (std::abs(moments.first) < least) moments.first = least;
  moments.spread = moments.first != 0 ? centred / (moments.first * moments.first) : 0;
  return moments;
}

}  // namespace nullmark
