#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/kinks.h"
#include "estimators/theory/survival.h"
#include "estimators/walk/event_choice.h"

namespace nullmark {

/// The integral framework of null collisions as it stands [Galtier et al. 2013; Kutz et al. 2017, Sec. 3]: a tentative collision
/// is an event k of absorption, scattering, null with probability P_k and multiplies the weight by mu_k/(mub P_k).  Unbiased for
/// any mub > 0, mu_n = mub - mu of any sign, and any P_k > 0 that sum to 1.
///
///   proportional   P_k = |mu_k|/sum, averaged over the channels
///   fixed          P_k as given, everywhere
///
/// Roulette `one`: one random number chooses among the events.  `three`: one number each for absorption, then scattering, then
/// null; P_k is the chance of survival when its turn comes, and a walk that survives none is lost, so fixed P_k need not sum to
/// 1.  With P_n the chance of a null collision in all, E[X^2] = exp(-int mub (1 - mu_n^2/(mub^2 P_n))), lookups int mub
/// exp(-int_0^x mub (1 - P_n)).
template <class Value>
struct NullCollisionTracking {
  static constexpr const char* kName = "null_collision";
  static constexpr const char* kSummary = "weighted tracking with given event probabilities";
  static constexpr const char* kSource = "Galtier et al. 2013; Kutz, Habel, Li, Novak 2017, Sec. 3";
  static constexpr SampleRange kRange = std::is_same_v<Value, Real> ? SampleRange::unit : SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;

  std::string probabilities = "proportional", roulette = "one";
  Real absorb = 0.25, scatter = 0.25, null = 0.5;

  void parameters(ParameterVisitor& visit) {
    visit.choice("probabilities", probabilities, {"proportional", "fixed"},
                 "chances of the events: proportional to their coefficients, or absorb, scatter and null");
    visit.choice("roulette", roulette, {"one", "three"}, "one random number for all events, or one for each in turn");
    constexpr Range kChance = {0, 1, true};
    visit.number("absorb", absorb, kChance, "", "chance of absorption (fixed)");
    visit.number("scatter", scatter, kChance, "", "chance of scattering (fixed)");
    visit.number("null", null, kChance, "", "chance of a null collision (fixed)");
  }

  void check(const MatterBounds&) const {
    if (probabilities != "fixed") return;
    constexpr Real kRounding = 1e-12;
    if (roulette == "one" && std::abs(absorb + scatter + null - 1) > kRounding)
      throw ParameterError("null", "absorb, scatter and null sum to " + std::to_string(absorb + scatter + null) +
                                       "; expected 1, or roulette \"three\"");
    if (roulette == "three" && !(absorb < 1 && scatter < 1))
      throw ParameterError("absorb",
                           "a roulette that always ends the walk leaves nothing to those after it; expected absorb "
                           "and scatter below 1 with roulette \"three\"");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  SampleRange range() const { return probabilities == "fixed" ? SampleRange::non_negative : kRange; }

  struct RayData : MediumRay<Value> {
    bool fixed = false, three = false;
  };
  void prepare(RayData& ray) const {
    ray.fixed = probabilities == "fixed";
    ray.three = roulette == "three";
  }

  struct Walk {
    Value weight;
    EventKind kind = EventKind::escape;
  };

  void init(Walk& walk, const RayData& ray, Flight&, auto&) const { walk = {ray.value(1), EventKind::escape}; }

  bool propose(Walk& walk, const RayData&, Flight& flight, auto& rng) const {
    return walk.kind == EventKind::escape && flight.next(rng);
  }

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Coefficients<Value> mu = ray.coefficients(extinction, at.position(), at.rate());
    const Chances chance = chances(ray, mu);
    const std::optional<EventKind> kind =
        ray.three ? three_roulettes(chance, rng) : choose_event(rng.uniform(), chance.absorb, chance.scatter, chance.null);
    walk.kind = kind.value_or(EventKind::absorb);
    const Real p = kind ? chance.of(*kind) : 0;
    walk.weight = p > 0 ? Value(walk.weight * mu.of(*kind) / (at.rate() * p)) : ray.value(0);
  }

  Value result(const Walk& walk, const RayData& ray) const { return walk.kind == EventKind::escape ? walk.weight : ray.value(0); }

  Event<Value> event(const Walk& walk, const RayData&, const Flight& at) const { return {walk.kind, at.position(), walk.weight}; }

  int real_collisions(const Walk& walk, const RayData&) const { return walk.kind != EventKind::escape; }

  Theory theory(const RayData& ray, const RayProfile& smooth, int c, Quantity) const {
    const RayProfile profile = cut_at_levels(smooth, ray.majorant, {&ray.majorant});
    std::vector<Real> rate, through, death, growth;
    for (std::size_t j = 0; j < profile.nodes(c).size(); ++j) {
      const Real mub = ray.majorant.rate(profile.nodes(c)[j].piece);
      rate.push_back(mub);
      Value extinction = ray.value(0);
      for (int l = 0; l < ray.channels; ++l) channel(extinction, l) = profile.nodes(l)[j].extinction;
      const Coefficients<Value> mu = ray.coefficients(extinction, profile.nodes(c)[j].t, mub);
      const Real p = mub > 0 ? chances(ray, mu).null : 0, mu_n = channel(mu.null, c);
      through.push_back(mub * p);
      death.push_back(mub - through.back());
      growth.push_back(p > 0 ? mu_n * mu_n / (mub * p) - mub : -mub);
    }
    return theory_of_escape_weight(profile, c, rate, through, death, growth);
  }

  /// E[w^2; collision] = int sum_k mu_k^2/(mub P_k) K dx over absorption and scattering.
  Theory weight_theory(const RayData& ray, const RayProfile& smooth, int c) const {
    const RayProfile profile = cut_at_levels(smooth, ray.majorant, {&ray.majorant});
    std::vector<Real> growth, collisions;
    for (std::size_t j = 0; j < profile.nodes(c).size(); ++j) {
      const Real mub = ray.majorant.rate(profile.nodes(c)[j].piece);
      Value extinction = ray.value(0);
      for (int l = 0; l < ray.channels; ++l) channel(extinction, l) = profile.nodes(l)[j].extinction;
      const Coefficients<Value> mu = ray.coefficients(extinction, profile.nodes(c)[j].t, mub);
      const Chances chance = mub > 0 ? chances(ray, mu) : Chances{0, 0, 0};
      const auto second = [&](EventKind kind) {
        const Real own = channel(mu.of(kind), c), p = chance.of(kind);
        return p > 0 ? own * own / (mub * p) : 0;
      };
      growth.push_back(second(EventKind::escape) - mub);
      collisions.push_back(second(EventKind::absorb) + second(EventKind::scatter));
    }
    Theory theory = this->theory(ray, smooth, c, Quantity::free_path);
    theory.variance = weight_variance(profile, c, growth, collisions);
    return theory;
  }

 private:
  struct Chances {
    Real absorb, scatter, null;  ///< of each event in all

    Real of(EventKind kind) const { return kind == EventKind::absorb ? absorb : kind == EventKind::scatter ? scatter : null; }
  };

  /// Without absorption as an event its chance goes to the others.
  Chances chances(const RayData& ray, const Coefficients<Value>& mu) const {
    if (ray.fixed && ray.three) {
      const Real a = ray.draws_absorption ? absorb : 0;
      return {a, (1 - a) * scatter, (1 - a) * (1 - scatter) * null};
    }
    Chances chance = {absorb, scatter, null};
    if (!ray.fixed) chance = {average(magnitude(mu.absorb)), average(magnitude(mu.scatter)), average(magnitude(mu.null))};
    if (!ray.draws_absorption) chance.absorb = 0;
    const Real sum = chance.absorb + chance.scatter + chance.null;
    if (!(sum > 0)) return {0, 0, 0};  // absorption, left to weights, takes all
    return {chance.absorb / sum, chance.scatter / sum, chance.null / sum};
  }

  /// Nothing where none survives.
  static std::optional<EventKind> three_roulettes(const Chances& chance, auto& rng) {
    if (rng.uniform() < chance.absorb) return EventKind::absorb;
    Real left = 1 - chance.absorb;
    if (rng.uniform() * left < chance.scatter) return EventKind::scatter;
    left -= chance.scatter;
    if (rng.uniform() * left < chance.null) return EventKind::escape;
    return std::nullopt;
  }
};

}  // namespace nullmark
