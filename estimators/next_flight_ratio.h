#pragma once

#include "estimators/vertex_sum.h"

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
  static constexpr bool kLanes = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    Value weight, sum;
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto&) const {
    walk.weight = ray.value(1);
    walk.sum = walk.weight * exponential(-flight.depth_left());
  }

  auto propose(Walk&, const auto&, auto& flight, auto& rng) const { return flight.next(rng); }

  void consume(Walk& walk, const auto&, const auto& at, const Value& extinction, auto&) const {
    walk.weight *= null_ratio(at, extinction);
    walk.sum += walk.weight * exponential(-at.depth_left());
  }

  Value result(const Walk& walk, const auto&) const { return walk.sum; }

  /// A vertex has v = exp(-majorant depth left) and g = v (2 T - v) in vertex_sum_variance.  Nothing where the panels do not
  /// resolve v.
  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    Theory theory{.lookups = ray.majorant.total_depth(), .lookups_variance = ray.majorant.total_depth()};
    if (!profile.resolved()) return theory;
    theory.variance = vertex_sum_variance(ray, profile, c, [](Real depth_left, Real tau_left) {
      const Real v = std::exp(-depth_left);
      return v * (2 * std::exp(-tau_left) - v);
    });
    return theory;
  }
};

}  // namespace nullmark
