#pragma once

#include "estimators/analog_decomposition.h"
#include "estimators/weighted_decomposition.h"

namespace nullmark {

/// Analog decomposition tracking that evaluates its residual at the path's start, as printed [Kutz et al. 2017, listing].  Right
/// on a constant medium.
template <class Value>
struct PlantedDecompositionStart : AnalogDecompositionTracking<Value> {
  static constexpr const char* kName = "planted_decomposition_start";
  static constexpr const char* kSummary = "wrong: decomposition tracking that looks its residual up where the path began";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = AnalogDecompositionTracking<Value>;
  using RayData = typename Base::RayData;

  void check(const MatterBounds&) const {}

  struct Walk : Base::Walk {
    Real collision = 0;
  };

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    if (!Base::propose(walk, ray, flight, rng)) return false;
    walk.collision = flight.position();
    flight.jump(ray.begin);
    return true;
  }

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight& at) const {
    Event<Value> event = Base::event(walk, ray, at);
    if (walk.looked_up) event.distance = walk.collision;
    return event;
  }
};

/// Weighted decomposition tracking that looks its residual up once a walk and keeps the coefficients: the printed code updates x
/// and never asks again.
template <class Value>
struct PlantedStaleResidual : WeightedDecompositionTracking<Value> {
  static constexpr const char* kName = "planted_stale_residual";
  static constexpr const char* kSummary = "wrong: weighted decomposition tracking that looks its residual up only once";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = WeightedDecompositionTracking<Value>;
  using RayData = typename Base::RayData;

  void check(const MatterBounds&) const {}

  struct Walk : Base::Walk {
    Value first;
    bool known = false;
  };

  void init(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    Base::init(walk, ray, flight, rng);
    walk.known = false;
  }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    while (Base::propose(walk, ray, flight, rng)) {
      if (!walk.known) return true;
      Base::consume(walk, ray, flight, walk.first, rng);
    }
    return false;
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    walk.first = extinction;
    walk.known = true;
    Base::consume(walk, ray, at, extinction, rng);
  }
};

/// Weighted decomposition tracking whose residual probabilities lack the chance that the control was not taken: weights A/mub in
/// place of A/(mub - mu_c).
template <class Value>
struct PlantedDecompositionMarginal : WeightedDecompositionTracking<Value> {
  static constexpr const char* kName = "planted_decomposition_marginal";
  static constexpr const char* kSummary =
      "wrong: weighted decomposition tracking that forgets the chance of not taking the control";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = WeightedDecompositionTracking<Value>;
  using RayData = typename Base::RayData;
  using Walk = typename Base::Walk;

  void check(const MatterBounds&) const {}

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    Base::consume(walk, ray, at, extinction, rng);
    walk.weight *= 1 - ray.control.rate(at.piece()) / at.rate();
  }
};

}  // namespace nullmark
