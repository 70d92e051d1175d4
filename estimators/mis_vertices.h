#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "media/base/lanes.h"
#include "media/base/value.h"

namespace nullmark {

/// The vertices of both walks of bidirectional MIS, and the sum over all that they can be joined to: see mis_bidirectional.h.
template <class Value>
class MisVertices {
 public:
  /// Walks of a block, whose vertices fit the L2 cache together.
  static constexpr std::size_t kTogether = 64;

  /// The origin of one of both walks, or a collision.
  struct Vertex {
    Real depth;    ///< majorant depth from the ray's begin
    Real nearer;   ///< e^-gap to the vertex before
    Value weight;  ///< product of null ratios up to the vertex, its own included
  };

  /// Begins the forward walk.
  void start(const Value& one) {
    vertices_.assign(1, {0, kInfinity, one});
    turn_ = 0;
  }

  /// Begins the backward walk, at the majorant depth of the ray's end.
  void turn(Real total, const Value& one) {
    turn_ = vertices_.size();
    vertices_.push_back({total, kInfinity, one});
  }
  bool has_turned() const { return turn_ > 0; }

  void add(const Vertex& vertex) { vertices_.push_back(vertex); }
  /// Weighs the last vertex by its null ratio.
  void weigh(const Value& ratio) {
    Vertex* const last = &vertices_.back();
    last->weight = last[-1].weight * ratio;
  }

  /// Sum over the pairs.
  const Value& joined() const { return joined_; }
  /// Sum over the whole walks.
  const Value& alone() const { return alone_; }

  /// Of the last vertex.
  Real depth() const { return vertices_.back().depth; }

  /// Computes the sums.  Pairs are summed from the nearest group outwards, until what is left of a vertex is lost in the
  /// rounding of the sum: their number grows as the depth, not as its square.
  void join(int channels) {
    const std::span<const Vertex> a = forwards(), b = backwards();
    const Real heaviest = line_up(channels), most = heaviest * static_cast<Real>(b.size());
    const Real *const growth_a = growth_.data(), *const growth_b = growth_a + a.size();
    alone_ = b.back().weight / (2 + gaps_[b.size() - 1] + exponential(b.back().depth));
    PairSums sums(channels);
    std::size_t nearest = depth_.size() - kGroup;  // begin of the last group with a vertex beyond the forward one
    // ahead[j] = e^(b_j - from) for j >= known, and nearer = e^(from - a_i).
    Real from = -kInfinity, nearer = 1, gaps = 0;
    std::size_t known = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      while (nearest > 0 && !(depth_[nearest] > a[i].depth)) nearest -= kGroup;
      gaps += growth_a[i];
      nearer *= a[i].nearer;
      if (a[i].depth - from > kStretch) {
        from = a[i].depth;
        nearer = 1;
        known = std::min(nearest + kGroup, b.size()) - 1;
        ahead_[known] = exponential(b[known].depth - from);
      }
      // Products of a million factors do not reach 0 but stay at the least denormal number, and all of their pairs add nothing.
      if (largest(Value(magnitude(a[i].weight))) * most < std::numeric_limits<Real>::min()) continue;
      for (std::size_t first = nearest;; first -= kGroup) {
        for (Real ahead = ahead_[known]; known > first; --known) ahead_[known - 1] = ahead *= growth_b[known];
        sums.add(a[i].weight, &weight_[first], depth_.size(), shares(first, a[i].depth, 2 + gaps, nearer));
        if (first == 0 || is_rounding(a[i].weight, heaviest * static_cast<Real>(first), nearer * ahead_[first], sums, channels))
          break;
      }
    }
    alone_ += a.back().weight / (2 + gaps + exponential(b[0].depth - a.back().depth));
    joined_ = sums.value();
  }

 private:
  /// Vertices that are joined to a vertex of the other walk together.
  static constexpr std::size_t kGroup = 8;
  static constexpr std::size_t kWidth = std::min(kGroup, kNativeLanes<Real>);
  using Pack = Lanes<Real, kWidth>;
  using Group = std::array<Pack, kGroup / kWidth>;
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

  std::span<const Vertex> forwards() const { return std::span(vertices_).first(turn_); }
  std::span<const Vertex> backwards() const { return std::span(vertices_).subspan(turn_); }

  /// Sets the backward vertices side by side, and the e^gap of all.  Returns the largest backward weight.
  Real line_up(int channels) {
    const std::span<const Vertex> b = backwards();
    const std::size_t n = b.size(), padded = (n + kGroup - 1) / kGroup * kGroup;
    growth_.resize(vertices_.size());
    for (std::size_t i = 0; i < growth_.size(); ++i) growth_[i] = vertices_[i].nearer;
    for (Real& growth : growth_) growth = 1 / growth;  // a loop of its own is vectorised
    for (std::vector<Real>* const numbers : {&depth_, &gaps_, &ahead_}) numbers->resize(padded);
    weight_.resize(padded * static_cast<std::size_t>(channels));
    const auto set_weight = [&](std::size_t j, const Value& weight) {
      for (int c = 0; c < (kIsChromatic<Value> ? channels : 1); ++c)
        weight_[static_cast<std::size_t>(c) * padded + j] = channel(weight, c);
    };
    Real gaps = 0, heaviest = 0;
    for (std::size_t j = 0; j < n; ++j) {
      depth_[j] = b[j].depth;
      gaps_[j] = gaps += growth_[turn_ + j];
      set_weight(j, b[j].weight);
      heaviest = std::max(heaviest, largest(Value(magnitude(b[j].weight))));
    }
    depth_[0] = kInfinity;  // the ray's end lies beyond all vertices, also of a ray without depth
    for (std::size_t j = n; j < padded; ++j) {
      depth_[j] = -kInfinity;
      set_weight(j, b[0].weight);
    }
    return heaviest;
  }

  /// 1 / (before + e^{b_j - a} + gaps_j) for the vertices of a group that lie beyond depth a, 0 for the others.
  Group shares(std::size_t first, Real a, Real before, Real nearer) const {
    Group shares;
    for (std::size_t k = 0; k < shares.size(); ++k) {
      const std::size_t j = first + k * kWidth;
      const Pack techniques = Pack(before) + Pack(nearer) * Pack::load(&ahead_[j]) + Pack::load(&gaps_[j]);
      shares[k] = select(Pack::load(&depth_[j]) > Pack(a), Pack(1) / techniques, Pack(0));
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

  std::vector<Vertex> vertices_;  ///< of the forward walk, then of the backward one
  std::size_t turn_ = 0;          ///< number of forward vertices, once that walk has ended; 0 before
  Value joined_, alone_;
  std::vector<Real> growth_;  ///< e^gap of each vertex
  // The backward vertices side by side, their number rounded up to whole groups:
  std::vector<Real> depth_;   ///< as in the vertex, but inf for the ray's end; -inf in what completes the last group
  std::vector<Real> gaps_;    ///< sum of e^gap up to the vertex
  std::vector<Real> ahead_;   ///< e^(depth beyond a forward vertex)
  std::vector<Real> weight_;  ///< as in the vertex, channel after channel
};

}  // namespace nullmark
