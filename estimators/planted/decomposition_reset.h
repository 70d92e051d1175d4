#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/survival.h"

namespace nullmark {

/// Analog decomposition tracking [Kutz et al. 2017] as its code was printed.  One free path t_c of the control (the medium's
/// least extinction), one t_r of the rest by delta tracking, the shorter one counts; but t_r starts at 0 after each null
/// collision instead of going on from there.  The right tracker, whose theory is claimed, has Var = T (1 - T) and lookups int
/// mubr T(0,x) dx.  Channels share both paths.
template <class Value>
struct PlantedDecompositionReset {
  static constexpr const char* kName = "planted_decomposition_reset";
  static constexpr const char* kSummary = "wrong: decomposition tracking whose residual path starts anew at each null collision";
  static constexpr const char* kSource = "";
  static constexpr SampleRange kRange = SampleRange::binary;
  static constexpr bool kNeedsBound = true;
  static constexpr const char* kCaughtBy = "mean";

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    Real control = 0;
    Rates residual;
  };

  void prepare(RayData& ray) const {
    ray.control = ray.medium->minimum.minCoeff();
    ray.residual.start(ray.begin);
    for (const Segment& segment : ray.bounds.segments())
      ray.residual.append(segment.end, std::max<Real>(0, segment.majorant - ray.control));
  }

  struct Walk {
    Value transmittance;
    Real control_path = 0;  ///< distance along the ray
    bool done = false;
    Real distance = 0;
  };

  void init(Walk& walk, const RayData& ray, Flight&, auto& rng) const {
    walk = {ray.value(1), ray.begin + rng.exponential() / ray.control, false, ray.end};
  }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    if (walk.done) return false;
    flight.start(ray.residual);
    const bool inside = flight.next(rng);
    if (walk.control_path > flight.position()) return inside;
    walk.distance = walk.control_path;
    walk.transmittance = ray.value(0);
    return false;
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Real threshold = rng.uniform() * at.rate();
    bool any = false;
    for (int c = 0; c < ray.channels; ++c) {
      if (threshold < channel(extinction, c) - ray.control) channel(walk.transmittance, c) = 0;
      any = any || channel(walk.transmittance, c) > 0;
    }
    walk.done = !any;
    if (walk.done) walk.distance = at.position();
  }

  Value result(const Walk& walk, const RayData&) const { return walk.transmittance; }

  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight&) const {
    return {walk.distance < ray.end ? EventKind::collision : EventKind::escape, walk.distance, ray.value(1)};
  }

  int real_collisions(const Walk& walk, const RayData&) const { return walk.done; }

  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    const Real depth = profile.optical_depth(c);
    Theory theory{.variance = std::exp(-depth) * -std::expm1(-depth)};
    state_lookups_until_killed(
        theory, profile, [](int, const RayProfile::Node& at) { return at.extinction; },
        [&](const RayProfile::Node& at) { return ray.residual.rate(at.piece); });
    theory.lookups_variance.reset();  // stated for walks that die at collisions only; the control kills in between
    return theory;
  }
};

}  // namespace nullmark
