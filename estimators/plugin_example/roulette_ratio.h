#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// Ratio tracking with a share of every weight left to Russian roulette.  With a = 1 - mu/mub, a tentative collision is survived
/// with probability p = a^share and multiplies the weight by a/p, which leaves the mean at T whatever the share: probabilities
/// of collisions are free where the weight makes up for them [Galtier et al. 2013].  Share 0 is ratio tracking, 1 delta
/// tracking; between them fewer lookups are bought with variance, because walks that carry little end early.
///
/// Collisions are a Poisson process of rate mub, so products over them have closed forms: E[w^2] = exp(-int mub (1 - a^2/p)),
/// and a walk is alive at t with probability exp(-int_0^t mub (1 - p)), hence Var = E[w^2] - T^2, lookups E[N] = int mub
/// P(alive), E[N(N-1)] = 2 int mub P(alive) int_0^t mub p.
///
/// Channels share a walk, and p is that of the largest |a|, at most 1: unbiased for any rate mub > 0, in [0,1] where it bounds.
template <class Value>
struct RouletteRatioTracking {
  static constexpr const char* kName = "roulette_ratio";
  static constexpr const char* kSummary = "ratio tracking with a share of the weight left to Russian roulette";
  static constexpr const char* kSource = "Novak, Selle, Jarosz 2014, Alg. 1; Galtier et al. 2013";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;

  Real share = 0.5;

  void parameters(ParameterVisitor& visit) {
    visit.number("share", share, Range::between(0, 1), "", "power of the null probability left to roulette: 0 ratio, 1 delta");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    Value weight;
    bool done = false;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto&) const { walk = {ray.value(1), false}; }

  bool propose(Walk& walk, const MediumRay<Value>&, Flight& flight, auto& rng) const { return !walk.done && flight.next(rng); }

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Value null = (at.rate() - extinction) / at.rate();
    Real most = 0;
    for (int c = 0; c < ray.channels; ++c) most = std::max(most, std::abs(channel(null, c)));
    const Real survival = survival_of(most);
    walk.done = rng.uniform() >= survival;
    if (walk.done)
      walk.weight = ray.value(0);
    else
      walk.weight *= null / survival;
  }

  Value result(const Walk& walk, const MediumRay<Value>&) const { return walk.weight; }

  int real_collisions(const Walk& walk, const MediumRay<Value>&) const { return walk.done; }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    const std::vector<RayProfile::Node>& nodes = profile.nodes(c);
    std::vector<Real> killed(nodes.size()), survived(nodes.size());  // mub (1 - p), mub p
    Real lost = 0;                                                   // int mub (1 - a^2/p)
    for (std::size_t j = 0; j < nodes.size(); ++j) {
      const Real rate = ray.majorant.rate(nodes[j].piece);
      if (!(rate > 0)) continue;
      const auto null = [&](int k) { return 1 - profile.nodes(k)[j].extinction / rate; };
      Real most = 0;
      for (int k = 0; k < ray.channels; ++k) most = std::max(most, std::abs(null(k)));
      const Real survival = survival_of(most);
      killed[j] = rate * (1 - survival);
      survived[j] = rate * survival;
      lost += nodes[j].weight * rate * (1 - (survival > 0 ? null(c) * null(c) / survival : 0));
    }
    const std::vector<Real> dead = profile.running(killed), before = profile.running(survived);
    Real lookups = 0, pairs = 0;  // E N, E N(N-1)
    for (std::size_t j = 0; j < nodes.size(); ++j) {
      const Real here = nodes[j].weight * ray.majorant.rate(nodes[j].piece) * std::exp(-dead[j]);
      lookups += here;
      pairs += 2 * here * before[j];
    }
    const Real depth = profile.optical_depth(c);
    return {.variance = std::exp(-2 * depth) * std::expm1(2 * depth - lost),
            .lookups = lookups,
            .lookups_variance = std::max<Real>(0, pairs + lookups - lookups * lookups)};
  }

 private:
  Real survival_of(Real null) const { return std::pow(std::min<Real>(1, null), share); }
};

}  // namespace nullmark
