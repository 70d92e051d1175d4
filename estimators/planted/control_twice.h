#pragma once

#include "estimators/residual_ratio.h"

namespace nullmark {

/// Residual ratio tracking that multiplies by T_c at the start and again at the end.  Mean T T_c.
template <class Value>
struct PlantedControlTwice : ResidualRatioTracking<Value> {
  static constexpr const char* kName = "planted_control_twice";
  static constexpr const char* kSummary = "wrong: residual ratio tracking that counts its control twice";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using RayData = typename ResidualRatioTracking<Value>::RayData;
  using Walk = typename ResidualRatioTracking<Value>::Walk;

  Value result(const Walk& walk, const RayData& ray) const {
    return ResidualRatioTracking<Value>::result(walk, ray) * exponential(Value(-ray.control.depth));
  }
};

}  // namespace nullmark
