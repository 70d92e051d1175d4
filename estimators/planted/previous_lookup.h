#pragma once

#include "estimators/delta.h"
#include "estimators/ratio.h"

namespace nullmark {

/// Delta tracking whose accept test runs before the lookup's result is stored: it compares its random number with the extinction
/// of the collision before (0 at the first).
template <class Value>
struct PlantedPreviousExtinction : DeltaTracking<Value> {
  static constexpr const char* kName = "planted_previous_extinction";
  static constexpr const char* kSummary = "wrong: delta tracking that tests against the extinction of the collision before";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = DeltaTracking<Value>;
  using RayData = typename Base::RayData;

  struct Walk : Base::Walk {
    Value previous;
  };

  void init(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    Base::init(walk, ray, flight, rng);
    walk.previous = ray.value(0);
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    Base::consume(walk, ray, at, walk.previous, rng);
    walk.previous = extinction;
  }
};

/// Ratio tracking that looks the extinction up where the flight began instead of where it ended [an erratum of Kutz et al. 2017,
/// printed code: mu at the path start].  Right on a constant medium.
template <class Value>
struct PlantedPathStart : RatioTracking<Value> {
  static constexpr const char* kName = "planted_path_start";
  static constexpr const char* kSummary = "wrong: ratio tracking that looks up where a flight began";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "position_law";

  struct Walk : RatioTracking<Value>::Walk {
    Real collision = 0;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    walk.collision = ray.begin;
  }

  bool propose(Walk& walk, const MediumRay<Value>&, Flight& flight, auto& rng) const {
    const Real start = walk.collision;
    if (!flight.next(rng)) return false;
    walk.collision = flight.position();
    flight.jump(start);
    return true;
  }
};

}  // namespace nullmark
