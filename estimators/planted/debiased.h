#pragma once

#include "estimators/majorant_guided_ratio.h"
#include "estimators/telescoping.h"
#include "estimators/unbiased_ray_marching.h"

namespace nullmark {

/// Unbiased ray marching whose marches share one offset: they are all the same, so no power of their differences is left.
template <class Value>
struct PlantedSharedOffset : UnbiasedRayMarching<Value> {
  static constexpr const char* kName = "planted_shared_offset";
  static constexpr const char* kSummary = "wrong: unbiased ray marching with one offset for all marches of a sample";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = UnbiasedRayMarching<Value>;
  using RayData = typename Base::RayData;
  using Walk = typename Base::Walk;

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    const Real before = walk.offset;
    if (!Base::propose(walk, ray, flight, rng)) return false;
    if (walk.complete > 0) {
      walk.offset = before;
      flight.jump(ray.begin + (walk.offset + (flight.lookups() - walk.before)) * ray.step);
    }
    return true;
  }

  /// Right at first order only.
  Theory theory(const RayData&, const RayProfile&, int, Quantity) const { return {}; }
};

/// A telescoping march that divides its difference by (1 - r)^n, not by p(n) = r (1 - r)^n.
template <class Value>
struct PlantedUnweightedLevel : Telescoping<Value> {
  static constexpr const char* kName = "planted_unweighted_level";
  static constexpr const char* kSummary = "wrong: telescoping march that takes (1 - r)^n for the chance of level n";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = Telescoping<Value>;
  using RayData = typename Base::RayData;
  using Walk = typename Base::Walk;

  Value result(const Walk& walk, const RayData& ray) const { return walk.base + (Base::result(walk, ray) - walk.base) * this->r; }

  Theory theory(const RayData&, const RayProfile&, int, Quantity) const { return {}; }
};

/// Majorant-guided ratio tracking that leaves the last flight's weight e^{(q - 1)(M - s)} out.
template <class Value>
struct PlantedGuidedEscape : MajorantGuidedRatio<Value> {
  static constexpr const char* kName = "planted_guided_escape";
  static constexpr const char* kSummary = "wrong: majorant-guided ratio tracking without the weight of its last flight";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = MajorantGuidedRatio<Value>;
  using Walk = typename Base::Walk;

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    const Value before = walk.weight;
    if (Base::propose(walk, ray, flight, rng)) return true;
    walk.weight = before;
    return false;
  }

  Theory theory(const MediumRay<Value>&, const RayProfile&, int, Quantity) const { return {}; }
};

}  // namespace nullmark
