#pragma once

#include <numeric>

#include "estimators/control.h"
#include "estimators/theory/kinks.h"
#include "estimators/theory/survival.h"

namespace nullmark {

/// Weighted decomposition tracking [Kutz et al. 2017, Sec. 4.2].  Flights at rate mub; with probability mu_c/mub the collision
/// is the control's, without a lookup and at weight exactly 1; else residual (mu - mu_c) and null (mub - mu) are chosen by their
/// absolute values, A in sum, and the weight is multiplied by sgn A/(mub - mu_c).  Of several constant controls each is picked
/// with mu_i/mub at weight 1, so that their sum mu_c alone shows.  Unbiased for any mub > mu_c; all weights are 1 where mu_c <=
/// mu <= mub, signed elsewhere.  With K = exp(-int mub - A |mu_n|/(mub - mu_c)): E[X^2] = K, lookups int (mub - mu_c)
/// exp(-int_0^x mub - (mub - mu_c) |mu_n|/A).
///
/// With `control_albedo` a_c the events are five: absorption (1 - a_c) mu_c and scattering a_c mu_c by the control, the residuals
/// r_a = mu_a - (1 - a_c) mu_c and r_s = mu_s - a_c mu_c of any sign, and null, A = |r_a| + |r_s| + |mu_n|.  Without it
/// collisions are left to the albedo, which must be constant then, for the control's look nothing up.  Grey media.
template <class Value>
struct WeightedDecompositionTracking {
  static constexpr const char* kName = "weighted_decomposition";
  static constexpr const char* kSummary = "weighted decomposition tracking, for any controls and rates";
  static constexpr const char* kSource = "Kutz, Habel, Li, Novak 2017, Sec. 4.2";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kOwnFlights = true;
  static constexpr bool kDrawsExponentials = true;
  static constexpr bool kGreyOnly = true;
  static constexpr bool kLanes = true;

  std::string control = "minimum";
  std::vector<Real> controls, control_albedo;

  void parameters(ParameterVisitor& visit) {
    visit.choice("control", control, {"minimum", "average", "middle", "maximum", "medium_average", "given"},
                 "control extinction: from the segment's bounds, the medium, or given");
    visit.numbers("controls", controls, 0, 16, Range::non_negative(), "1/length", "constant control extinctions (given)");
    visit.numbers("control_albedo", control_albedo, 0, 1, Range::between(0, 1), "",
                  "share of the control that scatters: absorption and scattering get residuals of their own");
  }

  void check(const MatterBounds& medium) const {
    if ((control == "given") == controls.empty())
      throw ParameterError("controls", "control \"given\" takes its extinctions from controls, the others take none");
    expect_control_albedo(medium, control_albedo);
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  SampleRange range() const { return control == "minimum" && control_albedo.empty() ? kRange : SampleRange::any_sign; }

  struct RayData : MediumRay<Value> {
    Rates control, rate;
    Control<Value> constant;  ///< the control and its deviation as they are prepared; kept, or every ray would allocate them
    Rates deviation;
  };

  /// The majorant is the rate; where it does not exceed the control, mu_c + max |mu - mu_c| is.
  void prepare(RayData& ray) const {
    ControlChoice choice;
    choice.kind = control;
    choice.value = std::accumulate(controls.begin(), controls.end(), Real{0});
    prepare_control<Value>(choice, ray, ray.constant, ray.deviation);
    ray.control.start(ray.begin, ray.bounds.crossing());
    ray.rate.start(ray.begin, ray.bounds.crossing());
    for (std::size_t i = 0; i < ray.constant.of_segment.size(); ++i) {
      const Segment& segment = ray.bounds.segments()[i];
      const Real mu_c = channel(ray.constant.of_segment[i], 0);
      ray.control.append(segment.end, mu_c);
      ray.rate.append(segment.end, segment.majorant > mu_c ? segment.majorant : mu_c + ray.deviation.rate(i));
    }
  }

  struct Walk {
    Distance<Value> weight;
    Truth<Value> done = false, looked_up = false;
    Truth<Value> scatters = false;  ///< of a walk that is done, with a control_albedo
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto&) const {
    walk = {1, false, false, false};
    flight.start(ray.rate);
  }

  auto propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    const auto inside = flight.next(rng, !walk.done);
    if (none(inside)) return inside;
    const Distance<Value> mu_c = rate_of(ray.control, flight.piece()), chosen = rng.uniform_where(inside) * flight.rate();
    const decltype(inside) residual = inside & !(chosen < mu_c) & (mu_c < flight.rate()), by_control = inside & !residual;
    if (none(by_control)) return residual;
    if (!control_albedo.empty()) walk.scatters = walk.scatters | (by_control & (chosen < control_albedo[0] * mu_c));
    walk.done = by_control | walk.done;
    return residual;
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    if (control_albedo.empty())
      choose<false>(walk, ray, at, extinction, rng);
    else
      choose<true>(walk, ray, at, extinction, rng);
  }

  Value result(const Walk& walk, const auto& ray) const {
    return ray.value(1) * select(walk.done, Distance<Value>(0), walk.weight);
  }

  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight& at) const {
    return {decomposed_end(walk, control_albedo), at.position(), ray.value(walk.weight)};
  }

  auto real_collisions(const Walk& walk, const auto&) const { return walk.looked_up; }

  Theory theory(const RayData& ray, const RayProfile& smooth, int c, Quantity) const {
    const RayProfile profile = cut_at_bends(ray, smooth);
    std::vector<Real> growth, rate, through, death;
    for (const RayProfile::Node& at : profile.nodes(c)) {
      const Real mub = ray.rate.rate(at.piece), mu_c = ray.control.rate(at.piece);
      const auto part = parts(ray, at.extinction, at.t, mu_c, mub);
      const Real null = std::abs(part.null);
      rate.push_back(mub - mu_c);
      through.push_back(part.sum > 0 ? rate.back() * null / part.sum : 0);
      death.push_back(mub - through.back());
      growth.push_back(rate.back() > 0 ? part.sum * null / rate.back() - mub : -mub);
    }
    return theory_of_escape_weight(profile, c, rate, through, death, growth);
  }

  /// E[w^2; collision] = int [mu_c + (|r_a| + |r_s|) A/(mub - mu_c)] K dx.
  Theory weight_theory(const RayData& ray, const RayProfile& smooth, int c) const {
    const RayProfile profile = cut_at_bends(ray, smooth);
    std::vector<Real> growth, collisions;
    for (const RayProfile::Node& at : profile.nodes(c)) {
      const Real mub = ray.rate.rate(at.piece), mu_c = ray.control.rate(at.piece);
      const auto part = parts(ray, at.extinction, at.t, mu_c, mub);
      const Real grown = mub > mu_c ? part.sum / (mub - mu_c) : 0;
      growth.push_back(grown * std::abs(part.null) - mub);
      collisions.push_back(mu_c + grown * part.residual);
    }
    Theory theory = this->theory(ray, smooth, c, Quantity::free_path);
    theory.variance = weight_variance(profile, c, growth, collisions);
    return theory;
  }

 private:
  /// What a lookup splits into; the residual of three events stands for that of absorption.
  template <class Number>
  struct Parts {
    Number scatter, absorb, null;
    Number residual, sum;  ///< |r_s| + |r_a|, and with |mu_n|
  };

  template <bool five>
  void choose(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    const Distance<Value> mu = channel(extinction, 0), mu_c = rate_of(ray.control, at.piece());
    const auto part = parts<five>(ray, mu, at.position(), mu_c, at.rate());
    const Distance<Value> chosen = rng.uniform() * part.sum, grown = part.sum / (at.rate() - mu_c);
    const auto real = chosen < part.residual;
    Distance<Value> event = select(real, part.absorb, part.null);
    if constexpr (five) {
      const auto scatters = chosen < magnitude(part.scatter);
      event = select(scatters, part.scatter, event);
      walk.scatters = scatters;
    }
    walk.weight *= select(event < 0, -grown, grown);
    walk.done = walk.looked_up = real;
  }

  /// Where nothing has changed sign the sum is mub - mu_c itself, so that weights stay 1 to the last bit.
  template <bool five, class Number>
  Parts<Number> parts(const auto& ray, const Number& mu, const Number& t, const Number& mu_c, const Number& mub) const {
    Parts<Number> part{0, mu - mu_c, mub - mu, 0, 0};
    if constexpr (five) {
      const Number albedo = grey_albedo(ray, t);
      part.scatter = albedo * mu - control_albedo[0] * mu_c;
      part.absorb = (1 - albedo) * mu - (1 - control_albedo[0]) * mu_c;
      part.residual = magnitude(part.scatter) + magnitude(part.absorb);
    } else {
      part.residual = magnitude(part.absorb);
    }
    const auto changed = (part.scatter < 0) | (part.absorb < 0) | (part.null < 0);
    part.sum = select(changed, part.residual + magnitude(part.null), mub - mu_c);
    return part;
  }

  Parts<Real> parts(const RayData& ray, Real mu, Real t, Real mu_c, Real mub) const {
    return control_albedo.empty() ? parts<false>(ray, mu, t, mu_c, mub) : parts<true>(ray, mu, t, mu_c, mub);
  }

  /// Theories bend where a residual or the null collisions change sign.
  RayProfile cut_at_bends(const RayData& ray, const RayProfile& smooth) const {
    const RayProfile profile = cut_at_levels(smooth, ray.rate, {&ray.rate, &ray.control});
    if (control_albedo.empty()) return profile;
    const auto sign_of = [&](Real Parts<Real>::*part) {
      return [this, &ray, part](Real t, std::size_t piece, Real mu) {
        return parts(ray, mu, t, ray.control.rate(piece), ray.rate.rate(piece)).*part > 0;
      };
    };
    return cut_at_changes(cut_at_changes(profile, ray.rate, sign_of(&Parts<Real>::scatter)), ray.rate,
                          sign_of(&Parts<Real>::absorb));
  }
};

}  // namespace nullmark
