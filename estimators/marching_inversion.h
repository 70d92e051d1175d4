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

  using Base = RayMarching<Value>;
  using RayData = typename Base::RayData;

  struct Walk {
    typename Base::Walk march;
    Distance<Value> target, distance;  ///< optical depth sampled; where the march's sums pass it
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    Base::init(walk.march, ray, flight, rng);
    walk.target = rng.exponential();
    walk.distance = kInfinity;
  }

  bool propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const { return Base::propose(walk.march, ray, flight, rng); }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    const Distance<Value> before = channel(walk.march.sum, 0) * ray.step;
    Base::consume(walk.march, ray, at, extinction, rng);
    const Distance<Value> after = channel(walk.march.sum, 0) * ray.step;
    const auto passed = (walk.target < after) & !(walk.distance < kInfinity);
    if (none(passed)) return;
    const Distance<Value> passing = at.lookups() - 1 + (walk.target - before) / (after - before);
    walk.distance = select(passed, ray.begin + passing * ray.step, walk.distance);
  }

  Value optical_depth(const Walk& walk, const auto& ray) const { return Base::optical_depth(walk.march, ray); }
  Value result(const Walk& walk, const auto& ray) const { return Base::result(walk.march, ray); }

  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight&) const {
    if (walk.distance < kInfinity) return {EventKind::collision, std::min(walk.distance, ray.end), ray.value(1)};
    return {EventKind::escape, ray.end, ray.value(1)};
  }
};

}  // namespace nullmark
