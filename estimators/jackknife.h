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
    Real step = 0;
    bool stratified = false, naive = false;
  };

  void prepare(RayData& ray) const {
    ray.step = ray.length() / steps;
    ray.stratified = jitter == "stratified";
    ray.naive = mean == "naive";
  }

  struct Walk {
    Value sum, mean, squares;  ///< of the march at hand; over complete marches: Xbar and sum (X - Xbar)^2
    Real offset = 0;
    int done = 0, complete = 0;
  };

  void init(Walk& walk, const RayData& ray, Flight&, auto&) const {
    walk.sum = walk.mean = walk.squares = ray.value(0);
    walk.done = walk.complete = 0;
  }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    if (!(ray.step > 0) || walk.complete == m) return false;
    if (ray.stratified || walk.done == 0) walk.offset = rng.uniform();
    flight.jump(ray.begin + (walk.done + walk.offset) * ray.step);
    return true;
  }

  void consume(Walk& walk, const RayData& ray, const Flight&, const Value& extinction, auto&) const {
    walk.sum += extinction;
    if (++walk.done < steps) return;
    const Value x = walk.sum * ray.step, ahead = x - walk.mean;
    walk.mean += ahead / static_cast<Real>(++walk.complete);
    walk.squares += ahead * (x - walk.mean);
    walk.sum = ray.value(0);
    walk.done = 0;
  }

  Value result(const Walk& walk, const RayData& ray) const {
    Value transmittance = exponential(Value(-walk.mean));
    if (!ray.naive)
      for (int c = 0; c < ray.channels; ++c)
        channel(transmittance, c) *= jackknife_factor(m, std::sqrt(std::max<Real>(0, channel(walk.squares, c) / m)));
    return transmittance;
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
