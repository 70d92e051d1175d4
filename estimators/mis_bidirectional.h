#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
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

  /// The origin of one of both walks, or a collision.
  struct Vertex {
    Real depth;    ///< majorant depth from the ray's begin
    Real nearer;   ///< e^-gap to the vertex before
    Value weight;  ///< product of null ratios up to the vertex, its own included
  };

  struct Walk {
    std::vector<Vertex> vertices;  ///< of the forward walk, then of the backward one
    std::size_t turn = 0;          ///< number of forward vertices, once that walk has ended; 0 before
    Value joined;                  ///< sum over the pairs
    Value alone;                   ///< sum over the whole walks
    std::vector<Real> growth;      ///< e^gap of each vertex
    // The backward vertices side by side, their number rounded up to whole groups:
    std::vector<Real> depth;   ///< as in the vertex, but inf for the ray's end; -inf in what completes the last group
    std::vector<Real> gaps;    ///< sum of e^gap up to the vertex
    std::vector<Real> ahead;   ///< e^(depth beyond a forward vertex)
    std::vector<Real> weight;  ///< as in the vertex, channel after channel
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto&) const {
    walk.vertices.assign(1, {0, kInfinity, ray.value(1)});
    walk.turn = 0;
  }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    const Real total = ray.majorant.total_depth();
    if (walk.turn == 0) {
      const auto [e, nearer] = exponential_and_decay(rng);
      const Real depth = walk.vertices.back().depth + e;
      if (depth < total) {
        walk.vertices.push_back({depth, nearer, {}});
        return flight.advance_to(depth);
      }
      walk.turn = walk.vertices.size();
      walk.vertices.push_back({total, kInfinity, ray.value(1)});
    }
    const auto [e, nearer] = exponential_and_decay(rng);
    const Real depth = walk.vertices.back().depth - e;
    if (!(depth > 0) || !(depth < total)) {
      join(walk, total, ray.channels);
      return false;
    }
    walk.vertices.push_back({depth, nearer, {}});
    return flight.travel_to(depth);
  }

  void consume(Walk& walk, const MediumRay<Value>&, const Flight& at, const Value& extinction, auto&) const {
    Vertex* const last = &walk.vertices.back();
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
  static constexpr std::size_t kWidth = std::min(kTogether, kNativeLanes<Real>);
  using Pack = Lanes<Real, kWidth>;
  using Group = std::array<Pack, kTogether / kWidth>;
  /// Depth over which e^depth is a product of one exponential with the e^gap between.
  static constexpr Real kStretch = 32;

  /// Sums over pairs, one for each channel and place in a group.
  class PairSums {
   public:
    explicit PairSums(int channels) : channels_(channels) {
      for (int c = 0; c < number(); ++c) of(c).fill(Pack(0));
    }

    /// Adds A B_j share_j over a group; b has the B_j of a channel side by side, and channels `row` numbers apart.
    void add(const Value& a, const Real* b, std::size_t row, const Group& share) {
      for (int c = 0; c < number(); ++c, b += row)
        for (std::size_t k = 0; k < share.size(); ++k) of(c)[k] += Pack(channel(a, c)) * share[k] * Pack::load(b + k * kWidth);
    }

    Value value() const {
      Value all = uniform_value<Value>(channels_, 0);
      for (int c = 0; c < number(); ++c) {
        Group sum = sums_[static_cast<std::size_t>(c)];
        for (std::size_t half = sum.size() / 2; half > 0; half /= 2)
          for (std::size_t k = 0; k < half; ++k) sum[k] += sum[k + half];
        channel(all, c) = sum_of_halves(sum[0]);
      }
      return all;
    }

   private:
    /// A constant where there is one channel.
    int number() const { return kIsChromatic<Value> ? channels_ : 1; }
    Group& of(int c) { return sums_[static_cast<std::size_t>(c)]; }

    int channels_;
    std::array<Group, static_cast<std::size_t>(kMostChannels<Value>)> sums_;
  };

  /// Pairs are summed from the nearest group outwards, until what is left of a vertex is lost in the rounding of the sum: their
  /// number grows as the depth, not as its square.
  static void join(Walk& walk, Real total, int channels) {
    const std::span<const Vertex> a = forwards(walk), b = backwards(walk);
    const Real heaviest = line_up(walk, channels), most = heaviest * static_cast<Real>(b.size());
    const Real *const growth_a = walk.growth.data(), *const growth_b = growth_a + a.size();
    walk.alone = b.back().weight / (2 + walk.gaps[b.size() - 1] + exponential(b.back().depth));
    PairSums sums(channels);
    std::size_t nearest = walk.depth.size() - kTogether;  // begin of the last group with a vertex beyond the forward one
    // ahead[j] = e^(b_j - from) for j >= known, and nearer = e^(from - a_i).
    Real from = -kInfinity, nearer = 1, gaps = 0;
    std::size_t known = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      while (nearest > 0 && !(walk.depth[nearest] > a[i].depth)) nearest -= kTogether;
      gaps += growth_a[i];
      nearer *= a[i].nearer;
      if (a[i].depth - from > kStretch) {
        from = a[i].depth;
        nearer = 1;
        known = std::min(nearest + kTogether, b.size()) - 1;
        walk.ahead[known] = exponential(b[known].depth - from);
      }
      // Products of a million factors do not reach 0 but stay at the least denormal number, and all of their pairs add nothing.
      if (largest(Value(magnitude(a[i].weight))) * most < std::numeric_limits<Real>::min()) continue;
      for (std::size_t first = nearest;; first -= kTogether) {
        for (Real ahead = walk.ahead[known]; known > first; --known) walk.ahead[known - 1] = ahead *= growth_b[known];
        sums.add(a[i].weight, &walk.weight[first], walk.depth.size(), shares(walk, first, a[i].depth, 2 + gaps, nearer));
        if (first == 0 ||
            is_rounding(a[i].weight, heaviest * static_cast<Real>(first), nearer * walk.ahead[first], sums, channels))
          break;
      }
    }
    walk.joined = sums.value();
    walk.alone += a.back().weight / (2 + gaps + exponential(total - a.back().depth));
  }

  static std::span<const Vertex> forwards(const Walk& walk) { return std::span(walk.vertices).first(walk.turn); }
  static std::span<const Vertex> backwards(const Walk& walk) { return std::span(walk.vertices).subspan(walk.turn); }

  /// Sets the backward vertices side by side, and the e^gap of all.  Returns the largest backward weight.
  static Real line_up(Walk& walk, int channels) {
    const std::span<const Vertex> b = backwards(walk);
    const std::size_t n = b.size(), padded = (n + kTogether - 1) / kTogether * kTogether;
    walk.growth.resize(walk.vertices.size());
    for (std::size_t i = 0; i < walk.growth.size(); ++i) walk.growth[i] = walk.vertices[i].nearer;
    for (Real& growth : walk.growth) growth = 1 / growth;  // a loop of its own is vectorised
    for (std::vector<Real>* const numbers : {&walk.depth, &walk.gaps, &walk.ahead}) numbers->resize(padded);
    walk.weight.resize(padded * static_cast<std::size_t>(channels));
    const auto set_weight = [&](std::size_t j, const Value& weight) {
      for (int c = 0; c < (kIsChromatic<Value> ? channels : 1); ++c)
        walk.weight[static_cast<std::size_t>(c) * padded + j] = channel(weight, c);
    };
    Real gaps = 0, heaviest = 0;
    for (std::size_t j = 0; j < n; ++j) {
      walk.depth[j] = b[j].depth;
      walk.gaps[j] = gaps += walk.growth[walk.turn + j];
      set_weight(j, b[j].weight);
      heaviest = std::max(heaviest, largest(Value(magnitude(b[j].weight))));
    }
    walk.depth[0] = kInfinity;  // the ray's end lies beyond all vertices, also of a ray without depth
    for (std::size_t j = n; j < padded; ++j) {
      walk.depth[j] = -kInfinity;
      set_weight(j, b[0].weight);
    }
    return heaviest;
  }

  /// 1 / (before + e^{b_j - a} + gaps_j) for the vertices of a group that lie beyond depth a, 0 for the others.
  static Group shares(const Walk& walk, std::size_t first, Real a, Real before, Real nearer) {
    Group shares;
    for (std::size_t k = 0; k < shares.size(); ++k) {
      const std::size_t j = first + k * kWidth;
      const Pack techniques = Pack(before) + Pack(nearer) * Pack::load(&walk.ahead[j]) + Pack::load(&walk.gaps[j]);
      shares[k] = select(Pack::load(&walk.depth[j]) > Pack(a), Pack(1) / techniques, Pack(0));
    }
    return shares;
  }

  static bool is_rounding(const Value& weight, Real times, Real gap, const PairSums& pairs, int channels) {
    // Hardly any vertex is that light.
    constexpr Real kFar = 0x1p40, kRounding = 0x1p-60;
    if (gap < kFar) return false;
    const Value sum = pairs.value();
    for (int c = 0; c < channels; ++c)
      if (std::abs(channel(weight, c)) * times > kRounding * std::abs(channel(sum, c)) * gap) return false;
    return true;
  }
};

}  // namespace nullmark
