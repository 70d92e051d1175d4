#pragma once

#include "estimators/delta.h"
#include "estimators/ratio.h"

namespace nullmark {

/// Ratio tracking that leaves a traversal one cell too early: the loop runs while a next cell exists.  Mean T exp(tau of the last
/// segment).
template <class Value>
struct PlantedLastSegment : RatioTracking<Value> {
  static constexpr const char* kName = "planted_last_segment";
  static constexpr const char* kSummary = "wrong: ratio tracking that skips the last segment";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Walk = typename RatioTracking<Value>::Walk;

  bool propose(Walk&, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    return flight.next(rng) && flight.piece() + 1 < ray.majorant.size();
  }
};

/// Ratio tracking that steps to the next cell before it uses the first one.  Mean T exp(tau of the first segment).
template <class Value>
struct PlantedFirstSegment : RatioTracking<Value> {
  static constexpr const char* kName = "planted_first_segment";
  static constexpr const char* kSummary = "wrong: ratio tracking that skips the first segment";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Walk = typename RatioTracking<Value>::Walk;

  bool propose(Walk&, const MediumRay<Value>&, Flight& flight, auto& rng) const {
    while (flight.next(rng))
      if (flight.piece() > 0) return true;
    return false;
  }
};

/// Delta tracking through cells that looks for the surface at the ray's end before it looks for the cell's: a flight that
/// overshoots both ends at the surface, although the cells in between were never sampled.  The order of a published kd-tree
/// traversal.
template <class Value>
struct PlantedEarlySurface : DeltaTracking<Value> {
  static constexpr const char* kName = "planted_early_surface";
  static constexpr const char* kSummary = "wrong: delta tracking that meets the surface beyond its cell's end";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using RayData = typename DeltaTracking<Value>::RayData;
  using Walk = typename DeltaTracking<Value>::Walk;

  bool propose(Walk& walk, const RayData& ray, Flight& flight, auto& rng) const {
    while (!walk.done && flight.piece() < ray.majorant.size()) {
      const std::size_t cell = flight.piece();
      const Real exponential = rng.exponential();
      if (flight.position() + exponential / ray.majorant.rate(cell) >= ray.end) return flight.advance_to(kInfinity);
      const Real depth = flight.depth() + exponential;
      if (depth < ray.majorant.depth_after(cell)) return flight.advance_to(depth);
      flight.advance_to(ray.majorant.depth_after(cell));
    }
    return false;
  }
};

/// Ratio tracking that draws a new flight for each cell it enters, as the exponential's lack of memory allows, but starts it at
/// the last collision instead of at the cell's boundary.  A flight that left its cell gets another chance to end in it: too many
/// collisions, mean below T.
template <class Value>
struct PlantedNoRewind : RatioTracking<Value> {
  static constexpr const char* kName = "planted_no_rewind";
  static constexpr const char* kSummary = "wrong: ratio tracking that redraws its flight at a cell boundary without moving there";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "count_law";

  struct Walk : RatioTracking<Value>::Walk {
    std::size_t cell = 0;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    RatioTracking<Value>::init(walk, ray, flight, rng);
    walk.cell = 0;
  }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    for (; walk.cell < ray.majorant.size(); ++walk.cell) {
      const Real depth = flight.depth() + rng.exponential();
      if (depth < ray.majorant.depth_after(walk.cell)) return flight.advance_to(depth);
    }
    return false;
  }
};

/// Ratio tracking that carries the rest of a flight into the next cell as a distance, drawn at the rate of the cell it left,
/// instead of as a depth.  Too few collisions where rates rise along the ray.
template <class Value>
struct PlantedCarriedDistance : RatioTracking<Value> {
  static constexpr const char* kName = "planted_carried_distance";
  static constexpr const char* kSummary = "wrong: ratio tracking whose flights keep their length across cell boundaries";
  static constexpr const char* kSource = "";
  static constexpr const char* kCaughtBy = "mean";

  using Walk = typename RatioTracking<Value>::Walk;

  bool propose(Walk&, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    const Rates& rates = ray.majorant;
    if (rates.size() == 0) return false;
    const Real position = flight.position() + rng.exponential() / flight.rate();
    std::size_t cell = flight.piece();
    while (cell < rates.size() && !(position < rates.end(cell))) ++cell;
    if (cell == rates.size()) return flight.advance_to(rates.total_depth());
    return flight.advance_to(rates.depth_after(cell) - rates.rate(cell) * (rates.end(cell) - position));
  }
};

}  // namespace nullmark
