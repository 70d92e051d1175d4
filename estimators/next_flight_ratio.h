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

  /// Let v and T be the transmittances of the majorant and of the medium over what is left of the ray.  A walk of weight W
  /// expects W (T - v) more between vertices, and W (1 - mu/mub) T from a vertex on.  A vertex thus changes what is expected by
  /// W (v - mu/mub T), and Var = int mub E[W^2] (v - mu/mub T)^2 dy.  This is no difference of large numbers, so it is 0 under a
  /// tight bound and right under one that is hardly looser.  Nothing where the panels do not resolve v.
  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    Theory theory{.lookups = ray.majorant.total_depth(), .lookups_variance = ray.majorant.total_depth()};
    if (!profile.resolved()) return theory;
    theory.variance = integral_over_vertices(ray, profile, c, [](Real a, Real, Real tau_left, Real null_left) {
      const Real change = std::exp(-tau_left) * (std::expm1(-null_left) + a);
      return change * change;
    });
    return theory;
  }
};

}  // namespace nullmark
