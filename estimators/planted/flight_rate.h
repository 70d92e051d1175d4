#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking whose flights are 1/0.99 too long: collisions come at rate .99 mub, weights know mub.  As when a bound is kept
/// in two places and one of them is scaled or rounded down.  Mean exp(-.99 tau), lookups .99 int mub.
template <class Value>
struct PlantedFlightRate : RatioTracking<Value> {
  static constexpr const char* kName = "planted_flight_rate";
  static constexpr const char* kSummary = "wrong: ratio tracking that flies at .99 of the rate it weighs with";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";
  static constexpr Real kRateKept = 0.99;

  using Walk = typename RatioTracking<Value>::Walk;

  bool propose(Walk&, const MediumRay<Value>&, Flight& flight, auto& rng) const {
    return flight.advance_to(flight.depth() + rng.exponential() / kRateKept);
  }
};

}  // namespace nullmark
