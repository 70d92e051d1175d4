#pragma once

#include <cstdint>
#include <type_traits>

#include "estimators/estimator.h"
#include "estimators/mis_vertices.h"
#include "estimators/walk/rng.h"

namespace nullmark {

/// Bidirectional MIS [Georgiev et al. 2019]: two independent ratio-tracking walks, one from each end of the ray; every vertex of
/// the one that lies before one of the other is joined to it across the gap between them, and both walks count where they get
/// through.  Written in majorant depth, where every ray has rate 1 and vertices carry the products A_i, B_j of null ratios, a
/// technique that leaves out gap g has a probability e^g times that of a whole walk, so the balance heuristic is
///
///   S = sum_{b_j > a_i} A_i B_j / (2 + e^{b_j - a_i} + sum_q e^q) + sum_{whole walks} W / (2 + sum_q e^q),
///
/// q over the gaps within the walks joined.  Unbiased for any rate; (0, inf) where the majorant bounds.  Lookups 2 int mub.  No
/// second moment is known.  Flights are carried across cells.
template <class Value>
struct BidirectionalMis {
  static constexpr const char* kName = "mis_bidirectional";
  static constexpr const char* kSummary = "ratio tracking from both ends, all pairs of vertices joined";
  static constexpr const char* kSource = "Georgiev et al. 2019, bidirectional MIS";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kOwnFlights = true;
  static constexpr bool kDrawsExponentials = true;
  static constexpr bool kLanes = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  /// A walk of one sample keeps its vertices.  In lanes a walk holds the vertex that it has come to, and the kernel has the
  /// vertices of each sample beside.
  using Kept = MisVertices<OneSample<Value>>;
  struct AtVertex {
    Value weight;            ///< product of null ratios up to the vertex, its own included
    Distance<Value> nearer;  ///< e^-gap to the vertex before
    Truth<Value> backward;
  };
  using Walk = std::conditional_t<kSideBySide<Value>, AtVertex, Kept>;

  void begin(Kept& walk, const auto& ray) const { walk.start(ray.value(1)); }

  void init(Kept& walk, const auto& ray, auto&, auto&) const { begin(walk, ray); }

  bool propose(Kept& walk, const auto& ray, auto& flight, auto& rng) const {
    const Real total = ray.majorant.total_depth();
    if (!walk.has_turned()) {
      const auto [e, nearer] = exponential_and_decay(rng);
      const Real depth = walk.depth() + e;
      if (depth < total) {
        walk.add({depth, nearer, {}});
        return flight.advance_to(depth);
      }
      turn(walk, ray);
    }
    const auto [e, nearer] = exponential_and_decay(rng);
    const Real depth = walk.depth() - e;
    if (!(depth > 0) || !(depth < total)) {
      finish(walk, ray);
      return false;
    }
    walk.add({depth, nearer, {}});
    return flight.travel_to(depth);
  }

  void consume(Kept& walk, const auto&, const auto& at, const Value& extinction, auto&) const {
    walk.weigh(null_ratio(at, extinction));
  }

  void init(AtVertex& walk, const auto&, auto&, auto&) const { walk = {Value(1), Distance<Value>(kInfinity), false}; }

  auto propose(AtVertex& walk, const auto&, auto& flight, auto& rng) const {
    const Distance<Value> total = flight.total_depth();
    const auto drawn = rng.exponential_and_decay();
    walk.nearer = drawn.decay;
    Distance<Value> depth = flight.depth() + select(walk.backward, -drawn.exponential, drawn.exponential);
    if (const auto turns = (!walk.backward) & !(depth < total); !none(turns)) {
      const auto anew = rng.exponential_and_decay(turns);
      depth = select(turns, total - anew.exponential, depth);
      walk.nearer = select(turns, anew.decay, walk.nearer);
      walk.weight = select(turns, Value(1), walk.weight);
      walk.backward = walk.backward | turns;
    }
    return flight.travel_to(depth, (depth < total) & ((!walk.backward) | (Distance<Value>(0) < depth)));
  }

  void consume(AtVertex& walk, const auto&, const auto& at, const Value& extinction, auto&) const {
    walk.weight *= null_ratio(at, extinction);
  }

  /// Hands the vertices that walks in lanes have come to over to `kept(lane)`.
  void keep(const AtVertex& walk, const auto& ray, const auto& at, auto alive, const auto& kept) const {
    const auto depth = numbers(at.depth()), nearer = numbers(walk.nearer);
    const auto weight = numbers(walk.weight);
    const std::uint64_t lives = as_bits(alive), backward = as_bits(walk.backward);
    for (std::size_t k = 0; k < depth.size(); ++k) {
      if ((lives >> k & 1) == 0) continue;
      Kept& vertices = kept(k);
      if ((backward >> k & 1) != 0) turn(vertices, ray);
      vertices.add({depth[k], nearer[k], weight[k]});
    }
  }

  /// Ends a walk.
  void finish(Kept& walk, const auto& ray) const {
    turn(walk, ray);
    walk.join(ray.channels);
  }

  OneSample<Value> result(const Kept& walk, const auto&) const { return walk.joined() + walk.alone(); }

  Theory theory(const auto& ray, const RayProfile&, int, Quantity) const {
    const Real lookups = 2 * ray.majorant.total_depth();
    return {.lookups = lookups, .lookups_variance = lookups};
  }

 private:
  /// Begins the backward walk, unless it has begun.
  static void turn(Kept& walk, const auto& ray) {
    if (!walk.has_turned()) walk.turn(ray.majorant.total_depth(), ray.value(1));
  }
};

}  // namespace nullmark
