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
  static constexpr bool kLanes = true;

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
    if (probabilities != "fixed") {
      const NullCollisionTracking usual;
      if (absorb != usual.absorb || scatter != usual.scatter || null != usual.null)
        throw ParameterError("probabilities",
                             "found chances of events, which \"proportional\" does not use; expected \"fixed\", or no chances");
      return;
    }
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

  using Number = Distance<Value>;

  struct Walk {
    Value weight;
    EventChoice<Truth<Value>> end;
  };

  void init(Walk& walk, const auto& ray, auto&, auto&) const { walk = {ray.value(1), {}}; }

  auto propose(Walk& walk, const auto&, auto& flight, auto& rng) const { return flight.next(rng, !walk.end.ends()); }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    const Coefficients<Value> mu = ray.coefficients(extinction, at.position(), at.rate());
    const Chances chance = chances(ray, mu);
    const Number u = rng.uniform();
    auto lost = u < Number(0);  // no walk is lost yet
    walk.end = ray.three ? three_roulettes(chance, u, rng, lost) : choose_event(u, chance.absorb, chance.scatter, chance.null);
    const Number p = select(lost, Number(0), walk.end.of(chance.absorb, chance.scatter, chance.null));
    walk.weight = select(p > Number(0), Value(walk.weight * mu.of(walk.end) / (at.rate() * p)), Value(ray.value(0)));
  }

  Value result(const Walk& walk, const auto& ray) const { return select(walk.end.ends(), Value(ray.value(0)), walk.weight); }

  Event<Value> event(const Walk& walk, const RayData&, const Flight& at) const {
    return {walk.end.kind, at.position(), walk.weight};
  }

  auto real_collisions(const Walk& walk, const auto&) const { return walk.end.ends(); }

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
      const auto second = [&](const Value& coefficient, Real p) {
        const Real own = channel(coefficient, c);
        return p > 0 ? own * own / (mub * p) : 0;
      };
      growth.push_back(second(mu.null, chance.null) - mub);
      collisions.push_back(second(mu.absorb, chance.absorb) + second(mu.scatter, chance.scatter));
    }
    Theory theory = this->theory(ray, smooth, c, Quantity::free_path);
    theory.variance = weight_variance(profile, c, growth, collisions);
    return theory;
  }

 private:
  struct Chances {
    Number absorb, scatter, null;  ///< of each event in all
  };

  /// Without absorption as an event its chance goes to the others.
  Chances chances(const auto& ray, const Coefficients<Value>& mu) const {
    const Real a = ray.draws_absorption ? absorb : 0;
    if (ray.fixed && ray.three) return {a, (1 - a) * scatter, (1 - a) * (1 - scatter) * null};
    Chances chance = {a, scatter, null};
    if (!ray.fixed) {
      chance = {average(magnitude(mu.absorb)), average(magnitude(mu.scatter)), average(magnitude(mu.null))};
      if (!ray.draws_absorption) chance.absorb = 0;
    }
    const Number sum = chance.absorb + chance.scatter + chance.null;
    const auto any = sum > Number(0);  // else absorption, left to weights, takes all
    const auto share = [&](const Number& own) { return select(any, Number(own / sum), Number(0)); };
    return {share(chance.absorb), share(chance.scatter), share(chance.null)};
  }

  /// `u` is the first of their random numbers.  A walk that survives none is lost: it ends, as if absorbed.
  static auto three_roulettes(const Chances& chance, const Number& u, auto& rng, auto& lost) {
    const auto absorbs = u < chance.absorb;
    Number left = 1 - chance.absorb;
    const auto scatters = (rng.uniform_where(!absorbs) * left < chance.scatter) & !absorbs;
    left = left - chance.scatter;
    const auto neither = !(absorbs | scatters);
    lost = neither & !(rng.uniform_where(neither) * left < chance.null);
    return EventChoice<Truth<Value>>::from(absorbs | lost, scatters);
  }
};

}  // namespace nullmark
