#pragma once

#include "estimators/ratio.h"
#include "estimators/residual_ratio.h"

namespace nullmark {

template <class Value>
Value clamped_to_unit(Value x) {
  for (int c = 0; c < channel_count(x); ++c) channel(x, c) = std::clamp<Real>(channel(x, c), 0, 1);
  return x;
}

/// Ratio tracking that clamps its result to [0,1], because a transmittance lies there.  Its samples do too under a majorant that
/// bounds the extinction; under one that does not, the negative ones are needed for the mean.
template <class Value>
struct PlantedClampedRatio : RatioTracking<Value> {
  static constexpr const char* kName = "planted_clamped_ratio";
  static constexpr const char* kSummary = "wrong: ratio tracking clamped to [0,1], also where the majorant is violated";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Walk = typename RatioTracking<Value>::Walk;

  Value result(const Walk& walk, const MediumRay<Value>&) const { return clamped_to_unit(walk.weight); }
};

/// Residual ratio tracking clamped to [0,1]: samples above 1 are what balances those below the mean.
template <class Value>
struct PlantedClampedResidual : ResidualRatioTracking<Value> {
  static constexpr const char* kName = "planted_clamped_residual";
  static constexpr const char* kSummary = "wrong: residual ratio tracking clamped to [0,1]";
  static constexpr const char* kSource = "";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr const char* kCaughtBy = "mean";

  SampleRange range() const { return kRange; }

  using RayData = typename ResidualRatioTracking<Value>::RayData;
  using Walk = typename ResidualRatioTracking<Value>::Walk;

  Value result(const Walk& walk, const RayData& ray) const {
    return clamped_to_unit(ResidualRatioTracking<Value>::result(walk, ray));
  }
};

/// Ratio tracking that caps the extinction at the majorant, so that a violated bound gives no negative weight and no complaint.
/// Mean exp(-int min(mu, mub)).
template <class Value>
struct PlantedCappedExtinction : RatioTracking<Value> {
  static constexpr const char* kName = "planted_capped_extinction";
  static constexpr const char* kSummary = "wrong: ratio tracking that caps the extinction at a majorant that is too low";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "audit";

  using Walk = typename RatioTracking<Value>::Walk;

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    Value capped = extinction;
    for (int c = 0; c < ray.channels; ++c) channel(capped, c) = std::min(channel(extinction, c), at.rate());
    RatioTracking<Value>::consume(walk, ray, at, capped, rng);
  }
};

}  // namespace nullmark
