#pragma once

#include "estimators/ratio.h"

namespace nullmark {

/// The average of as many ratio walks as fit a budget of lookups, the walk that crosses it included.  Each walk is unbiased,
/// their number depends on them: E[mean] - T ~ Cov(X, L)/B, with L the lookups of one walk, -T/B on a slab of tau = 1.
template <class Value>
struct PlantedBudget : RatioTracking<Value> {
  static constexpr const char* kName = "planted_budget";
  static constexpr const char* kSummary = "wrong: average of ratio walks until a budget of lookups is spent";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  /// Walks that meet nothing spend nothing; this many end the average all the same.
  static constexpr int kMostWalks = 1024;

  int budget = 64;

  void parameters(ParameterVisitor& visit) {
    visit.integer("budget", budget, 1, 1'000'000, "lookups after which no further walk begins");
  }

  struct Walk : RatioTracking<Value>::Walk {
    Value sum;
    int walks = 0, lookups = 0;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    walk.sum = ray.value(0);
    walk.walks = walk.lookups = 0;
  }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    while (!flight.next(rng)) {
      walk.sum += walk.weight;
      ++walk.walks;
      if (walk.lookups >= budget || walk.walks >= kMostWalks) return false;
      walk.weight = ray.value(1);
      flight.start(ray.majorant);
    }
    ++walk.lookups;
    return true;
  }

  Value result(const Walk& walk, const MediumRay<Value>&) const { return walk.sum / static_cast<Real>(walk.walks); }

  /// Nothing is claimed of the average's variance and cost.
  Theory theory(const MediumRay<Value>&, const RayProfile&, int, Quantity) const { return {}; }
};

}  // namespace nullmark
