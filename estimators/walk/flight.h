#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "media/majorants/majorant.h"

namespace nullmark {

/// A stretch of constant rate.
template <class T>
struct RatePiece {
  T begin, end, rate, inverse_rate, depth_before, depth_after;
};

/// A piecewise constant sampling rate along a ray, 1/length, with its running depth int_begin^t rate.  A ray that misses has no
/// piece, but its walk may ask for the rate: piece 0 is then of rate 0 and no length.
class Rates {
 public:
  void start(Real begin, Crossing crossing = Crossing::carry) {
    pieces_.assign(1, {begin, begin, 0, kInfinity, 0, 0});
    empty_ = true;
    single_.clear();
    begin_ = begin;
    crossing_ = crossing;
    total_depth_ = 0;
  }

  /// Appends the piece from the current end to `end`.  Zero rates are fine, also over an infinite length.
  void append(Real end, Real rate) {
    const Real from = this->end(), before = total_depth_;
    if (rate > 0) total_depth_ += rate * (end - from);
    if (empty_) pieces_.clear();
    empty_ = false;
    pieces_.push_back({from, end, rate, 1 / rate, before, total_depth_});
  }

  std::size_t size() const { return empty_ ? 0 : pieces_.size(); }
  Crossing crossing() const { return crossing_; }
  Real begin() const { return begin_; }
  Real end() const { return pieces_.back().end; }
  Real end(std::size_t i) const { return pieces_[i].end; }
  Real rate(std::size_t i) const { return pieces_[i].rate; }
  Real depth_before(std::size_t i) const { return pieces_[i].depth_before; }
  Real depth_after(std::size_t i) const { return pieces_[i].depth_after; }
  Real total_depth() const { return total_depth_; }

  /// Distance at which the depth, within piece i, is reached.
  Real position(std::size_t i, Real depth) const {
    const RatePiece<Real>& piece = pieces_[i];
    return std::min(piece.end, piece.begin + (depth - piece.depth_before) * piece.inverse_rate);
  }

  /// All pieces, at least one, for lanes; those in single precision are made when first asked for.
  template <class T>
  const RatePiece<T>* pieces() const {
    if constexpr (std::is_same_v<T, Real>) {
      return pieces_.data();
    } else {
      const auto narrow = [](Real x) { return static_cast<T>(x); };
      if (single_.empty())
        for (const RatePiece<Real>& p : pieces_)
          single_.push_back({narrow(p.begin), narrow(p.end), narrow(p.rate), narrow(p.inverse_rate), narrow(p.depth_before),
                             narrow(p.depth_after)});
      return single_.data();
    }
  }

 private:
  std::vector<RatePiece<Real>> pieces_{{0, 0, 0, kInfinity, 0, 0}};
  mutable std::vector<RatePiece<float>> single_;
  Real begin_ = 0, total_depth_ = 0;
  bool empty_ = true;
  Crossing crossing_ = Crossing::carry;
};

/// Where a walk is on its ray.  Flights live in majorant depth: the next tentative collision lies one unit exponential of depth
/// ahead, whatever cells are crossed, so a collision costs one logarithm and a crossing none.  With Crossing::rewind the flight
/// is cut at each cell's end and starts anew there; the depth it is cut at is where the next exponential counts from, so depths
/// follow the same law.  Cells of rate 0 are passed over without a draw; a ray that has no other costs one.
class Flight {
 public:
  void start(const Rates& rates) {
    rates_ = &rates;
    piece_ = 0;
    collisions_ = 0;
    depth_ = 0;
    position_ = rates.begin();
  }

  /// Moves to the next tentative collision; false when it lies beyond the ray's end, or where the walk is not `alive`.
  bool next(auto& rng, bool alive) { return alive && next(rng); }
  bool next(auto& rng) {
    const bool inside = fly(rng);
    collisions_ += inside;
    return inside;
  }

  /// Moves forwards to the point of the given depth; false (and the ray's end) when the ray is not that deep.
  bool advance_to(Real depth) {
    depth_ = depth;
    if (!(depth < rates_->total_depth())) {
      position_ = rates_->end();
      return false;
    }
    while (!(depth < rates_->depth_after(piece_))) ++piece_;
    position_ = rates_->position(piece_, depth);
    return true;
  }

  /// Puts the walk at a distance chosen by the estimator itself (marches).
  void jump(Real position) { position_ = position; }

  Real position() const { return position_; }
  std::size_t piece() const { return piece_; }
  /// Tentative collisions that `next` has drawn since the flight started.
  std::uint32_t collisions() const { return collisions_; }
  /// Sampling rate mub at the position, 1/length.
  Real rate() const { return rates_->rate(piece_); }
  /// int rate from the ray's begin to the position, and from the position to the ray's end.
  Real depth() const { return depth_; }
  Real depth_left() const { return rates_->total_depth() - depth_; }
  Real total_depth() const { return rates_->total_depth(); }

 private:
  bool fly(auto& rng) {
    const Real depth = depth_ + rng.exponential();
    // Most flights stay in their cell: only those that leave it ask for the rule.
    if (depth < rates_->total_depth() && depth < rates_->depth_after(piece_)) {
      depth_ = depth;
      position_ = rates_->position(piece_, depth);
      return true;
    }
    if (rates_->crossing() == Crossing::rewind) return rewind(depth, rng);
    return advance_to(depth);
  }

  /// Cuts a flight to `depth` at the end of its cell, and others after it, until one ends inside its cell or the ray is left.
  [[gnu::noinline]] bool rewind(Real depth, auto& rng) {
    for (;;) {
      while (piece_ + 1 < rates_->size() && !(depth_ < rates_->depth_after(piece_))) ++piece_;
      if (!(depth_ < rates_->depth_after(piece_))) break;
      if (depth < rates_->depth_after(piece_)) return advance_to(depth);
      depth_ = rates_->depth_after(piece_);
      if (!(depth_ < rates_->total_depth())) break;
      depth = depth_ + rng.exponential();
    }
    position_ = rates_->end();
    return false;
  }

  const Rates* rates_ = nullptr;
  std::size_t piece_ = 0;
  std::uint32_t collisions_ = 0;
  Real depth_ = 0, position_ = 0;
};

}  // namespace nullmark
