#pragma once

#include "estimators/delta.h"

namespace nullmark {

/// Delta tracking that moves each collision within its bin.  With u the share of collisions before it, a collision of bin k of 8
/// goes from u = (k + f)/8 to (k + f^2)/8, so all scores are right and the density within a bin is not.  It states no theory.
/// Meant for a constant extinction; u = (1 - e^{-mu t})/(1 - e^{-mu d}).
template <class Value>
struct PlantedBinShape : DeltaTracking<Value> {
  static constexpr const char* kName = "planted_bin_shape";
  static constexpr const char* kSummary = "wrong: delta tracking whose collisions crowd at the begin of each bin of a free path";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "chi_square";

  static constexpr Real kBins = 8;

  using Base = DeltaTracking<Value>;
  using RayData = typename Base::RayData;
  using Walk = typename Base::Walk;

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight& at) const {
    Event<Value> event = Base::event(walk, ray, at);
    const Real mu = ray.medium->maximum[0], share = -std::expm1(-mu * ray.length());
    if (event.kind == EventKind::escape || !(share > 0)) return event;
    const Real u = -std::expm1(-mu * (event.distance - ray.begin)) / share * kBins, bin = std::floor(u);
    event.distance = ray.begin - std::log1p(-share * (bin + (u - bin) * (u - bin)) / kBins) / mu;
    return event;
  }

  static constexpr bool theory = false;
};

}  // namespace nullmark
