#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking with Russian roulette below a threshold that forgets to divide the survivors by their chance.
template <class Value>
struct PlantedRoulette : RatioTracking<Value> {
  static constexpr const char* kName = "planted_roulette";
  static constexpr const char* kSummary = "wrong: ratio tracking with Russian roulette that does not raise survivors";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  Real threshold = 0.25, survival = 0.5;

  void parameters(ParameterVisitor& visit) {
    visit.number("threshold", threshold, Range::between(0, 1), "",
                 "weight of the largest channel below which roulette is played");
    visit.number("survival", survival, Range::between(0, 1), "", "chance to live on");
  }

  struct Walk : RatioTracking<Value>::Walk {
    bool done = false;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    walk.done = false;
  }

  bool propose(Walk& walk, const MediumRay<Value>&, Flight& flight, auto& rng) const { return !walk.done && flight.next(rng); }

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    RatioTracking<Value>::consume(walk, ray, at, extinction, rng);
    if (largest(walk.weight) < threshold && rng.uniform() >= survival) {
      walk.weight = ray.value(0);
      walk.done = true;
    }
  }

  /// Roulette changes variance and lookups, so ratio tracking's are not claimed.
  Theory theory(const MediumRay<Value>&, const RayProfile&, int, Quantity) const { return {}; }
};

}  // namespace nullmark
