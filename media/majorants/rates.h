#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// What a flight does at the end of a cell.  carry: what is left of its exponential goes on in the next cell; rewind: it is cut
/// there and drawn anew in the next cell that has a rate [Yue et al. 2010, Sec. 3].  The exponential has no memory, so collisions
/// follow the same law; rewinding costs one more random number per cell left.
enum class Crossing { carry, rewind };

/// A stretch of constant rate.
template <class T>
struct RatePiece {
  T begin, end, rate, inverse_rate, depth_before, depth_after;
};

/// Pieces of a ray from its begin on.  A ray that misses has none, but its walk may ask for the rate: piece 0 is then of rate 0
/// and no length.
class RatePieces {
 public:
  void start(Real begin) {
    pieces_.resize(1);
    pieces_.front() = {begin, begin, 0, kInfinity, 0, 0};
    size_ = 0;
    total_depth_ = 0;
  }

  /// Appends the piece from the current end to `end`.  Zero rates are fine, also over an infinite length.
  void append(Real end, Real rate) {
    const Real from = pieces_.back().end, before = total_depth_;
    if (rate > 0) total_depth_ += rate * (end - from);
    if (size_++ == 0) pieces_.clear();
    // Finite for denormal rates as well: 0 times it is then a number.
    const Real inverse = rate > 0 ? std::min(1 / rate, std::numeric_limits<Real>::max()) : kInfinity;
    pieces_.push_back({from, end, rate, inverse, before, total_depth_});
  }

  std::size_t size() const { return size_; }
  Real total_depth() const { return total_depth_; }
  const RatePiece<Real>& operator[](std::size_t i) const { return pieces_[i]; }
  /// At least one.
  const std::vector<RatePiece<Real>>& all() const { return pieces_; }

 private:
  std::vector<RatePiece<Real>> pieces_{{0, 0, 0, kInfinity, 0, 0}};
  Real total_depth_ = 0;
  std::size_t size_ = 0;  ///< without the piece of a ray that misses
};

/// A majorant structure walked along a ray, cell by cell, as far as a flight asks.
class Traversal {
 public:
  virtual ~Traversal() = default;

  /// Begins a ray, given in the world and in the medium's local frame (same t, cut to the medium's bounds).
  virtual void start(const Ray& world, const Ray& local) = 0;

  /// Appends the cells that follow until the depth of the pieces exceeds `depth`; false where the ray has ended.
  virtual bool extend(RatePieces& pieces, Real depth) = 0;
};

/// A piecewise constant sampling rate along a ray, 1/length, with its running depth int_begin^t rate.  Its pieces are appended by
/// hand, or found by a traversal when a flight first comes to them: what is known of a ray then grows behind a constant
/// interface, and belongs to one thread.
class Rates {
 public:
  Rates() = default;
  /// Finds all pieces first: a traversal serves one object.
  Rates(const Rates& other) { *this = other; }
  Rates& operator=(const Rates& other) {
    if (this == &other) return *this;
    other.find_all();
    known_ = other.known_;
    single_ = other.single_;
    unfinished_ = nullptr;
    begin_ = other.begin_;
    crossing_ = other.crossing_;
    return *this;
  }

  void start(Real begin, Crossing crossing = Crossing::carry) {
    known_.start(begin);
    single_.clear();
    unfinished_ = nullptr;
    begin_ = begin;
    crossing_ = crossing;
  }

  /// The pieces of a traversal that has started, and that outlives their use.
  void start(Real begin, Crossing crossing, Traversal& traversal) {
    start(begin, crossing);
    unfinished_ = &traversal;
  }

  void append(Real end, Real rate) { known_.append(end, rate); }

  Crossing crossing() const { return crossing_; }
  Real begin() const { return begin_; }

  /// Of the whole ray: these find all pieces.
  std::size_t size() const { return find_all(), known_.size(); }
  Real end() const { return find_all(), known_.all().back().end; }
  Real total_depth() const { return find_all(), known_.total_depth(); }

  /// Whether the ray is deeper than that; its piece of that depth is then known.
  bool reaches(Real depth) const { return depth < known_.total_depth() || (unfinished_ && find(depth)); }

  /// Whether there is a piece i; it is then known.
  bool has(std::size_t i) const {
    while (unfinished_ && i >= known_.size()) find(known_.total_depth());
    return i < known_.size();
  }

  /// The first piece that is deeper than a depth that the ray reaches.
  std::size_t piece_of(Real depth) const {
    const auto& all = known_.all();
    const auto found =
        std::partition_point(all.begin(), all.end(), [depth](const auto& at) { return !(depth < at.depth_after); });
    return static_cast<std::size_t>(found - all.begin());
  }

  Real end(std::size_t i) const { return piece(i).end; }
  Real rate(std::size_t i) const { return piece(i).rate; }
  /// The same, for walks that find their rays' pieces as they go: without a call where piece i is known.
  Real rate_on_the_way(std::size_t i) const { return i < known_.size() ? known_[i].rate : rate(i); }
  Real depth_before(std::size_t i) const { return piece(i).depth_before; }
  Real depth_after(std::size_t i) const { return piece(i).depth_after; }

  /// Distance at which the depth, within piece i, is reached.
  Real position(std::size_t i, Real depth) const { return position(piece(i), depth); }

  /// All pieces, at least one, for lanes; those in single precision are made when first asked for.
  template <class T>
  const RatePiece<T>* pieces() const {
    find_all();
    if constexpr (std::is_same_v<T, Real>) {
      return known_.all().data();
    } else {
      const auto narrow = [](Real x) { return static_cast<T>(x); };
      const auto narrow_inverse = [&](const RatePiece<Real>& p) {
        return p.rate > 0 ? narrow(std::min<Real>(p.inverse_rate, std::numeric_limits<T>::max())) : narrow(p.inverse_rate);
      };
      if (single_.empty())
        for (const RatePiece<Real>& p : known_.all())
          single_.push_back(
              {narrow(p.begin), narrow(p.end), narrow(p.rate), narrow_inverse(p), narrow(p.depth_before), narrow(p.depth_after)});
      return single_.data();
    }
  }

 private:
  friend class Flight;

  /// A piece that is known: one that a depth is reached in, or that the ray `has`.
  const RatePiece<Real>& known(std::size_t i) const { return known_[i]; }

  const RatePiece<Real>& piece(std::size_t i) const {
    if (unfinished_) [[unlikely]]
      find_piece(i);
    return known_[i];
  }

  static Real position(const RatePiece<Real>& piece, Real depth) {
    return std::min(piece.end, piece.begin + (depth - piece.depth_before) * piece.inverse_rate);
  }

  // Rarely taken, and kept out of the flights' code.
  [[gnu::noinline, gnu::cold]] void find_piece(std::size_t i) const { has(i); }
  [[gnu::noinline]] bool find(Real depth) const {
    if (!unfinished_->extend(known_, depth)) unfinished_ = nullptr;
    return depth < known_.total_depth();
  }
  void find_all() const {
    if (unfinished_) find(kInfinity);
  }

  mutable RatePieces known_;
  mutable std::vector<RatePiece<float>> single_;
  mutable Traversal* unfinished_ = nullptr;  ///< null once it has come to the ray's end
  Real begin_ = 0;
  Crossing crossing_ = Crossing::carry;
};

}  // namespace nullmark
