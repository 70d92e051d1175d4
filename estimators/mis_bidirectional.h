#pragma once

#include <limits>
#include <vector>

#include "estimators/estimator.h"

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

  /// What one walk leaves behind: a vertex for its origin and for each collision.
  struct Prefix {
    std::vector<Real> depth;    ///< majorant depth from the ray's begin
    std::vector<Real> gap;      ///< e^gap to the vertex before
    std::vector<Real> gaps;     ///< sum of them up to the vertex
    std::vector<Value> weight;  ///< product of null ratios up to the vertex, its own included
    Real all_gaps = 0;          ///< sum of e^gap of the whole walk

    void start(Real at, const Value& one) {
      depth.assign(1, at);
      gap.assign(1, 1);
      gaps.assign(1, 0);
      weight.assign(1, one);
    }
    void add(Real at) {
      gap.push_back(exponential(std::abs(at - depth.back())));
      gaps.push_back(gaps.back() + gap.back());
      depth.push_back(at);
    }
    void finish(Real at) { all_gaps = gaps.back() + exponential(std::abs(at - depth.back())); }
  };

  struct Walk {
    Prefix forwards, backwards;
    bool turned = false;
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
        walk.forwards.add(depth);
        return flight.advance_to(depth);
      }
      walk.forwards.finish(total);
      walk.turned = true;
    }
    const Real depth = walk.backwards.depth.back() - rng.exponential();
    if (!(depth > 0) || !(depth < total)) {
      walk.backwards.finish(0);
      return false;
    }
    walk.backwards.add(depth);
    flight.start(ray.majorant);
    return flight.advance_to(depth);
  }

  void consume(Walk& walk, const MediumRay<Value>&, const Flight& at, const Value& extinction, auto&) const {
    std::vector<Value>& weight = (walk.turned ? walk.backwards : walk.forwards).weight;
    weight.push_back(weight.back() * null_ratio(at, extinction));
  }

  /// Pairs are summed from the nearest outwards, until what is left of a vertex is lost in the rounding of the sum: their number
  /// grows as the depth, not as its square.
  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    const Prefix &a = walk.forwards, &b = walk.backwards;
    Value sum = a.weight.back() / (2 + a.all_gaps) + b.weight.back() / (2 + b.all_gaps);
    Real heaviest = 0;
    for (const Value& weight : b.weight) heaviest = std::max(heaviest, largest(Value(magnitude(weight))));
    const Real most = heaviest * static_cast<Real>(b.depth.size());
    std::size_t ahead = b.depth.size();
    for (std::size_t i = 0; i < a.depth.size(); ++i) {
      // Products of a million factors do not reach 0 but stay at the least denormal number, and all of their pairs add nothing.
      if (largest(Value(magnitude(a.weight[i]))) * most < std::numeric_limits<Real>::min()) continue;
      while (ahead > 1 && !(b.depth[ahead - 1] > a.depth[i])) --ahead;
      Real gap = exponential(b.depth[ahead - 1] - a.depth[i]);
      for (std::size_t j = ahead; j-- > 0; gap *= b.gap[j]) {
        sum += a.weight[i] * b.weight[j] / (2 + gap + a.gaps[i] + b.gaps[j]);
        if (is_rounding(a.weight[i], heaviest * static_cast<Real>(j), gap, sum, ray.channels)) break;
      }
    }
    return sum;
  }

  Theory theory(const MediumRay<Value>& ray, const RayProfile&, int, Quantity) const {
    const Real lookups = 2 * ray.majorant.total_depth();
    return {.lookups = lookups, .lookups_variance = lookups};
  }

 private:
  static bool is_rounding(const Value& weight, Real times, Real gap, const Value& sum, int channels) {
    constexpr Real kRounding = 0x1p-60;
    for (int c = 0; c < channels; ++c)
      if (std::abs(channel(weight, c)) * times > kRounding * std::abs(channel(sum, c)) * gap) return false;
    return true;
  }
};

}  // namespace nullmark
