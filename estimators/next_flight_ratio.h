#pragma once

#include "estimators/next_flight.h"

namespace nullmark {

/// Next-flight ratio tracking [Novák et al. 2018, STAR; Georgiev et al. 2019]: every tentative collision adds the chance that the
/// flight from there escapes the majorant.  Unbiased for any rate; (0, inf) where it bounds.  Lookups int mub.
template <class Value>
struct NextFlightRatioTracking {
  static constexpr const char* kName = "next_flight_ratio";
  static constexpr const char* kSummary = "next-flight ratio tracking: expected escape from every tentative collision, weighted";
  static constexpr const char* kSource = "Novak, Georgiev, Hanika, Jarosz 2018; Georgiev et al. 2019";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;

  Claim claim(Quantity) const { return Claim::unbiased; }

  struct Walk {
    Value weight, sum;
  };

  void init(Walk& walk, const Passage<Value>& ray, Flight& flight, auto&) const {
    walk.weight = ray.value(1);
    walk.sum = ray.value(std::exp(-flight.depth_left()));
  }

  bool propose(Walk&, const Passage<Value>&, Flight& flight, auto& rng) const { return flight.next(rng); }

  void consume(Walk& walk, const Passage<Value>&, const Flight& at, const Value& extinction, auto&) const {
    walk.weight *= (at.rate() - extinction) / at.rate();
    walk.sum += walk.weight * std::exp(-at.depth_left());
  }

  Value result(const Walk& walk, const Passage<Value>&) const { return walk.sum; }

  Theory theory(const Passage<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    return {.variance = next_flight_variance(
                ray.majorant, profile, c, [](Real a) { return a * a; },
                [](Real mu, Real rate) { return mu > 0 ? 2 * mu - mu * mu / rate : 0; }),
            .lookups = ray.majorant.total_depth()};
  }
};

}  // namespace nullmark
