#pragma once

#include "estimators/estimator.h"
#include "estimators/kinks.h"
#include "estimators/survival.h"

namespace nullmark {

/// Weighted delta tracking [Carter, Cashwell, Taylor 1972; Galtier et al. 2013; Kutz et al. 2017, Sec. 3]: a tentative collision
/// is real with probability mu/s, s = mu + |mub - mu|, and multiplies the weight by s/mub; a null one by sgn(mub - mu) s/mub.
/// Unbiased for any mub > 0.  Delta tracking where mub bounds the extinction (s = mub); signed and unbounded elsewhere.
/// E[X^2] = exp(int |mu_n| s/mub - mub), lookups int mub exp(-int_0^x mub mu/s).  Channels share one walk and its random numbers.
template <class Value>
struct WeightedDeltaTracking {
  static constexpr const char* kName = "weighted_delta";
  static constexpr const char* kSummary = "weighted delta tracking: delta tracking under any rate, with signed weights";
  static constexpr const char* kSource = "Carter, Cashwell, Taylor 1972; Kutz et al. 2017, Sec. 3";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;

  Claim claim(Quantity) const { return Claim::unbiased; }

  struct Walk {
    Value weight;
    bool done = false;
    Real distance = 0, collision = 0;  ///< of a grey walk: where it ended, and the weight of its collision
  };

  void init(Walk& walk, const Passage<Value>& ray, Flight&, auto&) const { walk = {ray.value(1), false, ray.end, 0}; }

  bool propose(Walk& walk, const Passage<Value>&, Flight& flight, auto& rng) const { return !walk.done && flight.next(rng); }

  void consume(Walk& walk, const Passage<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Real u = rng.uniform();
    bool alive = false;
    for (int c = 0; c < ray.channels; ++c) {
      Real& weight = channel(walk.weight, c);
      const Real mu = channel(extinction, c), sum = sum_of_rates(mu, at.rate());
      if (u * sum < mu) {
        walk.collision = weight * (sum / at.rate());
        weight = 0;
      } else {
        weight *= (mu > at.rate() ? -sum : sum) / at.rate();
      }
      alive = alive || weight != 0;
    }
    walk.done = !alive;
    if (walk.done) walk.distance = at.position();
  }

  Value result(const Walk& walk, const Passage<Value>&) const { return walk.weight; }

  /// Channels that share a walk end apart.
  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const Passage<Value>& ray) const {
    if (!walk.done) return {EventKind::escape, ray.end, walk.weight};
    return {EventKind::collision, walk.distance, ray.value(walk.collision)};
  }

  int real_collisions(const Walk& walk, const Passage<Value>&) const { return walk.done; }

  Theory theory(const Passage<Value>& ray, const RayProfile& smooth, int c, Quantity) const {
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
    Theory theory{.variance = std::exp(-2 * depth) * std::expm1(growth + 2 * depth)};
    state_lookups_until_killed(theory, profile, killed, rate);
    return theory;
  }

  /// E[w^2; collision] = int mu (mu + |mu_n|)/mub K dx.
  Theory weight_theory(const Passage<Value>& ray, const RayProfile& smooth, int c) const {
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
  static Real sum_of_rates(Real mu, Real mub) { return mu > mub ? mu + (mu - mub) : mub; }
};

}  // namespace nullmark
