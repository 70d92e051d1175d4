#pragma once

#include <boost/math/special_functions/gamma.hpp>

#include "estimators/estimator.h"
#include "estimators/theory/kinks.h"
#include "estimators/theory/log_factorial.h"
#include "estimators/theory/survival.h"
#include "estimators/walk/event_choice.h"

namespace nullmark {

/// What the chances of events are proportional to.
enum class SpectralScheme { maximum, average, history_aware_maximum, history_aware_average };

/// Extinction whose collisions take no lookup.
enum class SpectralControl { none, minimum, average, given };

/// Spectral tracking [Kutz, Habel, Li, Novák 2017, Sec. 5]: one walk for all channels l; a tentative collision is the event k of
/// absorption, scattering, null with probability P_k = R_k/sum R and multiplies the weight of each channel by mu_k,l/(mub P_k).
///
///   maximum                R_k = max_l |mu_k,l|
///   average                R_k = avg_l |mu_k,l|
///   history_aware_maximum  R_k = max_l |w_l mu_k,l|
///   history_aware_average  R_k = avg_l |w_l mu_k,l|: avg_l w_l = 1 always, so that w_l <= the number of channels, where mub
///   bounds
///
/// w_l includes what the path's earlier flights have made of it (MediumRay::throughput).  With `control` an extinction of
/// each channel is split off (spectral decomposition): first control against rest, mu_c against mub - mu_c in the scheme's own
/// measure, and only the rest costs a lookup.  Above the segment's minimum residuals may be negative, and weights with them.
/// Where the albedo varies, the minimum is of the least absorption and scattering that the albedo's bounds allow, and other
/// controls scatter by the middle of these bounds.  Unbiased for any mub > 0.  Without history E[X^2] = exp(-int mub (1 -
/// mu_n^2/(mub^2 P_n))), lookups int mub exp(-int_0^x mub (1 - P_n)); history-aware average has the lookups int mub avg_l
/// T_l(0,x).  On grey media it is weighted delta tracking.
template <class Value>
struct SpectralTracking {
  static constexpr const char* kName = "spectral";
  static constexpr const char* kSummary = "spectral tracking: one walk for all channels, event probabilities by a scheme";
  static constexpr const char* kSource = "Kutz, Habel, Li, Novak 2017, Sec. 5";
  static constexpr SampleRange kRange = std::is_same_v<Value, Real> ? SampleRange::unit : SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kLanes = true;

  SpectralScheme scheme = SpectralScheme::history_aware_average;
  SpectralControl control = SpectralControl::none;
  std::vector<Real> controls;

  void parameters(ParameterVisitor& visit) {
    visit.choice("scheme", scheme, {"maximum", "average", "history_aware_maximum", "history_aware_average"},
                 "what the chances of events are proportional to: coefficients, or weighted coefficients, over the channels");
    visit.choice("control", control, {"none", "minimum", "average", "given"},
                 "extinction whose collisions take no lookup (spectral decomposition): of the segment's bounds, or given");
    visit.numbers("controls", controls, 0, kMaxChannels, Range::non_negative(), "1/length",
                  "control extinction, one for all channels or one each (given)");
  }

  void check(const MatterBounds& medium) const {
    const auto given = static_cast<Eigen::Index>(controls.size());
    if ((control == SpectralControl::given) == controls.empty() || (given > 1 && given != medium.minimum.size()))
      throw ParameterError("controls", "has " + std::to_string(given) +
                                           " numbers; control \"given\" takes one for all channels or one for each of the " +
                                           std::to_string(medium.minimum.size()) + ", other controls take none");
  }

  SampleRange range() const { return beyond_minimum() ? SampleRange::any_sign : kRange; }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  /// Collisions of the control are no lookups.
  bool flies_once(int) const { return control == SpectralControl::none; }

  /// Of a segment: extinctions whose collisions take no lookup, and the most by which the medium's differs from them.
  struct Control {
    Value all, absorb, scatter, excess;
  };

  struct RayData : MediumRay<Value> {
    bool by_maximum = false, by_history = false;
    std::vector<Control> control;
  };

  void prepare(RayData& ray) const {
    using enum SpectralScheme;
    ray.by_maximum = scheme == maximum || scheme == history_aware_maximum;
    ray.by_history = scheme == history_aware_maximum || scheme == history_aware_average;
    ray.control.clear();
    if (control == SpectralControl::none) return;
    for (const Segment& segment : ray.bounds.segments()) {
      const Value least = load<Value>(segment.extinction.minimum.data(), ray.channels),
                  most = load<Value>(segment.extinction.maximum.data(), ray.channels), all = controlled(ray, segment.extinction);
      Control split{all, (1 - ray.albedo) * all, ray.albedo * all, all};
      if (ray.albedo_field) {
        const Value low = load<Value>(ray.albedo_field->least(ray.channels).data(), ray.channels);
        split.scatter = control == SpectralControl::minimum ? Value(low * all) : Value((low + ray.albedo) / 2 * all);
        if (control != SpectralControl::minimum) split.absorb = all - split.scatter;
        split.all = split.absorb + split.scatter;
      }
      const Value above = most - split.all, below = split.all - least;
      split.excess = select(above > below, above, below);
      ray.control.push_back(split);
    }
  }

  using Number = Distance<Value>;

  struct Walk {
    Value weight;
    Number lookup_chance;  ///< that a tentative collision here is not the control's
    EventChoice<Truth<Value>> end;
    Truth<Value> looked_up = false;
  };

  void init(Walk& walk, const auto& ray, auto&, auto&) const { walk = {ray.value(1), Number(1), {}, false}; }

  auto propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    const auto inside = flight.next(rng, !walk.end.ends());
    // Walks with a control look up less than they fly; they are never in lanes.
    if constexpr (!kSideBySide<Value>)
      if (inside && !ray.control.empty()) return looks_up(walk, ray, flight, rng);
    return inside;
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    if constexpr (!kSideBySide<Value>)
      if (ray.albedo_field || !ray.control.empty()) [[unlikely]]
        return consume_residual(walk, ray, at, extinction, rng);
    take_event(walk, ray, at, ray.coefficients(extinction, at.position(), at.rate()), rng);
  }

  Value result(const Walk& walk, const auto& ray) const { return select(walk.end.ends(), Value(ray.value(0)), walk.weight); }

  Event<Value> event(const Walk& walk, const RayData&, const Flight& at) const {
    return {walk.end.kind, at.position(), walk.weight};
  }

  auto real_collisions(const Walk& walk, const auto&) const { return walk.looked_up; }

  Theory theory(const RayData& ray, const RayProfile& smooth, int c, Quantity) const {
    const RayProfile profile = cut_at_levels(smooth, ray.majorant, {&ray.majorant});
    if (!ray.by_history || ray.channels == 1) return theory_without_history(ray, profile, c);
    if (is_constant(ray, profile)) return theory_of_constant(ray, profile, c);
    Theory theory;
    if (ray.by_maximum || !ray.draws_absorption || beyond_minimum()) return theory;
    Real lookups = 0;
    for (int l = 0; l < ray.channels; ++l)
      for (const RayProfile::Node& at : profile.nodes(l)) {
        const Real mub = ray.majorant.rate(at.piece);
        if (at.extinction > mub) return theory;
        const Real mu_c = ray.control.empty() ? 0 : channel(ray.control[at.piece].all, l);
        lookups += at.weight * (mub - mu_c) * std::exp(-at.depth) / ray.channels;
      }
    theory.lookups = lookups;
    return theory;
  }

  /// On grey media all weights are 1 where the rate and the control bound.
  Theory weight_theory(const RayData& ray, const RayProfile& profile, int c) const {
    Theory theory = this->theory(ray, profile, c, Quantity::free_path);
    theory.mean = theory.variance = {};
    if (ray.channels > 1 || beyond_minimum()) return theory;
    for (const RayProfile::Node& at : profile.nodes(0))
      if (at.extinction > ray.majorant.rate(at.piece)) return theory;
    theory.variance = 0;
    return theory;
  }

 private:
  /// Whether residuals may be negative.
  bool beyond_minimum() const { return control == SpectralControl::average || control == SpectralControl::given; }

  Value controlled(const RayData& ray, const Extrema& segment) const {
    if (control == SpectralControl::minimum) return load<Value>(segment.minimum.data(), ray.channels);
    if (control == SpectralControl::average) return load<Value>(segment.average.data(), ray.channels);
    Value all = ray.value(controls[0]);
    for (std::size_t c = 1; c < controls.size(); ++c) channel(all, static_cast<int>(c)) = controls[c];
    return all;
  }

  /// Whether a tentative collision is to be looked up; otherwise it is the control's, and the walk is done.
  [[gnu::noinline]] static bool looks_up(Walk& walk, const RayData& ray, const Flight& flight, auto& rng) {
    const Control& split = ray.control[flight.piece()];
    walk.lookup_chance = lookup_chance(ray, walk.weight, flight.rate(), flight.piece());
    const Real u = rng.uniform();
    if (u < walk.lookup_chance) return true;
    const Real absorb = ray.draws_absorption ? measure(ray, walk.weight, split.absorb) : 0,
               scatter = measure(ray, walk.weight, split.scatter);
    const Real chance = 1 - walk.lookup_chance;
    const auto event = choose_event((u - walk.lookup_chance) / chance, absorb, scatter, Real{0});
    walk.end = event;
    take(walk, ray, event.of(split.absorb, split.scatter, split.scatter), flight.rate() * chance,
         event.of(absorb, scatter, scatter), absorb + scatter);
    return false;
  }

  /// What few rays need stays out of `consume`, whose numbers then stay in registers.
  [[gnu::noinline]] static void consume_residual(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction,
                                                 auto& rng) {
    Coefficients<Value> mu = ray.coefficients(extinction, at.position(), at.rate());
    if (!ray.control.empty()) mu = residual(ray, mu, at.piece());
    take_event(walk, ray, at, mu, rng);
  }

  [[gnu::always_inline]] static void take_event(Walk& walk, const auto& ray, const auto& at, const Coefficients<Value>& mu,
                                                auto& rng) {
    const Number absorb = ray.draws_absorption ? measure(ray, walk.weight, mu.absorb) : Number(0),
                 scatter = measure(ray, walk.weight, mu.scatter), null = measure(ray, walk.weight, mu.null);
    const auto event = choose_event(Number(rng.uniform()), absorb, scatter, null);
    walk.end = event;
    walk.looked_up = event.ends();
    take(walk, ray, mu.of(event), at.rate() * walk.lookup_chance, event.of(absorb, scatter, null), absorb + scatter + null);
  }

  /// R_k of the scheme; where it is an average, times the number of channels: only ratios of R_k matter.
  [[gnu::always_inline]] static Number measure(const auto& ray, const Value& weight, const Value& coefficient) {
    const Value x = magnitude(ray.by_history ? Value(ray.throughput * weight * coefficient) : coefficient);
    return ray.by_maximum ? largest(x) : channel_sum(x);
  }

  /// The rest is at least what the segment's bounds allow, also under a rate that does not exceed the control.
  static Real lookup_chance(const RayData& ray, const Value& weight, Real mub, std::size_t piece) {
    const Control& split = ray.control[piece];
    Value least = magnitude(Value(mub - split.all));
    for (int l = 0; l < ray.channels; ++l) channel(least, l) = std::max(channel(least, l), channel(split.excess, l));
    const Real rest = measure(ray, weight, least), own = measure(ray, weight, ray.draws_absorption ? split.all : split.scatter);
    return own > 0 ? rest / (own + rest) : 1;
  }

  static Coefficients<Value> residual(const RayData& ray, Coefficients<Value> mu, std::size_t piece) {
    mu.absorb -= ray.control[piece].absorb;
    mu.scatter -= ray.control[piece].scatter;
    return mu;
  }

  /// w_l *= mu_k,l/(rate P_k), with P_k = own / sum; nothing is left where absorption, not an event, took all.
  [[gnu::always_inline]] static void take(Walk& walk, const auto& ray, const Value& coefficient, const Number& rate,
                                          const Number& own, const Number& sum) {
    const Number chance = own * rate;
    const auto usual = chance > Number(least_normal(rate));  // it underflows for extinctions near the least number
    Value factor = coefficient * (sum / chance);
    if (!none(!usual)) [[unlikely]]
      factor = select(usual, factor, select(own > Number(0), Value(coefficient / own * (sum / rate)), Value(ray.value(0))));
    walk.weight *= factor;
  }

  /// Chances of a lookup and of a null collision at a point, and the null collision's factor of the weights.
  struct Step {
    Real lookup = 1, null = 0;
    Value factor;

    Step(const RayData& ray, const Value& weight, const Value& extinction, const Value& albedo, std::size_t piece)
        : factor(ray.value(0)) {
      const Real mub = ray.majorant.rate(piece);
      if (!(mub > 0)) return;
      Coefficients<Value> mu(extinction, albedo, mub);
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
      const RayProfile::Node& at = profile.nodes(c)[j];
      const std::size_t piece = at.piece;
      const Real mub = ray.majorant.rate(piece);
      const Step step(ray, ray.value(1), extinction_at(ray, profile, j), ray.albedo_at(at.t), piece);
      const Real factor = channel(step.factor, c);
      rate.push_back(mub * step.lookup);
      through.push_back(mub * step.null);
      death.push_back(mub - through.back());
      growth.push_back(through.back() * factor * factor - mub);
    }
    return theory_of_escape_weight(profile, c, rate, through, death, growth);
  }

  static bool is_constant(const RayData& ray, const RayProfile& profile) {
    if (ray.albedo_field) return false;
    for (int l = 0; l < ray.channels; ++l)
      for (const RayProfile::Node& at : profile.nodes(l)) {
        const RayProfile::Node& first = profile.nodes(l)[0];
        if (at.extinction != first.extinction || ray.majorant.rate(at.piece) != ray.majorant.rate(first.piece)) return false;
        if (!ray.control.empty() && channel(ray.control[at.piece].all, l) != channel(ray.control[first.piece].all, l))
          return false;
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
      const Step step(ray, weight, extinction, ray.albedo, 0);
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
