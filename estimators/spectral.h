#pragma once

#include <boost/math/special_functions/gamma.hpp>

#include "estimators/estimator.h"
#include "estimators/theory/kinks.h"
#include "estimators/theory/log_factorial.h"
#include "estimators/theory/survival.h"
#include "estimators/walk/event_choice.h"

namespace nullmark {

/// Spectral tracking [Kutz, Habel, Li, Novák 2017, Sec. 5]: one walk for all channels l; a tentative collision is the event k of
/// absorption, scattering, null with probability P_k = R_k/sum R and multiplies the weight of each channel by mu_k,l/(mub P_k).
///
///   maximum                R_k = max_l |mu_k,l|
///   average                R_k = avg_l |mu_k,l|
///   history_aware_maximum  R_k = max_l |w_l mu_k,l|
///   history_aware_average  R_k = avg_l |w_l mu_k,l|: avg_l w_l = 1 always, so that w_l <= the number of channels, where mub
///   bounds
///
/// w_l includes what the path's earlier flights have made of it (MediumRay::throughput).  With `control` the segment's minimum is
/// split off (spectral decomposition): first control against rest, mu_c against mub - mu_c in the scheme's own measure, and only
/// the rest costs a lookup.  Unbiased for any mub > 0.  Without history E[X^2] = exp(-int mub (1 - mu_n^2/(mub^2 P_n))), lookups
/// int mub exp(-int_0^x mub (1 - P_n)); history-aware average has the lookups int mub avg_l T_l(0,x).  On grey media it is
/// weighted delta tracking.
template <class Value>
struct SpectralTracking {
  static constexpr const char* kName = "spectral";
  static constexpr const char* kSummary = "spectral tracking: one walk for all channels, event probabilities by a scheme";
  static constexpr const char* kSource = "Kutz, Habel, Li, Novak 2017, Sec. 5";
  static constexpr SampleRange kRange = std::is_same_v<Value, Real> ? SampleRange::unit : SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;

  std::string scheme = "history_aware_average", control = "none";

  void parameters(ParameterVisitor& visit) {
    visit.choice("scheme", scheme, {"maximum", "average", "history_aware_maximum", "history_aware_average"},
                 "what the chances of events are proportional to: coefficients, or weighted coefficients, over the channels");
    visit.choice("control", control, {"none", "minimum"},
                 "minimum: collisions of the segment's least extinction take no lookup (spectral decomposition)");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  /// Collisions of the control are no lookups.
  bool flies_once(int) const { return control == "none"; }

  struct RayData : MediumRay<Value> {
    bool by_maximum = false, by_history = false;
    std::vector<Value> control, excess;  ///< per segment: the control, and the most by which the extinction exceeds it
  };

  void prepare(RayData& ray) const {
    ray.by_maximum = scheme == "maximum" || scheme == "history_aware_maximum";
    ray.by_history = scheme == "history_aware_maximum" || scheme == "history_aware_average";
    ray.control.clear();
    ray.excess.clear();
    if (control == "none") return;
    for (const Segment& segment : ray.bounds.segments()) {
      ray.control.push_back(load<Value>(segment.extinction.minimum.data(), ray.channels));
      ray.excess.push_back(load<Value>(segment.extinction.maximum.data(), ray.channels) - ray.control.back());
    }
  }

  struct Walk {
    Value weight;
    EventKind kind = EventKind::escape;
    Real lookup_chance = 1;  ///< that a tentative collision here is not the control's
    bool looked_up = false;
  };

  void init(Walk& walk, const RayData& ray, Flight&, auto&) const { walk = {ray.value(1), EventKind::escape, 1, false}; }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    if (walk.kind != EventKind::escape || !flight.next(rng)) return false;
    if (ray.control.empty()) return true;
    const Value& mu_c = ray.control[flight.piece()];
    walk.lookup_chance = lookup_chance(ray, walk.weight, flight.rate(), flight.piece());
    const Real u = rng.uniform();
    if (u < walk.lookup_chance) return true;
    const Coefficients<Value> mu(mu_c, ray.albedo, flight.rate());
    const Real absorb = ray.draws_absorption ? measure(ray, walk.weight, mu.absorb) : 0,
               scatter = measure(ray, walk.weight, mu.scatter);
    const Real chance = 1 - walk.lookup_chance;
    walk.kind = choose_event((u - walk.lookup_chance) / chance, absorb, scatter, 0);
    take(walk, ray, mu, flight.rate() * chance, walk.kind, absorb, scatter, 0);
    return false;
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    Coefficients<Value> mu(extinction, ray.albedo, at.rate());
    if (!ray.control.empty()) mu = residual(ray, mu, at.piece());
    const Real absorb = ray.draws_absorption ? measure(ray, walk.weight, mu.absorb) : 0,
               scatter = measure(ray, walk.weight, mu.scatter), null = measure(ray, walk.weight, mu.null);
    const EventKind kind = choose_event(rng.uniform(), absorb, scatter, null);
    walk.kind = kind;
    walk.looked_up = kind != EventKind::escape;
    take(walk, ray, mu, at.rate() * walk.lookup_chance, kind, absorb, scatter, null);
  }

  Value result(const Walk& walk, const RayData& ray) const { return walk.kind == EventKind::escape ? walk.weight : ray.value(0); }

  Event<Value> event(const Walk& walk, const RayData&, const Flight& at) const { return {walk.kind, at.position(), walk.weight}; }

  int real_collisions(const Walk& walk, const RayData&) const { return walk.looked_up; }

  Theory theory(const RayData& ray, const RayProfile& smooth, int c, Quantity) const {
    const RayProfile profile = cut_at_levels(smooth, ray.majorant, {&ray.majorant});
    if (!ray.by_history || ray.channels == 1) return theory_without_history(ray, profile, c);
    if (is_constant(ray, profile)) return theory_of_constant(ray, profile, c);
    Theory theory;
    if (ray.by_maximum || !ray.draws_absorption) return theory;
    Real lookups = 0;
    for (int l = 0; l < ray.channels; ++l)
      for (const RayProfile::Node& at : profile.nodes(l)) {
        const Real mub = ray.majorant.rate(at.piece);
        if (at.extinction > mub) return theory;
        const Real mu_c = ray.control.empty() ? 0 : channel(ray.control[at.piece], l);
        lookups += at.weight * (mub - mu_c) * std::exp(-at.depth) / ray.channels;
      }
    theory.lookups = lookups;
    return theory;
  }

  /// On grey media all weights are 1 where the rate bounds.
  Theory weight_theory(const RayData& ray, const RayProfile& profile, int c) const {
    Theory theory = this->theory(ray, profile, c, Quantity::free_path);
    theory.mean = theory.variance = {};
    if (ray.channels > 1) return theory;
    for (const RayProfile::Node& at : profile.nodes(0))
      if (at.extinction > ray.majorant.rate(at.piece)) return theory;
    theory.variance = 0;
    return theory;
  }

 private:
  /// R_k of the scheme.
  static Real measure(const RayData& ray, const Value& weight, const Value& coefficient) {
    const Value x = magnitude(ray.by_history ? Value(ray.throughput * weight * coefficient) : coefficient);
    return ray.by_maximum ? largest(x) : average(x);
  }

  /// The rest is at least what the segment's bounds allow, also under a rate that does not exceed the control.
  static Real lookup_chance(const RayData& ray, const Value& weight, Real mub, std::size_t piece) {
    const Value& mu_c = ray.control[piece];
    const Coefficients<Value> mu(mu_c, ray.albedo, mub);
    Value least = magnitude(mu.null);
    for (int l = 0; l < ray.channels; ++l) channel(least, l) = std::max(channel(least, l), channel(ray.excess[piece], l));
    const Real rest = measure(ray, weight, least), own = measure(ray, weight, ray.draws_absorption ? mu_c : mu.scatter);
    return own > 0 ? rest / (own + rest) : 1;
  }

  static Coefficients<Value> residual(const RayData& ray, Coefficients<Value> mu, std::size_t piece) {
    const Coefficients<Value> control(ray.control[piece], ray.albedo, 0);
    mu.absorb -= control.absorb;
    mu.scatter -= control.scatter;
    return mu;
  }

  /// w_l *= mu_k,l/(rate P_k); nothing is left where absorption, not an event, took all.
  static void take(Walk& walk, const RayData& ray, const Coefficients<Value>& mu, Real rate, EventKind kind, Real absorb,
                   Real scatter, Real null) {
    const Real own = kind == EventKind::absorb ? absorb : kind == EventKind::scatter ? scatter : null;
    const Real sum = absorb + scatter + null;
    if (!(own > 0))
      walk.weight = ray.value(0);
    else if (own * rate < least_normal(rate))  // of extinctions near the least number the product is none
      walk.weight *= mu.of(kind) / own * (sum / rate);
    else
      walk.weight *= mu.of(kind) * (sum / (own * rate));
  }

  /// Chances of a lookup and of a null collision at a point, and the null collision's factor of the weights.
  struct Step {
    Real lookup = 1, null = 0;
    Value factor;

    Step(const RayData& ray, const Value& weight, const Value& extinction, std::size_t piece) : factor(ray.value(0)) {
      const Real mub = ray.majorant.rate(piece);
      if (!(mub > 0)) return;
      Coefficients<Value> mu(extinction, ray.albedo, mub);
      if (!ray.control.empty()) {
        lookup = lookup_chance(ray, weight, mub, piece);
        mu = residual(ray, mu, piece);
      }
      const Real absorb = ray.draws_absorption ? measure(ray, weight, mu.absorb) : 0, scatter = measure(ray, weight, mu.scatter),
                 free = measure(ray, weight, mu.null);
      if (!(free > 0)) return;
      null = lookup * free / (absorb + scatter + free);
      factor = mu.null / (mub * null);
    }
  };

  static Value extinction_at(const RayData& ray, const RayProfile& profile, std::size_t node) {
    Value extinction = ray.value(0);
    for (int l = 0; l < ray.channels; ++l) channel(extinction, l) = profile.nodes(l)[node].extinction;
    return extinction;
  }

  static Theory theory_without_history(const RayData& ray, const RayProfile& profile, int c) {
    std::vector<Real> rate, through, death, growth;
    for (std::size_t j = 0; j < profile.nodes(c).size(); ++j) {
      const std::size_t piece = profile.nodes(c)[j].piece;
      const Real mub = ray.majorant.rate(piece);
      const Step step(ray, ray.value(1), extinction_at(ray, profile, j), piece);
      const Real factor = channel(step.factor, c);
      rate.push_back(mub * step.lookup);
      through.push_back(mub * step.null);
      death.push_back(mub - through.back());
      growth.push_back(through.back() * factor * factor - mub);
    }
    return theory_of_escape_weight(profile, c, rate, through, death, growth);
  }

  static bool is_constant(const RayData& ray, const RayProfile& profile) {
    for (int l = 0; l < ray.channels; ++l)
      for (const RayProfile::Node& at : profile.nodes(l)) {
        const RayProfile::Node& first = profile.nodes(l)[0];
        if (at.extinction != first.extinction || ray.majorant.rate(at.piece) != ray.majorant.rate(first.piece)) return false;
        if (!ray.control.empty() && channel(ray.control[at.piece], l) != channel(ray.control[first.piece], l)) return false;
      }
    return true;
  }

  /// On a constant medium the weight after k null collisions is one number, and so is the chance Q_k to come that far: E[X^2] =
  /// sum_k Poisson(M; k) Q_k w_k^2, lookups sum_k P(Poisson(M) > k) Q_k P(lookup), their square with 2k + 1.
  static Theory theory_of_constant(const RayData& ray, const RayProfile& profile, int c) {
    const Real depth = ray.majorant.total_depth();
    constexpr Real kDeepest = 1e5;
    if (profile.nodes(c).empty() || !(depth > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    if (depth > kDeepest) return {};
    const Value extinction = extinction_at(ray, profile, 0);
    Value weight = ray.value(1);
    Real chance = 1, second = 0, lookups = 0, squares = 0;
    const Real last = depth + 12 * std::sqrt(depth) + 40;
    for (Real k = 0; k < last && chance > 0; ++k) {
      const Step step(ray, weight, extinction, 0);
      const Real w = channel(weight, c), poisson = std::exp(k * std::log(depth) - depth - log_factorial(k));
      const Real next = boost::math::gamma_p(k + 1, depth) * chance * step.lookup;
      second += poisson * chance * w * w;
      lookups += next;
      squares += (2 * k + 1) * next;
      chance *= step.null;
      weight *= step.factor;
    }
    const Real mean = std::exp(-profile.optical_depth(c));
    return {.variance = std::max<Real>(0, second - mean * mean),
            .lookups = lookups,
            .lookups_variance = std::max<Real>(0, squares - lookups * lookups)};
  }
};

}  // namespace nullmark
