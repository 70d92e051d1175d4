#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking that flies at the first channel's majorant and weighs with the largest channel's.  Right on grey media and
/// where the first channel is the largest; else channel c has mean exp(-tau_c mub_0/mub).
template <class Value>
struct PlantedChannelMajorant : RatioTracking<Value> {
  static constexpr const char* kName = "planted_channel_majorant";
  static constexpr const char* kSummary = "wrong: ratio tracking that flies at one channel's majorant and weighs with another's";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  struct RayData : MediumRay<Value> {
    Rates first;
  };

  void prepare(RayData& ray) const {
    ray.first.start(ray.begin);
    for (const Segment& segment : ray.bounds.segments()) {
      const Real most = segment.extinction.maximum.maxCoeff();
      ray.first.append(segment.end, most > 0 ? segment.majorant * (segment.extinction.maximum[0] / most) : segment.majorant);
    }
  }

  using Walk = typename RatioTracking<Value>::Walk;

  void init(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    flight.start(ray.first);
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto&) const {
    const Real mub = ray.majorant.rate(at.piece());
    walk.weight *= (mub - extinction) / mub;
  }
};

/// Ratio tracking whose channels are stored one place too low: channel c answers for channel c + 1, the last for the first.
template <class Value>
struct PlantedChannelSwap : RatioTracking<Value> {
  static constexpr const char* kName = "planted_channel_swap";
  static constexpr const char* kSummary = "wrong: ratio tracking with its channels rotated";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Walk = typename RatioTracking<Value>::Walk;

  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    Value rotated = walk.weight;
    for (int c = 0; c < ray.channels; ++c) channel(rotated, c) = channel(walk.weight, (c + 1) % ray.channels);
    return rotated;
  }
};

}  // namespace nullmark
