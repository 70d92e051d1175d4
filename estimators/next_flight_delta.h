#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/survival.h"

namespace nullmark {

/// Next-flight delta tracking [Novák et al. 2018, STAR].  Variant A adds (1 - p) e^{-mub left} at EVERY tentative collision, the
/// real one included (without that last term the estimate is too low); variant B adds e^{-mub left} at null collisions only.  p =
/// mu/mub.  Both unbiased for mub >= mu, in (0, inf), Var(A) <= Var(B).  Lookups as delta tracking.  Channels share one walk and
/// one random number.
template <class Value>
struct NextFlightDeltaTracking {
  static constexpr const char* kName = "next_flight_delta";
  static constexpr const char* kSummary =
      "next-flight delta tracking: expected escape from every tentative collision until a real one";
  static constexpr const char* kSource = "Novak, Georgiev, Hanika, Jarosz 2018";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = true;
  static constexpr bool kLanes = true;

  std::string variant = "a";

  void parameters(ParameterVisitor& visit) {
    visit.choice("variant", variant, {"a", "b"},
                 "a: weight 1 - mu/mub at every tentative collision; b: weight 1 at null collisions only");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    bool weigh_all = true;  ///< variant A
  };
  void prepare(RayData& ray) const { ray.weigh_all = variant == "a"; }

  struct Walk {
    Value alive, sum;
    Truth<Value> done = false;
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto&) const {
    const Value one = ray.value(1);
    walk = {one, one * exponential(-flight.depth_left()), false};
  }

  auto propose(Walk& walk, const auto&, auto& flight, auto& rng) const { return flight.next(rng, !walk.done); }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    const Distance<Value> escape = exponential(-at.depth_left()), threshold = rng.uniform() * at.rate();
    if (ray.weigh_all) walk.sum += walk.alive * null_ratio(at, extinction) * escape;
    walk.alive = select(extinction > threshold, ray.value(0), walk.alive);
    if (!ray.weigh_all) walk.sum += walk.alive * escape;
    walk.done = vanished(walk.alive);
  }

  Value result(const Walk& walk, const auto&) const { return walk.sum; }

  auto real_collisions(const Walk& walk, const auto&) const { return walk.done; }

  /// Renewal at collisions of rate mub: with q the chance to live on, c what a collision adds, K(y) = exp(-int_0^y mub (1 - q))
  /// and I(y) = int_0^y mub c K, the sum beyond the first term has mean I(d) and second moment int mub (K c^2 + 2 c q (I(d) -
  /// I(y))) dy; in variant B c is added only by those that live on.  Holds where the majorant is violated, too: q = max(0, 1 -
  /// mu/mub), and the mean is then not T.
  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    const auto rate = [&](const RayProfile::Node& at) { return ray.majorant.rate(at.piece); };
    const auto killed = [&](int, const RayProfile::Node& at) { return std::min(at.extinction, rate(at)); };
    Theory theory;
    state_lookups_until_killed(theory, profile, killed, rate);
    if (!profile.resolved()) return theory;
    const Real total = ray.majorant.total_depth();
    const auto ahead = profile.running(c, rate);
    const auto dead = profile.running(c, [&](const RayProfile::Node& at) { return killed(c, at); });
    const std::vector<RayProfile::Node>& nodes = profile.nodes(c);
    std::vector<Real> first(nodes.size());
    bool violated = false;
    for (std::size_t j = 0; j < nodes.size(); ++j) {
      const Real mub = rate(nodes[j]), escape = std::exp(ahead[j] - total);
      violated = violated || nodes[j].extinction > mub;
      first[j] = (mub - (ray.weigh_all ? nodes[j].extinction : killed(c, nodes[j]))) * escape * std::exp(-dead[j]);
    }
    const auto sum = profile.running(first);
    std::size_t j = 0;
    const Real mean = profile.integrate(c, [&](const RayProfile::Node&) { return first[j++]; });
    j = 0;
    const Real second = profile.integrate(c, [&](const RayProfile::Node& at) {
      const std::size_t i = j++;
      const Real mub = rate(at);
      if (!(mub > 0)) return Real{0};
      const Real escape = std::exp(ahead[i] - total), live = (mub - killed(c, at)) / mub, rest = mean - sum[i];
      if (!ray.weigh_all) return mub * live * (std::exp(-dead[i]) * escape * escape + 2 * escape * rest);
      const Real adds = (mub - at.extinction) / mub * escape;
      return mub * (std::exp(-dead[i]) * adds * adds + 2 * adds * live * rest);
    });
    theory.variance = std::max<Real>(0, second - mean * mean);
    if (violated) theory.mean = std::exp(-total) + mean;
    return theory;
  }
};

}  // namespace nullmark
