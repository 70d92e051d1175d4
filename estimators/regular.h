#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/gauss_points.h"

namespace nullmark {

/// Regular tracking: exact traversal from knot to knot [Amanatides and Woo 1987].  The extinction of the media that allow it is a
/// polynomial of the distance between neighbouring knots; degree/2 + 1 Gauss points integrate it exactly (trilinear voxels: a
/// cubic, two points), so only rounding is left.  Lookups = pieces * (degree/2 + 1).
template <class Value>
struct RegularTracking {
  static constexpr const char* kName = "regular";
  static constexpr const char* kSummary = "regular tracking: exact integration from knot to knot";
  static constexpr const char* kSource = "Amanatides and Woo 1987; Gauss-Legendre";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kNeedsKnots = true;

  Guarantee claim(Quantity) const { return Guarantee::exact; }

  struct Walk {
    Value depth;
    std::size_t piece = 0;
    int point = -1;
  };

  struct RayData : MediumRay<Value> {
    const GaussRule* rule = nullptr;
  };
  void prepare(RayData& ray) const { ray.rule = &gauss_rule(*ray.degree); }

  void init(Walk& walk, const RayData& ray, Flight&, auto&) const { walk = {ray.value(0), 0, -1}; }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto&) const {
    if (++walk.point == ray.rule->size()) {
      walk.point = 0;
      ++walk.piece;
    }
    if (walk.piece + 1 >= ray.knots.size()) return false;
    const Real a = ray.knots[walk.piece], b = ray.knots[walk.piece + 1];
    flight.jump(a + (b - a) * ray.rule->point[static_cast<std::size_t>(walk.point)]);
    return true;
  }

  void consume(Walk& walk, const RayData& ray, const Flight&, const Value& extinction, auto&) const {
    const Real width = ray.knots[walk.piece + 1] - ray.knots[walk.piece];
    walk.depth += extinction * (width * ray.rule->weight[static_cast<std::size_t>(walk.point)]);
  }

  Value result(const Walk& walk, const RayData&) const { return exponential(Value(-walk.depth)); }
  Value optical_depth(const Walk& walk, const RayData&) const { return walk.depth; }

  Theory theory(const RayData& ray, const RayProfile&, int, Quantity) const {
    const std::size_t pieces = ray.knots.size() < 2 ? 0 : ray.knots.size() - 1;
    return {.variance = 0, .lookups = static_cast<Real>(pieces) * ray.rule->size(), .lookups_variance = 0};
  }
};

}  // namespace nullmark
