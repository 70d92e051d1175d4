#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking that states another variance than it has.  Its mean is right; a proof that rests on the variance is not.
template <class Value>
struct PlantedVariance : RatioTracking<Value> {
  static constexpr const char* kName = "planted_variance";
  static constexpr const char* kSummary = "wrong: ratio tracking that states a variance that is not its own";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "variance";

  using Base = RatioTracking<Value>;
  using Walk = typename Base::Walk;

  Real factor = 0.23;

  void parameters(ParameterVisitor& visit) {
    visit.number("factor", factor, Range::positive(), "", "stated variance over the one that it has");
  }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity quantity) const {
    Theory theory = Base::theory(ray, profile, c, quantity);
    *theory.variance *= factor;
    return theory;
  }
  static constexpr bool count_law = false;
};

/// T but for a small error, with the guarantee that every sample is exact.  Makes no lookup, as it states.
template <class Value>
struct PlantedExact {
  static constexpr const char* kName = "planted_exact";
  static constexpr const char* kSummary = "wrong: claims to be exact and is off by a little";
  static constexpr const char* kSource = "";
  static constexpr SampleRange kRange = SampleRange::any_sign;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kNeedsOpticalDepth = true;
  static constexpr const char* kCaughtBy = "mean";

  Real error = 1e-9;

  void parameters(ParameterVisitor& visit) {
    visit.number("error", error, Range::non_negative(), "", "of every sample, relative");
  }

  Guarantee claim(Quantity) const { return Guarantee::exact; }

  struct Walk {};
  void init(Walk&, const MediumRay<Value>&, Flight&, auto&) const {}
  bool propose(Walk&, const MediumRay<Value>&, Flight&, auto&) const { return false; }
  void consume(Walk&, const MediumRay<Value>&, const Flight&, const Value&, auto&) const {}
  Value result(const Walk&, const MediumRay<Value>& ray) const { return exponential(Value(-*ray.exact_depth)) * (1 + error); }

  Theory theory(const MediumRay<Value>&, const RayProfile&, int, Quantity) const { return {.lookups = 0}; }
};

}  // namespace nullmark
