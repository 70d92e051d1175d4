#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// A midpoint march that claims to be unbiased, with samples of any sign and no theory.  All lookups of a sample lie off the
/// midpoints by one offset, uniform within 5e-6 of a step, so samples hardly vary and none of them tells how wrong the mean is.
template <class Value>
struct PlantedMidpoint {
  static constexpr const char* kName = "planted_midpoint";
  static constexpr const char* kSummary = "wrong: midpoint march that claims to be unbiased and hardly varies";
  static constexpr const char* kSource = "";
  static constexpr SampleRange kRange = SampleRange::any_sign;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr const char* kCaughtBy = "open";

  static constexpr int kSteps = 4;
  static constexpr Real kJitter = 1e-5;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    Value sum;
    Real offset = 0;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto& rng) const {
    walk = {ray.value(0), 0.5 + kJitter * (rng.uniform() - 0.5)};
  }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto&) const {
    if (!(ray.length() > 0) || flight.lookups() == kSteps) return false;
    flight.jump(ray.begin + (flight.lookups() + walk.offset) * ray.length() / kSteps);
    return true;
  }

  void consume(Walk& walk, const MediumRay<Value>&, const Flight&, const Value& extinction, auto&) const {
    walk.sum += extinction;
  }

  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    return exponential(Value(-walk.sum * (ray.length() / kSteps)));
  }
};

}  // namespace nullmark
