#pragma once

#include "estimators/power_series.h"

namespace nullmark {

/// Power-series CMF estimator [Georgiev et al. 2019]: the first n0 terms beyond the zeroth are always summed, n0 the number of
/// Poisson terms of mean M = int mub that hold .99 of all; then the walk goes on to term i with chance M/i, which divides it.  So
/// P_i = 1 up to n0 and P_{i-1} M/i from there.  Unbiased for any rate, in (0, inf) where mub bounds; m1, m2 as in
/// p_series_next_flight.h, and the same M2.  Lookups n0 + sum_{i>n0} P_i.  n0 is found from a table of the ray, not by adding up
/// from e^{-M}, which underflows.
template <class Value>
struct PowerSeriesCmf {
  static constexpr const char* kName = "p_series_cmf";
  static constexpr const char* kSummary = "power series: sums all terms up to .99 of the Poisson law, then by Russian roulette";
  static constexpr const char* kSource = "Georgiev et al. 2019, p-series CMF";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kOwnFlights = true;
  static constexpr bool kLanes = true;

  static constexpr Real kShare = 0.99;
  /// Beyond it a walk takes more lookups than one may.
  static constexpr Real kDeepest = 0x1p31;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    PoissonTail tail;
    Real always = 0;  ///< n0
  };

  void prepare(RayData& ray) const {
    ray.always = 0;
    if (!(ray.majorant.total_depth() < kDeepest)) return;
    ray.tail.set_up(ray.majorant.total_depth());
    ray.always = ray.majorant.total_depth() > 0 ? static_cast<Real>(ray.tail.first_at_most(1 - kShare)) : 0;
  }

  struct Walk {
    SeriesSum<Value> series;
    Distance<Value> u;  ///< uniform, given that the walk has come so far
  };

  void init(Walk& walk, const auto& ray, auto&, auto& rng) const {
    walk.series.start(ray);
    walk.u = uniform_above_zero<Value>(rng);
  }

  auto propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    const auto lands = flight.total_depth() > 0;  // a depth may be above 0 in double alone
    if (none(lands)) return lands;
    const std::uint32_t i = flight.lookups() + 1;
    const Real chance = i > ray.always ? ray.majorant.total_depth() / i : 1;
    const auto goes_on = walk.u < chance;
    if (none(goes_on)) return goes_on;
    walk.u = walk.u / chance;
    land_anywhere(ray, flight, rng, goes_on);
    return goes_on;
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto&) const {
    const Real factor = at.lookups() > ray.always ? 1 : ray.majorant.total_depth() / at.lookups();
    walk.series.multiply(ray, factor * null_ratio(at, extinction));
    walk.series.add(1);
  }

  Value result(const Walk& walk, const auto&) const { return walk.series.total; }

  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    if (!(ray.majorant.total_depth() < kDeepest)) return {.lookups = ray.majorant.total_depth()};
    const SeriesMoments moments = series_moments(ray, profile, c);
    const Real always = ray.always;
    const auto log_growth = [&](std::int64_t n) {
      const auto i = static_cast<Real>(n);
      const Real log_chance = i > always ? (i - always) * std::log(moments.depth) - log_factorial(i) + log_factorial(always) : 0;
      return i * std::log1p(moments.spread) - log_chance;
    };
    Real more = 0, squares = 0, chance = 1;
    for (Real j = 1; chance > 1e-17; ++j) {
      chance *= moments.depth / (always + j);
      more += chance;
      squares += (2 * j - 1) * chance;
    }
    return {.variance = series_variance(moments.depth, moments.first, log_growth, last_poisson_term(moments)),
            .lookups = always + more,
            .lookups_variance = std::max<Real>(0, squares - more * more)};
  }
};

}  // namespace nullmark
