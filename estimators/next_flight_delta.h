#pragma once

#include "estimators/next_flight.h"
#include "estimators/survival.h"

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

  std::string variant = "a";

  void parameters(ParameterVisitor& visit) {
    visit.choice("variant", variant, {"a", "b"},
                 "a: weight 1 - mu/mub at every tentative collision; b: weight 1 at null collisions only");
  }

  Claim claim(Quantity) const { return Claim::unbiased; }

  struct Ray : Passage<Value> {
    bool weigh_all = true;  ///< variant A
  };
  void prepare(Ray& ray) const { ray.weigh_all = variant == "a"; }

  struct Walk {
    Value alive, sum;
    bool done = false;
  };

  void init(Walk& walk, const Ray& ray, Flight& flight, auto&) const {
    walk = {ray.value(1), ray.value(std::exp(-flight.depth_left())), false};
  }

  bool propose(Walk& walk, const Ray&, Flight& flight, auto& rng) const { return !walk.done && flight.next(rng); }

  void consume(Walk& walk, const Ray& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Real escape = std::exp(-at.depth_left()), threshold = rng.uniform() * at.rate();
    bool any = false;
    for (int c = 0; c < ray.channels; ++c) {
      Real& alive = channel(walk.alive, c);
      const Real mu = channel(extinction, c);
      if (ray.weigh_all) channel(walk.sum, c) += alive * ((at.rate() - mu) / at.rate()) * escape;
      if (threshold < mu) alive = 0;
      if (!ray.weigh_all) channel(walk.sum, c) += alive * escape;
      any = any || alive > 0;
    }
    walk.done = !any;
  }

  Value result(const Walk& walk, const Ray&) const { return walk.sum; }

  int real_collisions(const Walk& walk, const Ray&) const { return walk.done; }

  Theory theory(const Ray& ray, const RayProfile& profile, int c, Quantity) const {
    return {.variance = next_flight_variance(
                ray.majorant, profile, c, [&](Real a) { return ray.weigh_all ? a * a : a; }, [](Real mu, Real) { return mu; }),
            .lookups = lookups_until_killed(
                profile, [](int, const RayProfile::Node& at) { return at.extinction; },
                [&](const RayProfile::Node& at) { return ray.majorant.rate(at.piece); })};
  }
};

}  // namespace nullmark
