#pragma once

#include "estimators/next_flight_delta.h"
#include "estimators/published_next_flight_ratio.h"

namespace nullmark {

/// Next-flight ratio tracking with flights -log(1 - u/mub), a misplaced parenthesis, under the claim of the right one.
template <class Value>
struct PlantedStepParenthesis : PublishedNextFlightRatioTracking<Value> {
  static constexpr const char* kName = "planted_step_parenthesis";
  static constexpr const char* kSummary = "wrong: next-flight ratio tracking with steps -log(1 - u/mub)";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity quantity) const {
    return NextFlightRatioTracking<Value>::theory(ray, profile, c, quantity);
  }
};

/// Next-flight ratio tracking that takes the escape over the whole ray instead of what is left of it: `d` in place of `d - t`.
template <class Value>
struct PlantedWholeDepth : NextFlightRatioTracking<Value> {
  static constexpr const char* kName = "planted_whole_depth";
  static constexpr const char* kSummary = "wrong: next-flight ratio tracking with the escape over the whole ray";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Walk = typename NextFlightRatioTracking<Value>::Walk;

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto&) const {
    walk.weight *= (at.rate() - extinction) / at.rate();
    walk.sum += walk.weight * std::exp(-ray.majorant.total_depth());
  }
};

/// Next-flight delta tracking, variant A, that leaves the walk before the real collision has added its (1 - p) e^{-mub left}: the
/// published sum, read as one over null collisions only.  Right where the majorant is tight (p = 1), too low elsewhere.
template <class Value>
struct PlantedTerminalTerm : NextFlightDeltaTracking<Value> {
  static constexpr const char* kName = "planted_terminal_term";
  static constexpr const char* kSummary = "wrong: next-flight delta tracking without the real collision's term";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using RayData = typename NextFlightDeltaTracking<Value>::RayData;
  using Walk = typename NextFlightDeltaTracking<Value>::Walk;

  void parameters(ParameterVisitor&) {}

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Real escape = std::exp(-at.depth_left()), threshold = rng.uniform() * at.rate();
    bool any = false;
    for (int c = 0; c < ray.channels; ++c) {
      Real& alive = channel(walk.alive, c);
      const Real mu = channel(extinction, c);
      if (threshold < mu) alive = 0;
      channel(walk.sum, c) += alive * ((at.rate() - mu) / at.rate()) * escape;
      any = any || alive > 0;
    }
    walk.done = !any;
  }
};

}  // namespace nullmark
