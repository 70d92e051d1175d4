#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "estimators/estimator.h"
#include "estimators/walk/rng.h"
#include "media/base/lanes.h"

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

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  /// One of both walks: a vertex for its origin and for each collision.
  struct Vertex {
    Real depth;    ///< majorant depth from the ray's begin
    Real nearer;   ///< e^-gap to the vertex before
    Value weight;  ///< product of null ratios up to the vertex, its own included
  };

  struct Walk {
    std::vector<Vertex> forwards, backwards;
    bool turned = false;
    Value joined;  ///< sum over the pairs
    Value alone;   ///< sum over the whole walks
    // The backward vertices side by side, their number rounded up to whole groups:
    std::vector<Real> depth;    ///< as in the vertex, but inf for the ray's end; -inf in what completes the last group
    std::vector<Real> gaps;     ///< sum of e^gap up to the vertex
    std::vector<Real> ahead;    ///< e^(depth beyond a forward vertex)
    std::vector<Value> weight;  ///< as in the vertex
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto&) const {
    walk.forwards.assign(1, {0, kInfinity, ray.value(1)});
    walk.backwards.assign(1, {ray.majorant.total_depth(), kInfinity, ray.value(1)});
    walk.turned = false;
  }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    const Real total = ray.majorant.total_depth();
    if (!walk.turned) {
      const auto [e, nearer] = exponential_and_decay(rng);
      const Real depth = walk.forwards.back().depth + e;
      if (depth < total) {
        walk.forwards.push_back({depth, nearer, {}});
        return flight.advance_to(depth);
      }
      walk.turned = true;
    }
    const auto [e, nearer] = exponential_and_decay(rng);
    const Real depth = walk.backwards.back().depth - e;
    if (!(depth > 0) || !(depth < total)) {
      join(walk, total, ray.channels);
      return false;
    }
    walk.backwards.push_back({depth, nearer, {}});
    return flight.land(depth);
  }

  void consume(Walk& walk, const MediumRay<Value>&, const Flight& at, const Value& extinction, auto&) const {
    std::vector<Vertex>& vertices = walk.turned ? walk.backwards : walk.forwards;
    Vertex* const last = &vertices.back();
    last->weight = last[-1].weight * null_ratio(at, extinction);
  }

  Value result(const Walk& walk, const MediumRay<Value>&) const { return walk.joined + walk.alone; }

  Theory theory(const MediumRay<Value>& ray, const RayProfile&, int, Quantity) const {
    const Real lookups = 2 * ray.majorant.total_depth();
    return {.lookups = lookups, .lookups_variance = lookups};
  }

 private:
  /// Vertices that are joined to a vertex of the other walk together.
  static constexpr std::size_t kTogether = 8;
  /// Depth over which e^depth is a product of one exponential with the e^gap between.
  static constexpr Real kStretch = 32;

  /// Pairs are summed from the nearest group outwards, until what is left of a vertex is lost in the rounding of the sum: their
  /// number grows as the depth, not as its square.
  static void join(Walk& walk, Real total, int channels) {
    const std::vector<Vertex>&a = walk.forwards, &b = walk.backwards;
    const Real heaviest = line_up(walk), most = heaviest * static_cast<Real>(b.size());
    walk.alone = b.back().weight / (2 + walk.gaps[b.size() - 1] + exponential(b.back().depth));
    Value sum = walk.alone * 0;
    std::size_t nearest = walk.depth.size() - kTogether;  // begin of the last group with a vertex beyond the forward one
    // ahead[j] = e^(b_j - from) for j >= known, and nearer = e^(from - a_i).
    Real from = -kInfinity, nearer = 1, gaps = 0;
    std::size_t known = 0;
    for (const Vertex& vertex : a) {
      while (nearest > 0 && !(walk.depth[nearest] > vertex.depth)) nearest -= kTogether;
      gaps += 1 / vertex.nearer;
      nearer *= vertex.nearer;
      if (vertex.depth - from > kStretch) {
        from = vertex.depth;
        nearer = 1;
        known = std::min(nearest + kTogether, b.size()) - 1;
        walk.ahead[known] = exponential(b[known].depth - from);
      }
      // Products of a million factors do not reach 0 but stay at the least denormal number, and all of their pairs add nothing.
      if (largest(Value(magnitude(vertex.weight))) * most < std::numeric_limits<Real>::min()) continue;
      for (std::size_t first = nearest;; first -= kTogether) {
        for (; known > first; --known) walk.ahead[known - 1] = walk.ahead[known] * (1 / b[known].nearer);
        sum += vertex.weight * joined(walk, first, vertex.depth, 2 + gaps, nearer);
        if (first == 0 ||
            is_rounding(vertex.weight, heaviest * static_cast<Real>(first), nearer * walk.ahead[first], sum, channels))
          break;
      }
    }
    walk.joined = sum;
    walk.alone += a.back().weight / (2 + gaps + exponential(total - a.back().depth));
  }

  /// Sets the backward vertices side by side.  Returns the largest weight.
  static Real line_up(Walk& walk) {
    const std::size_t n = walk.backwards.size(), padded = (n + kTogether - 1) / kTogether * kTogether;
    for (std::vector<Real>* const numbers : {&walk.depth, &walk.gaps, &walk.ahead}) numbers->resize(padded);
    walk.weight.resize(padded);
    Real gaps = 0, heaviest = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const Vertex& vertex = walk.backwards[j];
      walk.depth[j] = vertex.depth;
      walk.gaps[j] = gaps += 1 / vertex.nearer;
      walk.weight[j] = vertex.weight;
      heaviest = std::max(heaviest, largest(Value(magnitude(vertex.weight))));
    }
    walk.depth[0] = kInfinity;  // the ray's end lies beyond all vertices, also of a ray without depth
    for (std::size_t j = n; j < padded; ++j) {
      walk.depth[j] = -kInfinity;
      walk.weight[j] = walk.backwards[0].weight;
    }
    return heaviest;
  }

  /// sum_j B_j / (before + e^{b_j - a} + gaps_j) over the vertices of a group that lie beyond depth a.
  static Value joined(const Walk& walk, std::size_t first, Real a, Real before, Real nearer) {
    constexpr std::size_t kWidth = std::min(kTogether, kNativeLanes<Real>);
    using Pack = Lanes<Real, kWidth>;
    std::array<Pack, kTogether / kWidth> share;
    for (std::size_t k = 0; k < share.size(); ++k) {
      const std::size_t j = first + k * kWidth;
      const Pack techniques = Pack(before) + Pack(nearer) * Pack::load(&walk.ahead[j]) + Pack::load(&walk.gaps[j]);
      share[k] = select(Pack::load(&walk.depth[j]) > Pack(a), Pack(1) / techniques, Pack(0));
    }
    const Value* const w = &walk.weight[first];
    if constexpr (std::is_same_v<Value, Real>) {
      for (std::size_t k = 0; k < share.size(); ++k) share[k] *= Pack::load(w + k * kWidth);
      for (std::size_t half = share.size() / 2; half > 0; half /= 2)
        for (std::size_t k = 0; k < half; ++k) share[k] += share[k + half];
      return sum_of_halves(share[0]);
    } else {
      Real s[kTogether];
      for (std::size_t k = 0; k < share.size(); ++k) share[k].store(s + k * kWidth);
      return ((w[0] * s[0] + w[4] * s[4]) + (w[2] * s[2] + w[6] * s[6])) +
             ((w[1] * s[1] + w[5] * s[5]) + (w[3] * s[3] + w[7] * s[7]));
    }
  }

  static bool is_rounding(const Value& weight, Real times, Real gap, const Value& sum, int channels) {
    // Hardly any vertex is that light.
    constexpr Real kFar = 0x1p40, kRounding = 0x1p-60;
    if (gap < kFar) return false;
    for (int c = 0; c < channels; ++c)
      if (std::abs(channel(weight, c)) * times > kRounding * std::abs(channel(sum, c)) * gap) return false;
    return true;
  }
};

}  // namespace nullmark
