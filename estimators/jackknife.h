#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/debiased_theory.h"

namespace nullmark {

/// Transmittance from m independent jittered marches X_i of tau, with `steps` lookups each [Peters 2025; Gray et al. 1973]:
/// their mean Xbar and S^2 = mean X^2 - Xbar^2 give
///
///   jackknife   Gamma(nu + 1) (2/S)^nu J_nu(S) e^{-Xbar}, nu = (m - 3)/2: cos S, J_0(S), sin S/S for m = 2, 3, 4
///   naive       e^{-Xbar}; with m = 1 it is ray marching
///
/// The jackknife is the best unbiased estimator of normal X; of others its bias starts at the third cumulant, T k_3/12 for m = 2,
/// where e^{-Xbar} is off by T k_2/(2m).  On smooth media that is of order h^6 (stratified; a stratum's extinction is skew at
/// second order) and h^4 (uniform) in place of h^3 and h^2.  Negative where S passes a zero of J_nu, never below -1 or above 1.
/// Lookups m `steps`.
template <class Value>
struct Jackknife {
  static constexpr const char* kName = "jackknife";
  static constexpr const char* kSummary = "jackknife transmittance of a few jittered marches, or the exponential of their mean";
  static constexpr const char* kSource = "Peters 2025; Gray, Watkins, Schucany 1973";
  static constexpr SampleRange kRange = SampleRange::any_sign;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kLanes = true;

  int m = 2, steps = 10;
  std::string jitter = "stratified", mean = "jackknife";

  void parameters(ParameterVisitor& visit) {
    visit.integer("m", m, 2, 4, "marches per sample");
    visit.integer("steps", steps, 1, 10'000'000, "lookups per march");
    visit.choice("jitter", jitter, {"stratified", "uniform"}, "a random offset in each step, or one for all steps of a march");
    visit.choice("mean", mean, {"jackknife", "naive"}, "jackknife transmittance, or e^{-mean}");
  }

  Guarantee claim(Quantity) const { return Guarantee::consistent; }

  SampleRange range() const { return mean == "naive" ? SampleRange::unit : kRange; }

  Real order(Quantity) const {
    const bool each = jitter == "stratified";
    if (mean == "naive") return each ? 3 : 2;
    return each ? 6 : 4;
  }

  struct RayData : MediumRay<Value> {
    std::uint32_t steps = 1, lookups = 0;  ///< of a march, of a sample
    Real step = 0;
    bool stratified = false, naive = false;
  };

  void prepare(RayData& ray) const {
    ray.steps = static_cast<std::uint32_t>(steps);
    ray.lookups = ray.length() > 0 ? static_cast<std::uint32_t>(m) * ray.steps : 0;
    ray.step = ray.length() / steps;
    ray.stratified = jitter == "stratified";
    ray.naive = mean == "naive";
  }

  struct Marches {
    Value mean, squares;  ///< Xbar and sum (X - Xbar)^2
  };
  struct Walk {
    Value sum;  ///< of the march at hand
    Distance<Value> offset;
    Marches complete;
  };

  void init(Walk& walk, const auto& ray, auto&, auto&) const { walk = {ray.value(0), 0, {ray.value(0), ray.value(0)}}; }

  bool propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    if (flight.lookups() == ray.lookups) return false;
    const std::uint32_t j = flight.lookups() % ray.steps;
    if (ray.stratified || j == 0) walk.offset = rng.uniform();
    flight.jump(ray.begin + (j + walk.offset) * ray.step);
    return true;
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto&) const {
    walk.sum += extinction;
    if (!completes(ray, at.lookups())) return;
    Marches& marches = walk.complete;
    const Value x = walk.sum * ray.step, ahead = x - marches.mean;
    marches.mean += ahead / static_cast<Real>(at.lookups() / ray.steps);
    marches.squares += ahead * (x - marches.mean);
    walk.sum = ray.value(0);
  }

  bool completes(const auto& ray, std::uint32_t lookups) const { return lookups % ray.steps == 0; }

  Value result(const Walk& walk, const auto& ray) const {
    const Value naive = exponential(Value(-walk.complete.mean));
    if (ray.naive) return naive;
    const Value deviation = signed_root(Value(larger(Value(walk.complete.squares / m), 0)));
    if (m == 2) return naive * cosine(Value(smaller(deviation, 30000)));  // Xbar is no less, and e^{-Xbar} is 0 beyond
    return naive * one_by_one(deviation, [this](Real s) { return jackknife_factor(m, s); });
  }

  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    if (!(ray.step > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    Theory theory = jackknife_march(profile, c, m, steps, ray.stratified, ray.naive);
    theory.lookups = m * static_cast<Real>(steps);
    theory.lookups_variance = 0;
    return theory;
  }
};

}  // namespace nullmark
