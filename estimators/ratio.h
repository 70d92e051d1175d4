#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// Ratio tracking [Cramer 1978; Novák, Selle, Jarosz 2014, Alg. 1].  Unbiased for any rate mub > 0; in [0,1] where mub bounds the
/// extinction, signed beyond.  Var = T^2 (exp(int mu^2/mub) - 1), lookups int mub.
template <class Value>
struct RatioTracking {
  static constexpr const char* kName = "ratio";
  static constexpr const char* kSummary = "ratio tracking: product of null-collision probabilities";
  static constexpr const char* kSource = "Novak, Selle, Jarosz 2014, Alg. 1";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kLanes = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    Value weight;
  };

  void init(Walk& walk, const auto& ray, auto&, auto&) const { walk.weight = ray.value(1); }

  auto propose(Walk&, const auto&, auto& flight, auto& rng) const { return flight.next(rng); }

  void consume(Walk& walk, const auto&, const auto& at, const Value& extinction, auto&) const {
    walk.weight *= null_ratio(at, extinction);
  }

  Value result(const Walk& walk, const auto&) const { return walk.weight; }

  Value transmittance_at(const Walk& walk, const MediumRay<Value>&, Real) const { return walk.weight; }

  /// Partial expectations E[X; K = k] = e^{-M} (int (mub - mu))^k / k!, and of X^2 with (mub - mu)^2/mub.
  CountLaw count_law(const MediumRay<Value>& ray, const RayProfile& profile, int c) const {
    const Real depth = ray.majorant.total_depth();
    const auto weight = [&](const RayProfile::Node& at) {
      const Real rate = ray.majorant.rate(at.piece);
      return rate > 0 ? (rate - at.extinction) / rate : 0;
    };
    const auto moment = [&](int power) {
      return profile.integrate(c, [&](const RayProfile::Node& at) {
        return ray.majorant.rate(at.piece) * std::pow(weight(at), power);
      }) / depth;
    };
    return {depth, 1, moment(1), moment(2)};
  }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    const Real spread = profile.integrate(c, [&](const RayProfile::Node& at) {
      return at.extinction > 0 ? at.extinction * at.extinction / ray.majorant.rate(at.piece) : 0;
    });
    const Real lookups = ray.majorant.total_depth();
    return {.variance = product_variance(-profile.optical_depth(c), spread), .lookups = lookups, .lookups_variance = lookups};
  }
};

}  // namespace nullmark
