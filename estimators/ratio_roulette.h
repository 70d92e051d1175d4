#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// Ratio tracking whose weight plays Russian roulette once it is below a threshold [Novak, Selle, Jarosz 2014, Sec. 3; Pharr,
/// Jakob, Humphreys 2023, Sec. 14.2]: it goes on over `survival` with that probability and ends at 0 otherwise.  Bounds the cost
/// of thick rays, whose weights are small long before the end, and pays with variance.  Of several channels the largest weight
/// decides.  In [0,1] where the majorant bounds, since threshold <= survival.
template <class Value>
struct RatioRoulette {
  static constexpr const char* kName = "ratio_roulette";
  static constexpr const char* kSummary = "ratio tracking with Russian roulette on small weights";
  static constexpr const char* kSource = "Novak, Selle, Jarosz 2014, Sec. 3; Pharr, Jakob, Humphreys 2023, Sec. 14.2";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kLanes = true;

  Real threshold = 0.05, survival = 0.25;

  void parameters(ParameterVisitor& visit) {
    visit.number("threshold", threshold, Range::between(0, 1), "", "weight below which roulette is played");
    visit.number("survival", survival, {0, 1, true}, "", "probability of survival; at least the threshold");
  }

  void check(const MatterBounds&) const {
    if (survival < threshold)
      throw ParameterError("survival", "found " + std::to_string(survival) + "; expected at least the threshold, " +
                                           std::to_string(threshold) + ": else weights would exceed 1");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    Value weight;
    Truth<Value> ended = false;
  };

  void init(Walk& walk, const auto& ray, auto&, auto&) const { walk = {ray.value(1), false}; }

  auto propose(Walk& walk, const auto&, auto& flight, auto& rng) const { return flight.next(rng, !walk.ended); }

  void consume(Walk& walk, const auto&, const auto& at, const Value& extinction, auto& rng) const {
    walk.weight *= null_ratio(at, extinction);
    const auto small = largest(magnitude(walk.weight)) < threshold;
    if (none(small)) return;
    walk.ended = small & !(rng.uniform_where(small) < survival);
    const Distance<Value> gain = select(walk.ended, Distance<Value>(0), Distance<Value>(1 / survival));
    walk.weight *= select(small, gain, Distance<Value>(1));
  }

  Value result(const Walk& walk, const auto&) const { return walk.weight; }
};

}  // namespace nullmark
