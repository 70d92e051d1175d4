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
    Real offset = 0, done = 0;
  };

  void init(Walk& walk, const RayData& ray, Flight&, auto& rng) const { walk = {ray.value(0), ray.value(0), rng.uniform(), 0}; }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    const Real fine = ray.steps, all = ray.correlated ? fine : 1.5 * fine;
    if (!(ray.length() > 0) || walk.done == all) return false;
    if (walk.done == fine) walk.offset = rng.uniform();
    const Real at = walk.done < fine ? (walk.offset + walk.done) / fine : (walk.offset + walk.done - fine) / (fine / 2);
    flight.jump(ray.begin + at * ray.length());
    return true;
  }

  void consume(Walk& walk, const RayData& ray, const Flight&, const Value& extinction, auto&) const {
    const bool to_first = ray.correlated ? std::fmod(walk.done, 2) == 0 : walk.done < ray.steps;
    (to_first ? walk.first : walk.second) += extinction;
    ++walk.done;
  }

  Value result(const Walk& walk, const RayData& ray) const {
    Value difference = ray.value(0);
    const Real coarse = ray.length() / (ray.steps / 2), fine = ray.length() / ray.steps;
    for (int c = 0; c < ray.channels; ++c) {
      const Real first = channel(walk.first, c), second = channel(walk.second, c);
      channel(difference, c) = ray.correlated ? march_difference(first * coarse, second * coarse)
                                              : std::exp(-first * fine) - std::exp(-second * coarse);
    }
    return difference;
  }
};

}  // namespace nullmark
