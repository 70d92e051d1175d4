#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "estimators/estimator.h"
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

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  /// Vertices that are joined to a vertex of the other walk together.
  static constexpr std::size_t kTogether = 8;

  /// What one walk leaves behind: a vertex for its origin and for each collision.
  struct Prefix {
    std::vector<Real> depth;    ///< majorant depth from the ray's begin
    std::vector<Value> weight;  ///< product of null ratios up to the vertex, its own included
    std::vector<Real> gap;      ///< e^gap to the vertex before; the last entry is that of the ray's end
    std::vector<Real> gaps;     ///< sum of them up to the vertex
    Real all_gaps = 0;          ///< sum of e^gap of the whole walk
    Value whole;                ///< product of all null ratios

    void start(Real at, const Value& one) {
      depth.assign(1, at);
      weight.assign(1, one);
    }
    void finish(Real end) {
      const std::size_t n = depth.size();
      whole = weight.back();
      gap.resize(n + 1);
      gap[0] = 0;
      for (std::size_t j = 1; j < n; ++j) gap[j] = std::abs(depth[j] - depth[j - 1]);
      gap[n] = std::abs(end - depth.back());
      exponentials(gap.data(), n + 1, gap.data());
      gaps.assign(n, 0);
      for (std::size_t j = 1; j < n; ++j) gaps[j] = gaps[j - 1] + gap[j];
      all_gaps = gaps.back() + gap[n];
    }
  };

  struct Walk {
    Prefix forwards, backwards;
    bool turned = false;
    std::vector<Real> to_last;       ///< of the backward vertices: e^gap to the last one of their group of kTogether
    std::vector<std::size_t> ahead;  ///< of the forward vertices: the backward vertices before which they lie
    std::vector<Real> to_group;      ///< of the forward vertices: e^gap to the last vertex of the group that is nearest
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto&) const {
    walk.forwards.start(0, ray.value(1));
    walk.backwards.start(ray.majorant.total_depth(), ray.value(1));
    walk.turned = false;
  }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    const Real total = ray.majorant.total_depth();
    if (!walk.turned) {
      const Real depth = walk.forwards.depth.back() + rng.exponential();
      if (depth < total) {
        walk.forwards.depth.push_back(depth);
        return flight.advance_to(depth);
      }
      walk.forwards.finish(total);
      walk.turned = true;
    }
    const Real depth = walk.backwards.depth.back() - rng.exponential();
    if (!(depth > 0) || !(depth < total)) {
      walk.backwards.finish(0);
      group(walk);
      return false;
    }
    walk.backwards.depth.push_back(depth);
    flight.start(ray.majorant);
    return flight.advance_to(depth);
  }

  void consume(Walk& walk, const MediumRay<Value>&, const Flight& at, const Value& extinction, auto&) const {
    std::vector<Value>& weight = (walk.turned ? walk.backwards : walk.forwards).weight;
    weight.push_back(weight.back() * null_ratio(at, extinction));
  }

  /// Pairs are summed from the nearest group outwards, until what is left of a vertex is lost in the rounding of the sum: their
  /// number grows as the depth, not as its square.
  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    const Prefix &a = walk.forwards, &b = walk.backwards;
    Value sum = a.whole / (2 + a.all_gaps) + b.whole / (2 + b.all_gaps);
    Real heaviest = 0;
    for (const Value& weight : b.weight) heaviest = std::max(heaviest, largest(Value(magnitude(weight))));
    const Real most = heaviest * static_cast<Real>(b.depth.size());
    for (std::size_t i = 0; i < a.depth.size(); ++i) {
      // Products of a million factors do not reach 0 but stay at the least denormal number, and all of their pairs add nothing.
      if (largest(Value(magnitude(a.weight[i]))) * most < std::numeric_limits<Real>::min()) continue;
      std::size_t ahead = walk.ahead[i];
      for (Real gap = walk.to_group[i]; ahead > 0;) {
        const std::size_t first = begin_of_group(ahead);
        sum += a.weight[i] * joined(walk, first, ahead - first, 2 + a.gaps[i], gap);
        gap *= walk.to_last[first] * b.gap[first];
        if (is_rounding(a.weight[i], heaviest * static_cast<Real>(first), gap, sum, ray.channels)) break;
        ahead = first;
      }
    }
    return sum;
  }

  Theory theory(const MediumRay<Value>& ray, const RayProfile&, int, Quantity) const {
    const Real lookups = 2 * ray.majorant.total_depth();
    return {.lookups = lookups, .lookups_variance = lookups};
  }

 private:
  static std::size_t begin_of_group(std::size_t end) { return (end - 1) / kTogether * kTogether; }

  /// What `result` reads of both walks.  The last group is completed with vertices of weight 0.
  static void group(Walk& walk) {
    const Prefix& a = walk.forwards;
    Prefix& b = walk.backwards;
    const std::size_t n = b.depth.size(), padded = begin_of_group(n) + kTogether;
    walk.to_last.assign(padded, 1);
    for (std::size_t j = n - 1; j-- > 0;)
      if ((j + 1) % kTogether != 0) walk.to_last[j] = walk.to_last[j + 1] * b.gap[j + 1];
    b.gaps.resize(padded, 0);
    b.weight.resize(padded, b.whole * 0);
    walk.ahead.resize(a.depth.size());
    walk.to_group.resize(a.depth.size());
    std::size_t ahead = n;
    for (std::size_t i = 0; i < a.depth.size(); ++i) {
      while (ahead > 1 && !(b.depth[ahead - 1] > a.depth[i])) --ahead;
      walk.ahead[i] = ahead;
      walk.to_group[i] = b.depth[std::min(begin_of_group(ahead) + kTogether, n) - 1] - a.depth[i];
    }
    exponentials(walk.to_group.data(), walk.to_group.size(), walk.to_group.data());
  }

  /// sum_j B_j / (before + e^{gap_j} + gaps_j) over the first n vertices of a group whose last one is `gap` = e^gap away.
  static Value joined(const Walk& walk, std::size_t first, std::size_t n, Real before, Real gap) {
    constexpr std::size_t kWidth = std::min(kTogether, kNativeLanes<Real>);
    using Pack = Lanes<Real, kWidth>;
    Real share[kTogether];
    for (std::size_t j = 0; j < kTogether; j += kWidth) {
      const Pack to_last = Pack::load(&walk.to_last[first + j]), gaps = Pack::load(&walk.backwards.gaps[first + j]);
      (Pack(1) / (Pack(before) + Pack(gap) * to_last + gaps)).store(share + j);
    }
    std::fill(share + n, share + kTogether, 0);
    const Value* const w = &walk.backwards.weight[first];
    return ((w[0] * share[0] + w[4] * share[4]) + (w[2] * share[2] + w[6] * share[6])) +
           ((w[1] * share[1] + w[5] * share[5]) + (w[3] * share[3] + w[7] * share[7]));
  }

  static bool is_rounding(const Value& weight, Real times, Real gap, const Value& sum, int channels) {
    constexpr Real kRounding = 0x1p-60;
    for (int c = 0; c < channels; ++c)
      if (std::abs(channel(weight, c)) * times > kRounding * std::abs(channel(sum, c)) * gap) return false;
    return true;
  }
};

}  // namespace nullmark
