#pragma once

#include <cstddef>
#include <cstdint>

#include "media/majorants/rates.h"

namespace nullmark {

/// Where a walk is on its ray.  Flights live in majorant depth: the next tentative collision lies one unit exponential of depth
/// ahead, whatever cells are crossed, so a collision costs one logarithm and a crossing none.  With Crossing::rewind the flight
/// is cut at each cell's end and starts anew there; the depth it is cut at is where the next exponential counts from, so depths
/// follow the same law.  Cells of rate 0 are passed over without a draw; a ray that has no other costs one.
class Flight {
 public:
  /// Begins a walk.
  void set_out(const Rates& rates) {
    lookups_ = 0;
    start(rates);
  }
  void set_lookups(std::uint32_t lookups) { lookups_ = lookups; }

  /// Lookups that the loop has made for this walk.  In lanes too it is one number: the walks of a block look up together, and
  /// those that have ended ask no more.
  std::uint32_t lookups() const { return lookups_; }

  /// Begins anew, on rates of the estimator's own.
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
    if (!rates_->reaches(depth)) {
      position_ = rates_->end();
      return false;
    }
    while (!(depth < rates_->known(piece_).depth_after)) ++piece_;
    position_ = rates_->position(rates_->known(piece_), depth);
    return true;
  }

  /// Moves to the point of the given depth, wherever the flight is, as if it set out anew.
  bool land(Real depth) {
    piece_ = rates_->reaches(depth) ? rates_->piece_of(depth) : 0;
    return advance_to(depth);
  }

  /// The same, cell by cell from where the flight is: for points nearby.
  bool travel_to(Real depth) {
    while (piece_ > 0 && depth < rates_->known(piece_ - 1).depth_after) --piece_;
    return advance_to(depth);
  }

  /// Puts the walk at a distance chosen by the estimator itself (marches).
  void jump(Real position) { position_ = position; }

  Real position() const { return position_; }
  std::size_t piece() const { return piece_; }
  /// Tentative collisions that `next` has drawn since the flight started.
  std::uint32_t collisions() const { return collisions_; }
  /// Sampling rate mub at the position, 1/length.
  Real rate() const { return rates_->known(piece_).rate; }
  Real inverse_rate() const { return rates_->known(piece_).inverse_rate; }
  /// int rate from the ray's begin to the position, and from the position to the ray's end.
  Real depth() const { return depth_; }
  Real depth_left() const { return rates_->total_depth() - depth_; }
  Real total_depth() const { return rates_->total_depth(); }

 private:
  bool fly(auto& rng) {
    const Real depth = depth_ + rng.exponential();
    // Most flights stay in their cell: only those that leave it ask for the rule.
    if (depth < rates_->known(piece_).depth_after) {
      depth_ = depth;
      position_ = rates_->position(rates_->known(piece_), depth);
      return true;
    }
    if (rates_->crossing() == Crossing::rewind) return rewind(depth, rng);
    return advance_to(depth);
  }

  /// Cuts a flight to `depth` at the end of its cell, and others after it, until one ends inside its cell or the ray is left.
  [[gnu::noinline]] bool rewind(Real depth, auto& rng) {
    rates_->has(0);
    for (;;) {
      while (!(depth_ < rates_->known(piece_).depth_after) && rates_->has(piece_ + 1)) ++piece_;
      if (!(depth_ < rates_->known(piece_).depth_after)) break;
      if (depth < rates_->known(piece_).depth_after) return advance_to(depth);
      depth_ = rates_->known(piece_).depth_after;
      if (!rates_->reaches(depth_)) break;
      depth = depth_ + rng.exponential();
    }
    position_ = rates_->end();
    return false;
  }

  const Rates* rates_ = nullptr;
  std::size_t piece_ = 0;
  std::uint32_t collisions_ = 0, lookups_ = 0;
  Real depth_ = 0, position_ = 0;
};

/// Rate of a piece, or of each walk's piece in lanes.
inline Real rate_of(const Rates& rates, std::size_t piece) { return rates.rate(piece); }

/// (mub - mu)/mub where the walk is: the weight of a null collision.  At most 1, 0 where the majorant is tight, negative where it
/// is violated.  It multiplies by the inverse rate, which the flight knows, because a division takes as long as a random number.
template <class Value>
Value null_ratio(const auto& at, const Value& extinction) {
  return (at.rate() - extinction) * at.inverse_rate();
}

}  // namespace nullmark
