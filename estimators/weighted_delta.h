#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/kinks.h"
#include "estimators/theory/survival.h"

namespace nullmark {

/// Weighted delta tracking [Carter, Cashwell, Taylor 1972; Galtier et al. 2013; Kutz et al. 2017, Sec. 3]: a tentative collision
/// is real with probability mu/s, s = mu + |mub - mu|, and multiplies the weight by s/mub; a null one by sgn(mub - mu) s/mub.
/// Unbiased for any mub > 0.  Delta tracking where mub bounds the extinction (s = mub); signed and unbounded elsewhere.
/// E[X^2] = exp(int |mu_n| s/mub - mub), lookups int mub exp(-int_0^x mub mu/s).  Channels share one walk and its random numbers.
template <class Value>
struct WeightedDeltaTracking {
  static constexpr const char* kName = "weighted_delta";
  static constexpr const char* kSummary = "weighted delta tracking: delta tracking at any rate, with signed weights";
  static constexpr const char* kSource = "Carter, Cashwell, Taylor 1972; Kutz et al. 2017, Sec. 3";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kLanes = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    Value weight, collision;  ///< of each channel's walk so far, and of its collision
    Truth<Value> done = false;
  };

  void init(Walk& walk, const auto& ray, auto&, auto&) const { walk = {ray.value(1), ray.value(0), false}; }

  auto propose(Walk& walk, const auto&, auto& flight, auto& rng) const { return flight.next(rng, !walk.done); }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    const Distance<Value> u = rng.uniform();
    const Value sum = sum_of_rates(extinction, at.rate()), grown = sum / at.rate();
    const Value null = select(extinction > at.rate(), -grown, grown);
    walk.collision = select(extinction > u * sum, walk.weight * grown, walk.collision);
    walk.weight = select(extinction > u * sum, ray.value(0), walk.weight * null);
    walk.done = vanished(walk.weight);
  }

  Value result(const Walk& walk, const auto&) const { return walk.weight; }

  /// Channels that share a walk end apart.
  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const MediumRay<Value>&, const Flight& at) const {
    if (!walk.done) return {EventKind::escape, at.position(), walk.weight};
    return {EventKind::collision, at.position(), walk.collision};
  }

  auto real_collisions(const Walk& walk, const auto&) const { return walk.done; }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& smooth, int c, Quantity) const {
    const RayProfile profile = cut_at_levels(smooth, ray.majorant, {&ray.majorant});
    const auto rate = [&](const RayProfile::Node& at) { return ray.majorant.rate(at.piece); };
    const auto killed = [&](int, const RayProfile::Node& at) {
      const Real mub = rate(at);
      return mub > 0 ? mub * at.extinction / sum_of_rates(at.extinction, mub) : 0;
    };
    const Real depth = profile.optical_depth(c);
    const Real growth = profile.integrate(c, [&](const RayProfile::Node& at) {
      const Real mub = rate(at);
      if (!(mub > 0)) return Real{0};
      return std::abs(mub - at.extinction) * sum_of_rates(at.extinction, mub) / mub - mub;
    });
    Theory theory{.variance = product_variance(-depth, growth + 2 * depth)};
    state_lookups_until_killed(theory, profile, killed, rate);
    return theory;
  }

  /// E[w^2; collision] = int mu (mu + |mu_n|)/mub K dx.
  Theory weight_theory(const MediumRay<Value>& ray, const RayProfile& smooth, int c) const {
    const RayProfile profile = cut_at_levels(smooth, ray.majorant, {&ray.majorant});
    std::vector<Real> growth, collisions;
    for (const RayProfile::Node& at : profile.nodes(c)) {
      const Real mub = ray.majorant.rate(at.piece), grown = mub > 0 ? sum_of_rates(at.extinction, mub) / mub : 0;
      growth.push_back(std::abs(mub - at.extinction) * grown - mub);
      collisions.push_back(at.extinction * grown);
    }
    Theory theory = this->theory(ray, smooth, c, Quantity::free_path);
    theory.variance = weight_variance(profile, c, growth, collisions);
    return theory;
  }

 private:
  /// mu + |mub - mu|; mub itself where it bounds, so that weights stay 1 to the last bit.
  template <class V>
  static V sum_of_rates(const V& mu, const Distance<V>& mub) {
    return larger(mu, mub) + larger(mu - mub, 0);
  }
};

}  // namespace nullmark
