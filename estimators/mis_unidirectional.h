#pragma once

#include "estimators/vertex_sum.h"

namespace nullmark {

/// Unidirectional MIS of escape and next flight [Georgiev et al. 2019]: from each vertex of a ratio-tracking walk both "the
/// flight leaves" and "count the chance that it leaves" are estimates of the same term, weighed by the balance heuristic.  With v
/// = exp(- majorant depth left) and c = v/(1 + v), S = sum of W c over the origin and all tentative collisions, and W c once more
/// where the flight leaves.  Unbiased for any rate, since in majorant depth every rate is 1 and only the null ratio 1 - mu/mub is
/// left; (0, inf) where the majorant bounds.  Lookups int mub.
template <class Value>
struct UnidirectionalMis {
  static constexpr const char* kName = "mis_unidirectional";
  static constexpr const char* kSummary = "ratio tracking whose escape and next-flight estimates share the weight";
  static constexpr const char* kSource = "Georgiev et al. 2019, unidirectional MIS";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kLanes = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    Value weight, last, sum;  ///< W, W c of the last vertex, sum of W c
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto&) const {
    walk.weight = ray.value(1);
    walk.last = walk.sum = walk.weight * share(flight.depth_left());
  }

  auto propose(Walk&, const auto&, auto& flight, auto& rng) const { return flight.next(rng); }

  void consume(Walk& walk, const auto&, const auto& at, const Value& extinction, auto&) const {
    walk.weight *= null_ratio(at, extinction);
    walk.last = walk.weight * share(at.depth_left());
    walk.sum += walk.last;
  }

  Value result(const Walk& walk, const auto&) const { return walk.sum + walk.last; }

  /// From a vertex, S = c + (c if the flight leaves, else a S of the next vertex), a = 1 - mu/mub, and the mean of the latter is
  /// T
  /// - c - v c.  So a vertex of weight 1 adds g = c^2 + 2 c (T - v) + 3 v c^2, and E[S^2] = g(0) + int mub E[W^2] a^2 g dy.
  /// Nothing where the panels do not resolve v.
  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int channel, Quantity) const {
    const Real tau = profile.optical_depth(channel), total = ray.majorant.total_depth();
    Theory theory{.lookups = total, .lookups_variance = total};
    if (!profile.resolved()) return theory;
    const auto second = [](Real depth_left, Real tau_left) {
      const Real v = std::exp(-depth_left), c = v / (1 + v);
      return c * (c + 2 * (std::exp(-tau_left) - v) + 3 * v * c);
    };
    const Real rest = integral_over_vertices(ray, profile, channel, [&](Real a, Real depth_left, Real tau_left, Real) {
      return a * a * second(depth_left, tau_left);
    });
    theory.variance = std::max<Real>(0, second(total, tau) + rest - std::exp(-2 * tau));
    return theory;
  }

 private:
  static Distance<Value> share(const Distance<Value>& depth_left) {
    const Distance<Value> v = exponential(-depth_left);
    return v / (1 + v);
  }
};

}  // namespace nullmark
