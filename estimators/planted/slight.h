#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking times 1.003: a bias of .3 epsilon where epsilon is 1 % of T.  Everything else that it states is right.
template <class Value>
struct PlantedSlight : RatioTracking<Value> {
  static constexpr const char* kName = "planted_slight";
  static constexpr const char* kSummary = "wrong: ratio tracking that is 0.3 % too bright";
  static constexpr const char* kSource = "";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr const char* kCaughtBy = "mean";

  static constexpr Real kFactor = 1.003;

  using Base = RatioTracking<Value>;
  using Walk = typename Base::Walk;

  Value result(const Walk& walk, const auto&) const { return walk.weight * kFactor; }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity quantity) const {
    Theory theory = Base::theory(ray, profile, c, quantity);
    *theory.variance *= kFactor * kFactor;
    return theory;
  }

  CountLaw count_law(const MediumRay<Value>& ray, const RayProfile& profile, int c) const {
    CountLaw law = Base::count_law(ray, profile, c);
    law.factor = kFactor;
    return law;
  }
};

}  // namespace nullmark
