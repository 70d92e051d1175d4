#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking that flies in fractions of the ray as if they were lengths: rate mub/d in place of mub.  Mean exp(-tau/d),
/// right on rays of length 1, wherever they begin.  Its theory is that of the right tracker.
template <class Value>
struct PlantedUnitLength : RatioTracking<Value> {
  static constexpr const char* kName = "planted_unit_length";
  static constexpr const char* kSummary = "wrong: ratio tracking that takes every ray for one of length 1";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  struct RayData : MediumRay<Value> {
    Rates flown;
  };

  void prepare(RayData& ray) const {
    ray.flown.start(ray.begin, ray.bounds.crossing());
    for (const Segment& segment : ray.bounds.segments()) ray.flown.append(segment.end, segment.majorant / ray.length());
  }

  using Walk = typename RatioTracking<Value>::Walk;

  void init(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    flight.start(ray.flown);
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto&) const {
    const Real mub = ray.majorant.rate(at.piece());
    walk.weight *= (mub - extinction) / mub;
  }
};

}  // namespace nullmark
