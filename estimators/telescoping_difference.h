#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/debiased_theory.h"

namespace nullmark {

/// One difference of Telescoping's series alone, D_n with K = 2^{n+1} lookups [Misso, Bitterli, Georgiev, Jarosz 2022, Fig. 7]: a
/// march of K steps less one of K/2 steps, each with a uniform offset,
///
///   correlated    both from the same lookups, the coarse one averaged over its two sets: e^{-(E+O)/2} - (e^{-E} + e^{-O})/2
///   independent   each with lookups of its own, K + K/2
///
/// Estimates no transmittance; its variance says how fast a debiased series of such marches converges.
template <class Value>
struct TelescopingDifference {
  static constexpr const char* kName = "telescoping_difference";
  static constexpr const char* kSummary = "one difference of the telescoping series of marches, alone (no transmittance)";
  static constexpr const char* kSource = "Misso, Bitterli, Georgiev, Jarosz 2022, Sec. 5";
  static constexpr SampleRange kRange = SampleRange::any_sign;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kGreyOnly = true;
  static constexpr bool kLanes = true;

  int level = 0;
  std::string marches = "correlated";

  void parameters(ParameterVisitor& visit) {
    visit.integer("level", level, 0, 20, "n; the finer march has 2^{n+1} steps");
    visit.choice("marches", marches, {"correlated", "independent"}, "both from the same lookups, or each with its own");
  }

  Guarantee claim(Quantity) const { return Guarantee::biased; }

  struct RayData : MediumRay<Value> {
    Real steps = 2;  ///< of the finer march
    bool correlated = true;
  };

  void prepare(RayData& ray) const {
    ray.steps = std::exp2(level + 1);
    ray.correlated = marches == "correlated";
  }

  struct Walk {
    Value first, second;  ///< sums of mu: over even and odd lookups, or of the finer and the coarser march
    Distance<Value> offset;
  };

  void init(Walk& walk, const auto& ray, auto&, auto& rng) const { walk = {ray.value(0), ray.value(0), rng.uniform()}; }

  bool propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    const Real done = flight.lookups(), fine = ray.steps, all = ray.correlated ? fine : 1.5 * fine;
    if (!(ray.length() > 0) || done == all) return false;
    if (done == fine) walk.offset = rng.uniform();
    const Distance<Value> at = done < fine ? (walk.offset + done) / fine : (walk.offset + (done - fine)) / (fine / 2);
    flight.jump(ray.begin + at * ray.length());
    return true;
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto&) const {
    const bool to_first = ray.correlated ? at.lookups() % 2 == 1 : at.lookups() <= ray.steps;
    (to_first ? walk.first : walk.second) += extinction;
  }

  Value result(const Walk& walk, const auto& ray) const {
    const Real coarse = ray.length() / (ray.steps / 2), fine = ray.length() / ray.steps;
    if (ray.correlated) return march_difference(Value(walk.first * coarse), Value(walk.second * coarse));
    return exponential(Value(-walk.first * fine)) - exponential(Value(-walk.second * coarse));
  }
};

}  // namespace nullmark
