#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Always 0, after an honest ratio walk: an accumulator that is never written back.  Right to any absolute tolerance where T is
/// small.
template <class Value>
struct PlantedZero : RatioTracking<Value> {
  static constexpr const char* kName = "planted_zero";
  static constexpr const char* kSummary = "wrong: answers 0 after a ratio walk";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Walk = typename RatioTracking<Value>::Walk;

  Value result(const Walk&, const MediumRay<Value>& ray) const { return ray.value(0); }
};

/// Always T, without a lookup: a reference that leaked into the estimator.  No test of the mean can object; lookups and variance
/// are not those of ratio tracking, which it claims to be.
template <class Value>
struct PlantedReference : RatioTracking<Value> {
  static constexpr const char* kName = "planted_reference";
  static constexpr const char* kSummary = "wrong: answers the reference instead of an estimate";
  static constexpr const char* kSource = "";
  static constexpr bool kNeedsOpticalDepth = true;
  static constexpr const char* kCaughtBy = "lookups";

  using Walk = typename RatioTracking<Value>::Walk;

  bool propose(Walk&, const MediumRay<Value>&, Flight&, auto&) const { return false; }
  Value result(const Walk&, const MediumRay<Value>& ray) const { return exponential(Value(-*ray.exact_depth)); }
};

}  // namespace nullmark
