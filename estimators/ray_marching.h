#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/march_theory.h"

namespace nullmark {

/// Ray marching with k = `steps` lookups at x_j = (j + o_j) h, h = d/k: tau = h sum_j mu(x_j), T = exp(-tau) [Perlin and Hoffert
/// 1989; Pauly, Kollig, Keller 2000 for the stratified form].  Offsets: left 0, midpoint 1/2, right 1 (the seed's), uniform one u
/// for all steps, stratified a fresh u for each.  The jittered forms are unbiased for tau; all are consistent for T, with bias T
/// Var(tau)/2 at first order.
template <class Value>
struct RayMarching {
  static constexpr const char* kName = "ray_marching";
  static constexpr const char* kSummary = "ray marching with fixed, uniformly jittered or stratified offsets";
  static constexpr const char* kSource = "Perlin and Hoffert 1989; Pauly, Kollig, Keller 2000";
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kLanes = true;

  int steps = 32;
  std::string offset = "midpoint";

  void parameters(ParameterVisitor& visit) {
    visit.integer("steps", steps, 1, 10'000'000, "lookups per sample, k");
    visit.choice("offset", offset, {"left", "midpoint", "right", "uniform", "stratified"},
                 "where in its step a lookup lies: fixed, one random offset for all steps, or one for each");
  }

  bool jittered() const { return offset == "uniform" || offset == "stratified"; }

  Guarantee claim(Quantity quantity) const {
    return quantity == Quantity::optical_depth && jittered() ? Guarantee::unbiased : Guarantee::consistent;
  }

  /// |bias| ~ h^order on smooth media; a jittered march is biased for T by T Var(tau)/2, and Var(tau) is of order h^2 and h^3.
  Real order(Quantity) const {
    if (offset == "stratified") return 3;
    return offset == "midpoint" || offset == "uniform" ? 2 : 1;
  }

  struct RayData : MediumRay<Value> {
    std::uint32_t steps = 0;
    Real step = 0, fixed = 0;
    bool uniform = false, stratified = false;
  };

  void prepare(RayData& ray) const {
    ray.steps = static_cast<std::uint32_t>(steps);
    ray.step = ray.length() / steps;
    ray.fixed = offset == "left" ? 0 : offset == "right" ? 1 : 0.5;
    ray.uniform = offset == "uniform";
    ray.stratified = offset == "stratified";
  }

  struct Walk {
    Value sum;
    Distance<Value> offset = 0;
  };

  void init(Walk& walk, const auto& ray, auto&, auto& rng) const {
    walk = {ray.value(0), ray.fixed};
    if (ray.uniform) walk.offset = rng.uniform();
  }

  bool propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    if (!(ray.step > 0) || flight.lookups() == ray.steps) return false;
    if (ray.stratified) walk.offset = rng.uniform();
    flight.jump(ray.begin + (flight.lookups() + walk.offset) * ray.step);
    return true;
  }

  void consume(Walk& walk, const auto&, const auto&, const Value& extinction, auto&) const { walk.sum += extinction; }

  Value optical_depth(const Walk& walk, const auto& ray) const { return walk.sum * ray.step; }
  Value result(const Walk& walk, const auto& ray) const { return exponential(Value(-walk.sum * ray.step)); }

  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity quantity) const {
    if (!(ray.step > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    Theory theory = ray.stratified ? stratified_march(profile, c, steps, quantity)
                    : ray.uniform  ? uniform_march(profile, c, steps, quantity)
                                   : fixed_march(profile, c, steps, ray.fixed, quantity);
    theory.lookups = steps;
    theory.lookups_variance = 0;
    return theory;
  }
};

}  // namespace nullmark
