#pragma once

#include <bit>
#include <type_traits>

#include "estimators/walk/flight.h"
#include "estimators/walk/lane_rng.h"

namespace nullmark {

/// The rates that all walks of a ray fly through, rounded to T.
template <class T, std::size_t N>
class LaneRates {
 public:
  using Pack = Lanes<T, N>;
  using Index = LaneIndex<T, N>;

  LaneRates() = default;
  explicit LaneRates(const Rates& rates)
      : pieces_(rates.pieces<T>()),
        last_(rates.size() > 0 ? static_cast<Number>(rates.size()) - 1 : 0),
        begin_(static_cast<T>(rates.begin())),
        end_(static_cast<T>(rates.end())),
        total_(static_cast<T>(rates.total_depth())),
        rewinds_(last_ > 0 && rates.crossing() == Crossing::rewind) {}

  bool has_several() const { return last_ > 0; }
  template <bool several>
  Pack rate(Index piece) const {
    return of<several, &RatePiece<T>::rate>(piece);
  }

 private:
  template <class, std::size_t, bool>
  friend class LaneFlight;
  using Number = typename Index::Number;

  template <bool several, auto member>
  [[gnu::always_inline]] Pack of(Index piece) const {
    static_assert(sizeof(RatePiece<T>) == 6 * sizeof(T));
    return !several || last_ == 0 ? Pack(pieces_->*member) : piece.template gathered<6>(&(pieces_->*member));
  }

  const RatePiece<T>* pieces_ = nullptr;
  Number last_ = 0;
  T begin_ = 0, end_ = 0, total_ = 0;
  bool rewinds_ = false;
};

/// As LaneRates<T, N>(rates).rate<true>(piece), whose making would cost weighted decomposition 4 % more instructions.
template <class T, std::size_t N>
Lanes<T, N> rate_of(const Rates& rates, LaneIndex<T, N> piece) {
  const RatePiece<T>* const pieces = rates.pieces<T>();
  return rates.size() > 1 ? piece.template gathered<6>(&pieces->rate) : Lanes<T, N>(pieces->rate);
}

/// Where N walks are.
template <class T, std::size_t N>
struct LanePlace {
  Lanes<T, N> depth, position;
  LaneIndex<T, N> piece;
};

/// Flight for N walks of one ray side by side: the same steps in the same order for every lane.  Without `several` the rates have
/// one piece, as with one bound for the whole ray, and nothing is asked about others; an estimator that sets out on other
/// rates than the ray's does so in its init, which runs with `several`.
template <class T, std::size_t N, bool several = true>
class LaneFlight {
 public:
  using Pack = Lanes<T, N>;
  using Mask = LaneMask<T, N>;
  using Index = LaneIndex<T, N>;
  using Streams = LaneRng<T, N>;
  using Rates = LaneRates<T, N>;
  using Place = LanePlace<T, N>;
  using Number = typename Index::Number;

  LaneFlight(Rates& rates, Place& at, std::uint32_t lookups) : rates_(rates), at_(at), lookups_(lookups) {}

  /// See Flight::lookups.
  std::uint32_t lookups() const { return lookups_; }

  void start(const nullmark::Rates& rates) requires several { start(Rates(rates)); }
  void start(const Rates& rates) requires several {
    rates_ = rates;
    at_ = {Pack(0), Pack(rates_.begin_), Index(0)};
  }

  [[gnu::always_inline]] Mask next(Streams& rng) { return next(rng, true); }

  /// Lanes whose walk is no longer alive leave with this step.
  [[gnu::always_inline]] Mask next(Streams& rng, Mask alive) {
    const Pack depth = rng.exponential_beyond(at_.depth);
    rng.forget(!alive);
    if (several && rates_.rewinds_) {
      // By value: what a call could reach would not stay in registers.
      const Rewound rewound = rewind(rates_, at_, depth, rng.state(), rng.alive(), alive);
      at_ = rewound.at;
      rng.go_on(rewound.stream, rewound.draws);
      return rewound.inside;
    }
    return advance_to(depth, alive);
  }

  /// Moves forwards to points of the given depths; false (and the ray's end) for lanes whose ray is not that deep.
  [[gnu::always_inline]] Mask advance_to(Pack depth, Mask alive = true) {
    const Mask inside = alive & (depth < Pack(rates_.total_));
    at_.depth = depth;
    if (several && rates_.last_ > 0) {
      for (;;) {
        const Mask behind = inside & !(depth < rates_.template of<several, &RatePiece<T>::depth_after>(at_.piece));
        if (none(behind)) break;
        at_.piece = select(behind, at_.piece + Index(1), at_.piece);
      }
    }
    at_.position = select(inside, position(rates_, at_), Pack(rates_.end_));
    return inside;
  }

  /// Moves to points of the given depths, cell by cell from where the flights are.
  [[gnu::always_inline]] Mask travel_to(Pack depth, Mask alive) {
    if (several && rates_.last_ > 0) {
      for (;;) {
        const Mask ahead =
            alive & (Index(0) < at_.piece) & (depth < rates_.template of<several, &RatePiece<T>::depth_before>(at_.piece));
        if (none(ahead)) break;
        at_.piece = select(ahead, at_.piece + Index(-1), at_.piece);
      }
    }
    return advance_to(depth, alive);
  }

  /// Moves to points of the given depths, wherever the flights are.
  [[gnu::always_inline]] Mask land(Pack depth) {
    at_.piece = Index(0);
    if (several && rates_.last_ > 0) {
      // The last piece whose predecessor is not that deep.
      for (auto step = std::bit_floor(static_cast<std::make_unsigned_t<Number>>(rates_.last_)); step > 0; step /= 2) {
        const Index ahead = at_.piece + Index(static_cast<Number>(step)), known = smaller(ahead, Index(rates_.last_));
        const Mask behind =
            (ahead < Index(rates_.last_ + 1)) & !(depth < rates_.template of<several, &RatePiece<T>::depth_before>(known));
        at_.piece = select(behind, ahead, at_.piece);
      }
    }
    return advance_to(depth);
  }

  void jump(Pack position) { at_.position = position; }

  Pack position() const { return at_.position; }
  Index piece() const { return at_.piece; }
  Pack rate() const { return rates_.template rate<several>(at_.piece); }
  Pack inverse_rate() const { return rates_.template of<several, &RatePiece<T>::inverse_rate>(at_.piece); }
  Pack depth() const { return at_.depth; }
  Pack depth_left() const { return Pack(rates_.total_) - at_.depth; }
  Pack total_depth() const { return rates_.total_; }

 private:
  struct Rewound {
    Place at;
    typename Streams::State stream;
    std::uint64_t draws;
    Mask inside;
  };

  [[gnu::always_inline]] static Pack position(const Rates& rates, const Place& at) {
    using Piece = RatePiece<T>;
    const Pack begin = rates.template of<several, &Piece::begin>(at.piece);
    const Pack end = rates.template of<several, &Piece::end>(at.piece);
    Pack within = at.depth;
    if constexpr (several) within = within - rates.template of<several, &Piece::depth_before>(at.piece);
    return smaller(end, begin + within * rates.template of<several, &Piece::inverse_rate>(at.piece));
  }

  /// See Flight::rewind.
  [[gnu::noinline]] static Rewound rewind(const Rates& rates, Place at, Pack depth, typename Streams::State stream, Mask living,
                                          Mask flying) {
    Streams rng(stream, living);
    const Index last(rates.last_);
    Mask inside = false;
    for (;;) {
      Pack after = rates.template of<several, &RatePiece<T>::depth_after>(at.piece);
      for (;;) {
        const Mask behind = flying & !(at.depth < after) & (at.piece < last);
        if (none(behind)) break;
        at.piece = select(behind, at.piece + Index(1), at.piece);
        after = rates.template of<several, &RatePiece<T>::depth_after>(at.piece);
      }
      flying = flying & (at.depth < after);
      const Mask lands = flying & (depth < after);
      at.depth = select(lands, depth, select(flying, after, at.depth));
      inside = inside | lands;
      flying = flying & !lands & (at.depth < Pack(rates.total_));
      if (none(flying)) break;
      const Pack drawn = rng.exponential(flying);
      depth = select(flying, at.depth + drawn, depth);
    }
    at.position = select(inside, position(rates, at), Pack(rates.end_));
    return {at, stream, rng.draws(), inside};
  }

  Rates& rates_;
  Place& at_;
  std::uint32_t lookups_;
};

}  // namespace nullmark
