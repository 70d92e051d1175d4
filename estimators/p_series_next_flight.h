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

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    PoissonTail tail;
  };

  void prepare(RayData& ray) const { ray.tail.set_up(ray.majorant.total_depth()); }

  using Walk = SeriesWalk<Value>;

  void init(Walk& walk, const RayData& ray, Flight&, auto& rng) const { walk.start(ray, rng); }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    if (!(walk.u < ray.tail.at_least(walk.lookups + 1))) return false;
    ++walk.lookups;
    land_anywhere(ray, flight, rng);
    return true;
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto&) const {
    walk.series.multiply(ray.majorant.total_depth() / static_cast<Real>(walk.lookups) * null_ratio(at, extinction));
    walk.series.add(ray.tail.at_least(walk.lookups));
  }

  Value result(const Walk& walk, const RayData&) const { return walk.series.total(); }

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
