#pragma once

#include "estimators/weighted_delta.h"

namespace nullmark {

/// Weighted delta tracking that forgets the sign of mu_n where the majorant is violated.  Right under a true bound.
template <class Value>
struct PlantedWeightSign : WeightedDeltaTracking<Value> {
  static constexpr const char* kName = "planted_weight_sign";
  static constexpr const char* kSummary = "wrong: weighted delta tracking without the sign of the null coefficient";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Walk = typename WeightedDeltaTracking<Value>::Walk;

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    WeightedDeltaTracking<Value>::consume(walk, ray, at, extinction, rng);
    for (int c = 0; c < ray.channels; ++c) channel(walk.weight, c) = std::abs(channel(walk.weight, c));
  }
};

/// Weighted delta tracking whose collisions lack the 1/P of their probability, as printed: they return w mu/mub in place of w
/// s/mub [Kutz et al. 2017, listing].  Its transmittance is right; E[w; collision in dt] = (mu/s) mu T dt is not.
template <class Value>
struct PlantedCollisionWeight : WeightedDeltaTracking<Value> {
  static constexpr const char* kName = "planted_collision_weight";
  static constexpr const char* kSummary = "wrong: weighted delta tracking whose collisions are not divided by their probability";
  static constexpr const char* kSource = "";

  using Base = WeightedDeltaTracking<Value>;

  struct Walk : Base::Walk {
    Real before = 1;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    Base::init(walk, ray, flight, rng);
    walk.before = 1;
  }

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    walk.before = channel(walk.weight, 0);
    Base::consume(walk, ray, at, extinction, rng);
    walk.collision = walk.before * channel(extinction, 0) / at.rate();
  }
};

}  // namespace nullmark
