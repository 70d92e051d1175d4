#pragma once

#include "estimators/analog_decomposition.h"

namespace nullmark {

/// Analog decomposition tracking as a published listing has it: the residual's path is drawn anew from the start after every null
/// collision, where it should go on.  Its free paths are too short (mean .318 for .480 on mu = 2 + cos(2 pi x), mu_c = 1, mub =
/// 3) and its lookups too many.  Biased by the listing; registered to show by how much.  Grey media.
template <class Value>
struct PublishedDecompositionTracking : AnalogDecompositionTracking<Value> {
  using Base = AnalogDecompositionTracking<Value>;
  using typename Base::RayData, typename Base::Walk;

  static constexpr const char* kName = "analog_decomposition_published_reset";
  static constexpr const char* kSummary =
      "decomposition tracking as published in a listing: its residual path restarts at null collisions (biased)";
  static constexpr const char* kSource = "Kutz, Habel, Li, Novak 2017, Sec. 4.1, as a set of notes lists it";
  static constexpr bool kNeedsBound = false;
  static constexpr bool kLanes = false;

  Guarantee claim(Quantity) const { return Guarantee::biased; }

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    flight.start(ray.residual);
    return Base::propose(walk, ray, flight, rng);
  }

  Theory theory(const RayData&, const RayProfile&, int, Quantity) const { return {}; }
};

}  // namespace nullmark
