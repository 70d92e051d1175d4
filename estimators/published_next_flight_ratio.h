#pragma once

#include "estimators/next_flight_ratio.h"

namespace nullmark {

/// Next-flight ratio tracking with the step law of the program behind Kozelj's comparison: flights are -log(1 - u/mub) instead of
/// -log(1 - u)/mub (a misplaced parenthesis).  Steps are bounded and half as long, collisions twice as many, and the mean is
/// wrong.  Needs mub > 1 in the units of the scene.
template <class Value>
struct PublishedNextFlightRatioTracking : NextFlightRatioTracking<Value> {
  static constexpr const char* kName = "next_flight_ratio_published_step";
  static constexpr const char* kSummary = "next-flight ratio tracking with the step law of a published comparison (biased)";
  static constexpr const char* kSource = "Kozelj, Comparison of transmittance and distance estimators: program";
  static constexpr bool kOwnFlights = true;
  static constexpr bool kGreyOnly = true;
  static constexpr bool kLanes = false;

  using Walk = typename NextFlightRatioTracking<Value>::Walk;

  Guarantee claim(Quantity) const { return Guarantee::biased; }

  bool propose(Walk&, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    if (!(ray.length() > 0)) return false;
    const Real step = -std::log(1 - rng.uniform() / flight.rate());
    return flight.advance_to(flight.depth() + step * flight.rate());
  }

  Theory theory(const MediumRay<Value>&, const RayProfile&, int, Quantity) const { return {}; }
};

}  // namespace nullmark
