#pragma once

#include <limits>

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking that is not a number for one sample in a million: where the first random number is tiny, as 0/0 over a first
/// step of no length would be.
template <class Value>
struct PlantedNan : RatioTracking<Value> {
  static constexpr const char* kName = "planted_nan";
  static constexpr const char* kSummary = "wrong: ratio tracking that rarely answers NaN";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "nonfinite";

  Real chance = 1e-6;

  void parameters(ParameterVisitor& visit) {
    visit.number("chance", chance, Range::between(0, 1), "", "share of the samples that are NaN");
  }

  using Walk = typename RatioTracking<Value>::Walk;

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto& rng) const {
    const Real first = 1 - rng.peek();
    walk.weight = ray.value(first < chance ? std::numeric_limits<Real>::quiet_NaN() : 1);
  }
};

}  // namespace nullmark
