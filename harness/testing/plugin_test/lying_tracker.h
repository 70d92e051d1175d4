#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// Ratio tracking with one mistake, which it does not own up to: what verdicts must find.  On the unit homogeneous medium of
/// extinction 1 under a majorant of 2 every mistake moves the mean by 2 % of T = 1/e; weights there are 2^-K with K Poisson of
/// mean 2.
///
///   rate      the weight takes the sampling rate for 2 % more than it is: T becomes exp(-tau/1.02)
///   dropped   collisions within 2 % of the ray are forgotten: T becomes exp(-0.98 tau)
///   clamp     samples below 0.1 are raised to it: sum_{k>3} P(k) (0.1 - 2^-k)
///   roulette  below a weight of 0.2 one walk in five ends at every collision and the others are not made heavier
template <class Value>
struct LyingTracker {
  static constexpr const char* kName = "lying";
  static constexpr const char* kSummary = "ratio tracking with a mistake of two percent";
  static constexpr const char* kSource = "nullmark, test of plug-ins";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;

  std::string lie = "rate";

  void parameters(ParameterVisitor& visit) {
    visit.choice("lie", lie, {"rate", "dropped", "clamp", "roulette"}, "which mistake");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    Value weight;
    bool done = false;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto&) const { walk = {ray.value(1), false}; }

  bool propose(Walk& walk, const MediumRay<Value>&, Flight& flight, auto& rng) const { return !walk.done && flight.next(rng); }

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    if (lie == "dropped" && std::abs((at.position() - ray.begin) / ray.length() - 0.5) < 0.01) return;
    const Real rate = lie == "rate" ? 1.02 * at.rate() : at.rate();
    walk.weight *= (rate - extinction) / rate;
    if (lie == "roulette" && largest(walk.weight) < 0.2 && rng.uniform() < 0.2) {
      walk.weight = ray.value(0);
      walk.done = true;
    }
  }

  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    Value weight = walk.weight;
    if (lie == "clamp")
      for (int c = 0; c < ray.channels; ++c) channel(weight, c) = std::max(channel(weight, c), Real{0.1});
    return weight;
  }
};

}  // namespace nullmark
