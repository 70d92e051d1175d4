#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking that ends in a coin: 1 with the weight as its chance, else 0.  Mean T, variance T (1 - T), which is delta
/// tracking's.  As when an analog termination is left in a weighted tracker.  Needs weights in [0,1].
template <class Value>
struct PlantedCoin : RatioTracking<Value> {
  static constexpr const char* kName = "planted_coin";
  static constexpr const char* kSummary = "wrong: ratio tracking that answers 0 or 1 with its weight as the chance";
  static constexpr const char* kSource = "";
  static constexpr bool kNeedsBound = true;
  static constexpr const char* kCaughtBy = "variance";

  struct Walk : RatioTracking<Value>::Walk {
    Real coin = 0;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    walk.coin = rng.uniform();
  }

  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    Value x = ray.value(0);
    for (int c = 0; c < ray.channels; ++c) channel(x, c) = walk.coin < channel(walk.weight, c) ? 1 : 0;
    return x;
  }
};

/// Ratio tracking that looks every collision up twice and uses the first answer: right in all but its cost.
template <class Value>
struct PlantedSecondLookup : RatioTracking<Value> {
  static constexpr const char* kName = "planted_second_lookup";
  static constexpr const char* kSummary = "wrong: ratio tracking that looks every collision up twice";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "lookups";

  struct Walk : RatioTracking<Value>::Walk {
    bool again = false;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    walk.again = false;
  }

  bool propose(Walk& walk, const MediumRay<Value>&, Flight& flight, auto& rng) const { return walk.again || flight.next(rng); }

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    if (!walk.again) RatioTracking<Value>::consume(walk, ray, at, extinction, rng);
    walk.again = !walk.again;
  }
};

}  // namespace nullmark
