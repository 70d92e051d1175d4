#pragma once

#include "estimators/power_series.h"

namespace nullmark {

/// Power-series next-flight estimator [Georgiev et al. 2019]: N is a Poisson number of mean M = int mub, and the terms up to the
/// N-th are summed, each over its chance P_i = P(N >= i): e^{-M} sum_{i<=N} W_i/P_i.  Unbiased for any rate, in (0, inf) where
/// mub bounds.  N comes from one u: the walk goes on while u < P_i.  With m1 = int (mub - mu) and m2 = M int (mub - mu)^2/mub, M2
/// = e^{-2M} (sum_i m2^i/(i!^2 P_i) + 2 sum_{i<j} m2^i m1^{j-i}/(i! j! P_i)); lookups int mub.
template <class Value>
struct PowerSeriesNextFlight {
  static constexpr const char* kName = "p_series_next_flight";
  static constexpr const char* kSummary =
      "power series: a Poisson number of terms, each divided by the probability of reaching it";
  static constexpr const char* kSource = "Georgiev et al. 2019, p-series next-flight";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kOwnFlights = true;
  static constexpr bool kLanes = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    PoissonTail tail;
  };

  void prepare(RayData& ray) const { ray.tail.set_up(ray.majorant.total_depth()); }

  struct Walk {
    SeriesSum<Value> series;
    Distance<Value> u;  ///< uniform
  };

  void init(Walk& walk, const auto& ray, auto&, auto& rng) const {
    walk.series.start(ray);
    walk.u = uniform_above_zero<Value>(rng);
  }

  auto propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    const auto goes_on = walk.u < ray.tail.at_least(flight.lookups() + 1);
    if (!none(goes_on)) land_anywhere(ray, flight, rng, goes_on);
    return goes_on;
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto&) const {
    walk.series.multiply(ray, ray.majorant.total_depth() / at.lookups() * null_ratio(at, extinction));
    walk.series.add(ray.tail.at_least(at.lookups()));
  }

  Value result(const Walk& walk, const auto&) const { return walk.series.total; }

  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    const SeriesMoments moments = series_moments(ray, profile, c);
    const auto log_growth = [&](std::int64_t i) {
      return static_cast<Real>(i) * std::log1p(moments.spread) - ray.tail.log_at_least(i);
    };
    return {.variance = series_variance(moments.depth, moments.first, log_growth, last_poisson_term(moments)),
            .lookups = moments.depth,
            .lookups_variance = moments.depth};
  }
};

}  // namespace nullmark
