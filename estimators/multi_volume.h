#pragma once

#include "estimators/delta.h"

namespace nullmark {

/// Delta tracking through a sum of media mu = sum mu_i, mub = sum mub_i, that evaluates one component a collision: picked with
/// mub_i/mub and accepted with mu_i/mub_i, so that the chance of a real collision is mu/mub [Galtier et al. 2013; Kutz et al.
/// 2017, Sec. 2].  Law, variance and number of lookups are delta tracking's; each lookup is of one component.  Each component's
/// bound takes its share of the segment's majorant.  Grey media.
template <class Value>
struct MultiVolumeTracking : DeltaTracking<Value> {
  static constexpr const char* kName = "multi_volume";
  static constexpr const char* kSummary = "delta tracking through a sum of media; each collision looks up one component";
  static constexpr const char* kSource = "Galtier et al. 2013; Kutz, Habel, Li, Novak 2017, Sec. 2";
  static constexpr bool kNeedsShares = true;
  static constexpr bool kLanes = false;
  static constexpr bool kGreyOnly = true;

  using Base = DeltaTracking<Value>;
  using RayData = typename Base::RayData;

  void parameters(ParameterVisitor&) {}

  struct Walk : Base::Walk {
    int picked = 0;
  };

  void init(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    Base::init(walk, ray, flight, rng);
    walk.picked = 0;
  }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    if (!Base::propose(walk, ray, flight, rng)) return false;
    const Spectrum& share = ray.shares[flight.piece()];
    walk.picked = 0;
    if (share.size() == 1) return true;
    Real left = rng.uniform();
    for (int last = static_cast<int>(share.size()) - 1; walk.picked < last && !(left < share[walk.picked]); ++walk.picked)
      left -= share[walk.picked];
    while (!(share[walk.picked] > 0)) --walk.picked;  // rounding left a remainder beyond the last that has a share
    return true;
  }

  int component(const Walk& walk) const { return walk.picked; }
};

}  // namespace nullmark
