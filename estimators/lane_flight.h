#pragma once

#include "estimators/flight.h"
#include "estimators/lane_rng.h"

namespace nullmark {

/// Flight for N walks of one ray side by side: the same steps in the same order for every lane.
template <class T, std::size_t N>
class LaneFlight {
 public:
  using Pack = Lanes<T, N>;
  using Mask = LaneMask<T, N>;
  using Index = LaneIndex<T, N>;
  using Streams = LaneRng<T, N>;

  /// The rates that all walks of a ray fly through, rounded to T.
  class Course {
   public:
    Course() = default;
    explicit Course(const Rates& rates)
        : pieces_(rates.size() > 0 ? rates.pieces<T>() : &kVacuum),
          last_(rates.size() > 0 ? static_cast<Number>(rates.size()) - 1 : 0),
          begin_(static_cast<T>(rates.begin())),
          end_(static_cast<T>(rates.end())),
          total_(static_cast<T>(rates.total_depth())),
          rewinds_(last_ > 0 && rates.crossing() == Crossing::rewind) {}

    bool has_several() const { return last_ > 0; }
    Pack rate(Index piece) const { return of<&RatePiece<T>::rate>(piece); }

   private:
    friend LaneFlight;
    using Number = typename Index::Number;
    static constexpr RatePiece<T> kVacuum{};

    template <auto member>
    [[gnu::always_inline]] Pack of(Index piece) const {
      static_assert(sizeof(RatePiece<T>) == 6 * sizeof(T));
      return last_ == 0 ? Pack(pieces_->*member) : piece.template gathered<6>(&(pieces_->*member));
    }

    const RatePiece<T>* pieces_ = &kVacuum;
    Number last_ = 0;
    T begin_ = 0, end_ = 0, total_ = 0;
    bool rewinds_ = false;
  };

  /// Where the walks are.
  struct Place {
    Pack depth, position;
    Index piece;
  };

  LaneFlight(Course& course, Place& at) : course_(course), at_(at) {}

  void start(const Rates& rates) {
    course_ = Course(rates);
    at_ = {Pack(0), Pack(course_.begin_), Index(0)};
  }

  [[gnu::always_inline]] Mask next(Streams& rng) { return next(rng, true); }

  /// Lanes whose walk is no longer alive leave with this step.
  [[gnu::always_inline]] Mask next(Streams& rng, Mask alive) {
    const Pack depth = at_.depth + rng.exponential();
    rng.forget(!alive);
    if (course_.rewinds_) {
      // By value: what a call could reach would not stay in registers.
      const Rewound rewound = rewind(course_, at_, depth, rng.state(), rng.alive(), alive);
      at_ = rewound.at;
      rng.go_on(rewound.stream, rewound.draws);
      return rewound.inside;
    }
    return advance_to(depth, alive);
  }

  /// Moves forwards to points of the given depths; false (and the ray's end) for lanes whose ray is not that deep.
  [[gnu::always_inline]] Mask advance_to(Pack depth, Mask alive = true) {
    const Mask inside = alive & (depth < Pack(course_.total_));
    at_.depth = depth;
    if (course_.last_ > 0) {
      for (;;) {
        const Mask behind = inside & !(depth < course_.template of<&RatePiece<T>::depth_after>(at_.piece));
        if (none(behind)) break;
        at_.piece = select(behind, at_.piece + Index(1), at_.piece);
      }
    }
    at_.position = select(inside, position(course_, at_), Pack(course_.end_));
    return inside;
  }

  void jump(Pack position) { at_.position = position; }

  Pack position() const { return at_.position; }
  Index piece() const { return at_.piece; }
  Pack rate() const { return course_.rate(at_.piece); }
  Pack depth() const { return at_.depth; }
  Pack depth_left() const { return Pack(course_.total_) - at_.depth; }
  Pack total_depth() const { return course_.total_; }

 private:
  struct Rewound {
    Place at;
    typename Streams::State stream;
    std::uint64_t draws;
    Mask inside;
  };

  [[gnu::always_inline]] static Pack position(const Course& course, const Place& at) {
    using Piece = RatePiece<T>;
    const Pack begin = course.template of<&Piece::begin>(at.piece), end = course.template of<&Piece::end>(at.piece);
    const Pack before = course.template of<&Piece::depth_before>(at.piece);
    return smaller(end, begin + (at.depth - before) * course.template of<&Piece::inverse_rate>(at.piece));
  }

  /// See Flight::rewind.
  [[gnu::noinline]] static Rewound rewind(const Course& course, Place at, Pack depth, typename Streams::State stream, Mask living,
                                          Mask flying) {
    Streams rng(stream, living);
    const Index last(course.last_);
    Mask inside = false;
    for (;;) {
      Pack after = course.template of<&RatePiece<T>::depth_after>(at.piece);
      for (;;) {
        const Mask behind = flying & !(at.depth < after) & (at.piece < last);
        if (none(behind)) break;
        at.piece = select(behind, at.piece + Index(1), at.piece);
        after = course.template of<&RatePiece<T>::depth_after>(at.piece);
      }
      flying = flying & (at.depth < after);
      const Mask lands = flying & (depth < after);
      at.depth = select(lands, depth, select(flying, after, at.depth));
      inside = inside | lands;
      flying = flying & !lands & (at.depth < Pack(course.total_));
      if (none(flying)) break;
      const Pack drawn = rng.exponential(flying);
      depth = select(flying, at.depth + drawn, depth);
    }
    at.position = select(inside, position(course, at), Pack(course.end_));
    return {at, stream, rng.draws(), inside};
  }

  Course& course_;
  Place& at_;
};

}  // namespace nullmark
