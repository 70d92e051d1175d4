#pragma once

#include "estimators/ray_marching.h"

namespace nullmark {

/// Free paths by a march of k steps [Perlin and Hoffert 1989]: the optical depth sampled by a unit exponential is inverted in the
/// march's own sums, linearly inside the step where they pass it.  The march does not stop there, so that it answers
/// transmittance and optical depth as ray marching does.  Biased; consistent as the step goes to 0.  Free paths on grey media.
template <class Value>
struct MarchingInversion : RayMarching<Value> {
  static constexpr const char* kName = "marching_inversion";
  static constexpr const char* kSummary = "free paths by inverting the optical depth of a march, linearly in each step";
  static constexpr const char* kSource = "Perlin and Hoffert 1989";
  static constexpr bool kLanes = false;

  using Base = RayMarching<Value>;
  using RayData = typename Base::RayData;

  struct Walk : Base::Walk {
    Real target = 0, distance = kInfinity;
  };

  void init(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    Base::init(walk, ray, flight, rng);
    walk.target = rng.exponential();
    walk.distance = kInfinity;
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Real before = channel(walk.sum, 0) * ray.step;
    Base::consume(walk, ray, at, extinction, rng);
    const Real after = channel(walk.sum, 0) * ray.step;
    if (walk.distance < kInfinity || !(walk.target < after)) return;
    walk.distance = ray.begin + (walk.done - 1 + (walk.target - before) / (after - before)) * ray.step;
  }

  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight&) const {
    if (walk.distance < kInfinity) return {EventKind::collision, std::min(walk.distance, ray.end), ray.value(1)};
    return {EventKind::escape, ray.end, ray.value(1)};
  }
};

}  // namespace nullmark
