#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Residual ratio tracking with the ray's average extinction as its control, which takes the medium's average in its place where
/// it subtracts the control.  Mean T exp(a d - tau), with the medium's average a: right on rays that have that average too.
template <class Value>
struct PlantedMediumAverage : RatioTracking<Value> {
  static constexpr const char* kName = "planted_medium_average";
  static constexpr const char* kSummary = "wrong: residual ratio tracking that takes the medium's average for the ray's";
  static constexpr const char* kSource = "";
  static constexpr SampleRange kRange = SampleRange::any_sign;
  static constexpr bool kNeedsOpticalDepth = true;
  static constexpr const char* kCaughtBy = "mean";

  using Walk = typename RatioTracking<Value>::Walk;

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto&) const {
    const Value average = load<Value>(ray.medium->average.data(), ray.channels);
    walk.weight *= (at.rate() - (extinction - average)) / at.rate();
  }

  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    return walk.weight * exponential(Value(-*ray.exact_depth));
  }

  /// Lookups alone are those of ratio tracking.
  Theory theory(const MediumRay<Value>& ray, const RayProfile&, int, Quantity) const {
    return {.lookups = ray.majorant.total_depth(), .lookups_variance = ray.majorant.total_depth()};
  }
  static constexpr bool count_law = false;
};

}  // namespace nullmark
