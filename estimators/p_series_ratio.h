#pragma once

#include "estimators/power_series.h"
#include "estimators/ratio.h"

namespace nullmark {

/// Power-series ratio estimator [Georgiev et al. 2019]: the product of null ratios at N points, N a Poisson number of mean M =
/// int mub and the points independent, of density mub/M.  That is ratio tracking without an order: the same law, so Var = T^2
/// (exp(int mu^2/mub) - 1), lookups int mub, in [0,1] where mub bounds, unbiased for any rate.  No logarithm a step: the walk
/// goes on while u < P(N >= i), one u for all.
template <class Value>
struct PowerSeriesRatio {
  static constexpr const char* kName = "p_series_ratio";
  static constexpr const char* kSummary = "power series: product of null ratios at a Poisson number of independent points";
  static constexpr const char* kSource = "Georgiev et al. 2019, p-series ratio";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kOwnFlights = true;
  static constexpr bool kLanes = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    PoissonTail tail;
  };

  void prepare(RayData& ray) const { ray.tail.set_up(ray.majorant.total_depth()); }

  struct Walk {
    Value weight;
    Distance<Value> u;  ///< uniform
  };

  void init(Walk& walk, const auto& ray, auto&, auto& rng) const { walk = {ray.value(1), uniform_above_zero<Value>(rng)}; }

  auto propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    const auto goes_on = walk.u < ray.tail.at_least(flight.lookups() + 1);
    if (!none(goes_on)) land_anywhere(ray, flight, rng, goes_on);
    return goes_on;
  }

  void consume(Walk& walk, const auto&, const auto& at, const Value& extinction, auto&) const {
    walk.weight *= null_ratio(at, extinction);
  }

  Value result(const Walk& walk, const auto&) const { return walk.weight; }

  CountLaw count_law(const RayData& ray, const RayProfile& profile, int c) const {
    return RatioTracking<Value>().count_law(ray, profile, c);
  }

  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity quantity) const {
    return RatioTracking<Value>().theory(ray, profile, c, quantity);
  }
};

}  // namespace nullmark
