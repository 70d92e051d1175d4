#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// T = exp(-tau) from the medium's closed form, without a lookup; free paths of grey media by inversion: where tau(t) is a unit
/// exponential, or escape if it is not reached [closed-form tracking].
template <class Value>
struct ClosedForm {
  static constexpr const char* kName = "closed_form";
  static constexpr const char* kSummary = "Beer-Lambert law on a closed-form optical depth";
  static constexpr const char* kSource = "Beer-Lambert";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kNeedsOpticalDepth = true;
  static constexpr bool kNeedsInversion = true;

  Guarantee claim(Quantity) const { return Guarantee::exact; }

  struct Walk {
    Real depth = 0;  ///< optical depth of the collision
  };

  void init(Walk& walk, const MediumRay<Value>&, Flight&, auto& rng) const { walk.depth = rng.exponential(); }
  bool propose(Walk&, const MediumRay<Value>&, Flight&, auto&) const { return false; }
  void consume(Walk&, const MediumRay<Value>&, const Flight&, const Value&, auto&) const {}

  Value result(const Walk&, const MediumRay<Value>& ray) const { return exponential(Value(-*ray.exact_depth)); }
  Value optical_depth(const Walk&, const MediumRay<Value>& ray) const { return *ray.exact_depth; }

  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const MediumRay<Value>& ray, const Flight&) const {
    const Real distance = ray.distance_at_depth(walk.depth);
    if (distance < ray.end) return {EventKind::collision, distance, ray.value(1)};
    return {EventKind::escape, ray.end, ray.value(1)};
  }

  Theory theory(const MediumRay<Value>&, const RayProfile&, int, Quantity) const {
    return {.variance = 0, .lookups = 0, .lookups_variance = 0};
  }
};

}  // namespace nullmark
