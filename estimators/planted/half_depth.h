#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Half of a ratio walk's answer and half of exp(-tau), with the tau that it was handed.  Mean T, a quarter of ratio tracking's
/// variance, and the lookups that it states: only a wrong tau shows it.
template <class Value>
struct PlantedHalfDepth : RatioTracking<Value> {
  static constexpr const char* kName = "planted_half_depth";
  static constexpr const char* kSummary = "wrong: average of a ratio walk and of the exact answer";
  static constexpr const char* kSource = "";
  static constexpr bool kNeedsOpticalDepth = true;
  static constexpr const char* kCaughtBy = "reliance";

  using Base = RatioTracking<Value>;
  using Walk = typename Base::Walk;

  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    return (walk.weight + exponential(Value(-*ray.exact_depth))) / 2;
  }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity quantity) const {
    Theory theory = Base::theory(ray, profile, c, quantity);
    *theory.variance /= 4;
    return theory;
  }

  /// Samples are no products.
  static constexpr bool count_law = false;
};

}  // namespace nullmark
