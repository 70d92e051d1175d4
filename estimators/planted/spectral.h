#pragma once

#include "estimators/hero_wavelength.h"
#include "estimators/spectral.h"

namespace nullmark {

/// Spectral tracking by the maximum whose probabilities are not normalised: events are chosen by R_k/mub, which sum to more than
/// 1, and weighed by mu_k/R_k.  The last event, null, comes short.
template <class Value>
struct PlantedSpectralSum : SpectralTracking<Value> {
  static constexpr const char* kName = "planted_spectral_sum";
  static constexpr const char* kSummary = "wrong: spectral tracking with probabilities that sum to more than 1";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = SpectralTracking<Value>;
  using RayData = typename Base::RayData;
  using Walk = typename Base::Walk;

  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Coefficients<Value> mu(extinction, ray.albedo, at.rate());
    const Real u = rng.uniform() * at.rate(), absorb = largest(mu.absorb), scatter = largest(mu.scatter);
    walk.end = EventChoice<bool>::from(u < absorb, u < absorb + scatter);
    walk.looked_up = walk.end.ends();
    walk.weight *= mu.of(walk.end) / largest(mu.of(walk.end));
  }
};

/// Hero wavelength tracking that balances every collision by itself, mu_l/avg mu, though the hero stays the same for the whole
/// walk: the heuristic without the walk's history.
template <class Value>
struct PlantedHeroHistory : HeroWavelengthTracking<Value> {
  static constexpr const char* kName = "planted_hero_history";
  static constexpr const char* kSummary = "wrong: hero wavelength tracking that balances each collision by itself";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Base = HeroWavelengthTracking<Value>;
  using Walk = typename Base::Walk;

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto& rng) const {
    walk.chance = ray.value(1);
    Base::consume(walk, ray, at, extinction, rng);
  }
};

}  // namespace nullmark
