#pragma once

#include <numeric>

#include "estimators/estimator.h"
#include "estimators/theory/kinks.h"
#include "estimators/theory/log_factorial.h"
#include "estimators/theory/survival.h"
#include "estimators/walk/event_choice.h"

namespace nullmark {

/// Hero wavelength sampling [Wilkie et al. 2014] in the path space of null collisions [Miller, Georgiev, Jarosz 2019]: a channel
/// drawn uniformly (on a path's later flights in proportion to its throughput, so that it is one hero's path) is delta tracked at
/// the majorant of them all, and the balance heuristic over the channels weighs the path for each: w_l = f_l/avg_h p_h, with p_h
/// the chance of the walk's events had h been the hero and f_l what they contribute to l. Needs mub >= mu of all channels.
/// Weights lie in [0, number of channels] and have the law of history-aware average's [Kutz et al. 2017, Sec. 5]: lookups int mub
/// avg_l T_l; E[X_l^2] = sum_k Poisson(M; k) a_l^2k/avg_h a_h^k on constant media, a = mu_n/mub.
template <class Value>
struct HeroWavelengthTracking {
  static constexpr const char* kName = "hero_wavelength";
  static constexpr const char* kSummary =
      "delta tracking of one random channel, weighted by the balance heuristic over all channels";
  static constexpr const char* kSource = "Wilkie et al. 2014; Miller, Georgiev, Jarosz 2019";
  static constexpr SampleRange kRange = std::is_same_v<Value, Real> ? SampleRange::unit : SampleRange::non_negative;
  static constexpr bool kNeedsBound = true;
  static constexpr bool kLanes = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  using Number = Distance<Value>;

  struct Walk {
    Number hero;                 ///< the channel, drawn at the first collision; -1 before it
    Value contribution, chance;  ///< f and p, over avg p
    EventChoice<Truth<Value>> end;
  };

  void init(Walk& walk, const auto& ray, auto&, auto&) const {
    walk = {Number(-1), ray.value(1), ray.throughput / average(ray.throughput), {}};
  }

  auto propose(Walk& walk, const auto&, auto& flight, auto& rng) const { return flight.next(rng, !walk.end.ends()); }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    if (at.lookups() == 1) walk.hero = choose(walk.chance, ray.channels, rng);
    const Coefficients<Value> mu = ray.coefficients(Value(smaller(extinction, at.rate())), at.position(), at.rate());
    const Value absorb = ray.draws_absorption ? mu.absorb : Value(ray.value(0));
    walk.end = choose_event(Number(rng.uniform()), of_hero(absorb, walk), of_hero(mu.scatter, walk), of_hero(mu.null, walk));
    const Value own = walk.end.of(absorb, mu.scatter, mu.null), sum = absorb + mu.scatter + mu.null;
    const Value contribution = walk.contribution * (own / at.rate());
    const Value chance = walk.chance * select(sum > 0, Value(own / sum), Value(ray.value(0)));
    const Number mean = average(chance);
    const auto any = mean > Number(0);
    walk.contribution = select(any, Value(contribution / mean), Value(ray.value(0)));
    walk.chance = select(any, Value(chance / mean), Value(ray.value(0)));
  }

  Value result(const Walk& walk, const auto& ray) const {
    return select(walk.end.ends(), Value(ray.value(0)), walk.contribution);
  }

  Event<Value> event(const Walk& walk, const MediumRay<Value>&, const Flight& at) const {
    return {walk.end.kind, at.position(), walk.contribution};
  }

  auto real_collisions(const Walk& walk, const auto&) const { return walk.end.ends(); }

  /// Where the majorant is violated the walk sees min(mu, mub).
  Theory theory(const MediumRay<Value>& ray, const RayProfile& smooth, int c, Quantity) const {
    const RayProfile profile = cut_at_levels(smooth, ray.majorant, {&ray.majorant});
    Theory theory;
    if (!ray.draws_absorption) return theory;
    std::vector<Real> rate, alive;
    Real seen = 0;
    bool constant = true;
    for (std::size_t j = 0; j < profile.nodes(0).size(); ++j) {
      rate.push_back(ray.majorant.rate(profile.nodes(0)[j].piece));
      constant = constant && rate[j] == rate[0];
    }
    alive.assign(rate.size(), 0);
    for (int l = 0; l < ray.channels; ++l) {
      std::vector<Real> killed;
      for (const RayProfile::Node& at : profile.nodes(l)) {
        killed.push_back(std::min(at.extinction, ray.majorant.rate(at.piece)));
        constant = constant && killed.back() == killed[0];
      }
      const std::vector<Real> depth = profile.running(killed);
      for (std::size_t j = 0; j < rate.size(); ++j) alive[j] += std::exp(-depth[j]) / ray.channels;
      std::size_t j = 0;
      const Real whole = profile.integrate(l, [&](const RayProfile::Node&) { return killed[j++]; });
      if (l == c) seen = whole;
    }
    if (seen < profile.optical_depth(c) * (1 - 1e-12)) theory.mean = std::exp(-seen);
    std::vector<Real> through = rate;
    for (std::size_t j = 0; j < rate.size(); ++j) through[j] -= std::min(profile.nodes(c)[j].extinction, rate[j]);
    state_lookups(theory, profile, rate, through, alive);
    if (ray.channels == 1) theory.variance = std::exp(-seen) * -std::expm1(-seen);
    if (ray.channels > 1) theory.lookups_variance.reset();
    if (ray.channels > 1 && constant) theory.variance = variance_of_constant(ray, profile, c);
    return theory;
  }

 private:
  /// A channel in proportion to its chance.
  static Number choose(const Value& chance, int channels, auto& rng) {
    Number hero(0);
    if (channels == 1) return hero;
    Number left = Number(rng.uniform()) * Number(channels);
    for (int c = 0; c + 1 < channels; ++c) {
      const auto passed = (hero == Number(c)) & !(left < channel(chance, c));
      left = select(passed, Number(left - channel(chance, c)), left);
      hero = select(passed, Number(c + 1), hero);
    }
    return hero;
  }

  static Number of_hero(const Value& x, const Walk& walk) {
    Number own = channel(x, 0);
    for (int c = 1; c < channel_count(x); ++c) own = select(walk.hero == Number(c), Number(channel(x, c)), own);
    return own;
  }

  static std::optional<Real> variance_of_constant(const MediumRay<Value>& ray, const RayProfile& profile, int c) {
    const Real depth = ray.majorant.total_depth();
    constexpr Real kDeepest = 1e5;
    if (profile.nodes(c).empty() || !(depth > 0)) return 0;
    if (depth > kDeepest) return std::nullopt;
    const auto channels = static_cast<std::size_t>(ray.channels);
    std::vector<Real> ratio, chance(channels, 1);  // a and a^k
    for (int l = 0; l < ray.channels; ++l) {
      const RayProfile::Node& at = profile.nodes(l)[0];
      const Real mub = ray.majorant.rate(at.piece);
      ratio.push_back((mub - std::min(at.extinction, mub)) / mub);
    }
    const auto own = static_cast<std::size_t>(c);
    const Real mean = std::exp(-(1 - ratio[own]) * depth), last = depth + 12 * std::sqrt(depth) + 40;
    Real second = 0;
    for (Real k = 0; k < last; ++k) {
      const Real sum = std::accumulate(chance.begin(), chance.end(), Real{0});
      if (!(sum > 0)) break;
      const Real poisson = std::exp(k * std::log(depth) - depth - log_factorial(k));
      second += poisson * chance[own] * chance[own] * static_cast<Real>(ray.channels) / sum;
      for (std::size_t l = 0; l < channels; ++l) chance[l] *= ratio[l];
    }
    return std::max<Real>(0, second - mean * mean);
  }
};

}  // namespace nullmark
