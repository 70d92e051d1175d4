#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/guided_theory.h"

namespace nullmark {

/// Majorant-guided ratio tracking [Misso, Li, Burley, Teece, Jarosz 2023]: the next flight has the rate of null collisions at the
/// last lookup, m = max(mub - mu, .1 mub), and the weight makes up for it.  In majorant depth s, where local bounds are 1 and q =
/// m/mub, with T(s) = e^{-(M - s)} + int_s^M e^{-(z - s)} (1 - mu/mub)(z) T(z) dz sampled by q e^{-q (z - s)}:
///
///   W *= (1 - mu/mub)/q e^{(q - 1) ds} at a collision, e^{(q - 1)(M - s)} at the end, q = max(1 - mu/mub, .1) from there on.
///
/// The first q is 1 or, with `start` = lookup, that of the ray's begin at one more lookup; it then has no variance on constant
/// extinction with mub - mu >= .1 mub.  Unbiased for any rate.  Where mub bounds mu every (1 - mu/mub)/q of a collision and the q
/// chosen there is at most 1: samples are in [0, 1], or in [0, 10] when the start is looked up.  Several channels fly at the q of
/// the thinnest, so that this holds for each.  Variance and lookups solve Volterra equations in s (see guided_moments).
template <class Value>
struct MajorantGuidedRatio {
  static constexpr const char* kName = "majorant_guided_ratio";
  static constexpr const char* kSummary =
      "majorant-guided ratio tracking: each flight uses the null-collision rate of the last lookup";
  static constexpr const char* kSource = "Misso, Li, Burley, Teece, Jarosz 2023, Sec. 5";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kOwnFlights = true;
  static constexpr bool kDrawsExponentials = true;
  static constexpr bool kLanes = true;

  std::string start = "majorant";

  void parameters(ParameterVisitor& visit) {
    visit.choice("start", start, {"majorant", "lookup"},
                 "rate of the first flight: the majorant, or as looked up where the ray begins");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  SampleRange range() const { return start == "lookup" ? SampleRange::non_negative : kRange; }

  struct Walk {
    Value weight;
    Distance<Value> rate;     ///< q
    Truth<Value> has_looked;  ///< that the ray's begin has been looked up, or need not be: of all walks in lanes or of none
  };

  void init(Walk& walk, const auto& ray, auto&, auto&) const { walk = {ray.value(1), 1, start == "majorant"}; }

  auto propose(Walk& walk, const auto&, auto& flight, auto& rng) const {
    if (!none(!walk.has_looked)) return flight.advance_to(0);
    const Distance<Value> before = flight.depth();
    const auto inside = flight.advance_to(before + rng.exponential() / walk.rate);
    walk.weight *= exponential((walk.rate - 1) * (smaller(flight.depth(), flight.total_depth()) - before));
    return inside;
  }

  void consume(Walk& walk, const auto&, const auto& at, const Value& extinction, auto&) const {
    if (none(!walk.has_looked)) walk.weight *= null_ratio(at, extinction) / walk.rate;
    walk.rate = larger(kLeastRate, null_ratio(at, smallest(extinction)));
    walk.has_looked = true;
  }

  Value result(const Walk& walk, const auto&) const { return walk.weight; }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    return guided_moments(ray.majorant, profile, c, kLeastRate, start == "lookup");
  }

  static constexpr Real kLeastRate = 0.1;
};

}  // namespace nullmark
