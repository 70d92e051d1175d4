#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking that gives a walk up, and answers 0, where it collides more often than it may.  On a constant medium the mean
/// is T P(N <= most), N Poisson of mean int (mub - mu).
template <class Value>
struct PlantedKilled : RatioTracking<Value> {
  static constexpr const char* kName = "planted_killed";
  static constexpr const char* kSummary = "wrong: ratio tracking that answers 0 after too many collisions";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = RatioTracking<Value>;

  int most = 5;

  void parameters(ParameterVisitor& visit) { visit.integer("most", most, 0, 1'000'000, "collisions that a walk survives"); }

  struct Walk : Base::Walk {
    int collisions = 0;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    Base::init(walk, ray, flight, rng);
    walk.collisions = 0;
  }

  bool propose(Walk& walk, const MediumRay<Value>&, Flight& flight, auto& rng) const {
    return walk.collisions <= most && flight.next(rng);
  }

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    Base::consume(walk, ray, at, extinction, rng);
    if (++walk.collisions > most) walk.weight = ray.value(0);
  }

  /// Neither variance nor lookups are those of ratio tracking.
  Theory theory(const MediumRay<Value>&, const RayProfile&, int, Quantity) const { return {}; }
  static constexpr bool count_law = false;
};

}  // namespace nullmark
