#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <optional>
#include <variant>

#include "estimators/walk/lane_flight.h"
#include "harness/kernel/block_kernel.h"
#include "harness/kernel/lane_registers.h"
#include "media/base/colour_lanes.h"

namespace nullmark {

/// The loop of BlockKernel with N walks per register, over C channels: the same estimator source over Lanes or LaneColours, the
/// same steps, and in double the same samples bit for bit.  All walks of a block take a step together.  The numbers of an ended
/// walk stay what they were at its end until ended walks leave the block and the others are compacted.  An estimator takes part
/// by `static constexpr bool kLanes = true`, with a Walk of Value, Distance<Value>, Truth<Value> and structs of them, and with
/// functions that take ray, flight and stream as auto.  Lanes answer transmittance and optical depth.  In double the base answers
/// the other quantities; float has no others.
template <template <class> class Estimator, class T, std::size_t N = kNativeLanes<T>, std::size_t C = 1>
class LaneKernel final : public BlockKernel<Estimator, OfChannels<C>> {
  using Base = BlockKernel<Estimator, OfChannels<C>>;
  using Traits = EstimatorTraits<Estimator<OfChannels<C>>, OfChannels<C>>;
  using Pack = Lanes<T, N>;
  using Value = LaneValue<T, N, C>;
  using Mask = LaneMask<T, N>;
  using Index = LaneIndex<T, N>;
  using E = Estimator<Value>;
  using Rates = LaneRates<T, N>;
  using Streams = LaneRng<T, N>;

  static constexpr bool kSingle = !std::is_same_v<T, Real>;
  using OneWalk = typename Estimator<OfChannels<C>>::Walk;
  static constexpr bool kKeeps = requires { typename E::Kept; };
  /// Walks whose numbers fit the L1 cache together, or as many as the estimator keeps.
  static constexpr std::size_t kBlock = [] {
    if constexpr (kKeeps) return E::Kept::kTogether;
    return 2048 / sizeof(T);
  }();

  static_assert(kBlock % N == 0, "a tracker's Kept::kTogether is a multiple of 16, so that a block has whole registers");

  /// N walks.  All registers have the same lane order, so one permutation compacts them.
  struct Walks {
    LanePlace<T, N> place;
    typename E::Walk walk;
    typename Streams::State stream;
    Index sample;

    /// Visits every register that a step may change, with its index in the state.
    template <class Visit>
    [[gnu::always_inline]] void each_moving(const Visit& visit) {
      std::size_t n = kPiece;
      const auto next = [&](auto& lanes) __attribute__((always_inline)) { visit(lanes, n++); };
      next(place.piece);
      next(place.depth);
      next(place.position);
      each_register(walk, next);
      for (auto& word : stream) next(word);
    }

    /// Those of the estimator.
    template <class Visit>
    [[gnu::always_inline]] void each_of_walk(const Visit& visit) {
      std::size_t n = kWalk;
      each_register(
          walk, [&](auto& lanes) __attribute__((always_inline)) { visit(lanes, n++); });
    }
  };
  static constexpr std::size_t kNumbers = sizeof(Walks) / sizeof(Pack), kSample = 0, kPiece = 1, kWalk = 4;

  /// Rows of a multiple of 2 KiB would let loads wait for stores to other rows, whose addresses have the same low bits.
  static constexpr std::size_t kRow = kBlock + HWY_MAX_BYTES / sizeof(T);
  struct State final : Base::State {
    /// [number of a walk][walk]; whole registers may be read at the end.
    alignas(HWY_MAX_BYTES) std::array<std::array<T, kRow>, kNumbers> numbers{};
    alignas(HWY_MAX_BYTES) std::array<std::array<T, kRow>, 3> points{};  ///< [axis][walk]
    alignas(HWY_MAX_BYTES) std::array<T, kRow * C> extinction{};
    alignas(HWY_MAX_BYTES) std::array<T, kRow> steps{};  ///< of walks that have ended, as the bits of an Index
    std::array<std::uint8_t, kBlock / N * Mask::kBytes> ended{};
    /// Numbers of ended walks after compaction, and their results; whole registers are written at the end.
    alignas(HWY_MAX_BYTES) std::array<std::array<T, kRow>, sizeof(typename E::Walk) / sizeof(Pack)> left_walk{};
    alignas(HWY_MAX_BYTES) std::array<T, kRow> left_sample{}, left_steps{};
    alignas(HWY_MAX_BYTES) std::array<std::array<T, kRow>, C> left_result{};
    std::array<OneWalk, kKeeps ? kBlock : 0> kept;  ///< of each sample of the block
  };

 public:
  LaneKernel(const Estimator<OfChannels<C>>& estimator, const E& in_lanes)
      : Base(estimator, static_cast<int>(C)), estimator_(in_lanes) {}

  std::unique_ptr<Workspace> workspace() const override { return std::make_unique<State>(); }

  bool answers(Quantity quantity) const override { return Base::answers(quantity) && (!kSingle || in_lanes(quantity)); }

  bool in_lanes(Quantity quantity) const override {
    return quantity == Quantity::transmittance || quantity == Quantity::optical_depth;
  }

  bool flies() const override { return !kSingle && Base::flies(); }

  void sample(Workspace& workspace, const Medium& medium, const PreparedRay& context, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity quantity, SampleBlock& out, Counters& counters) const override {
    State& state = static_cast<State&>(workspace);
    // One walk would leave all lanes but its own idle.
    if (!kSingle && (state.recording || !in_lanes(quantity) || count == 1))
      return Base::sample(workspace, medium, context, key, first, count, quantity, out, counters);
    out.values.resize(count * C);
    out.lookups.resize(count);
    counters.samples += count;
    for (std::size_t done = 0; done < count; done += kBlock)
      Run{*this,
          state,
          medium,
          context,
          {key, context.index, first + done},
          quantity,
          &out.values[done * C],
          &out.lookups[done],
          counters}
          .block(std::min(kBlock, count - done));
  }

 private:
  /// Counts of a block.
  struct Tally {
    std::uint64_t draws = 0, lookups = 0, real = 0, violations = 0;
    std::size_t walks = 0;  ///< in the first lanes, including walks that ended since the last compaction
    std::size_t dead = 0;   ///< lanes of ended walks
  };

  /// One block of samples in progress.  Code that runs once per block is not inlined, and all of a step is, so the code of a step
  /// does not depend on what else the file holds.
  struct Run {
    const LaneKernel& kernel;
    State& state;
    const Medium& medium;
    const PreparedRay& context;
    SampleAddress first;
    Quantity quantity;
    Real* values;
    std::uint32_t* lookups;
    Counters& counters;
    Rates rates = {}, majorant = Rates(state.ray.majorant);
    std::array<T, 3> origin = narrowed(context.local.origin), direction = narrowed(context.local.direction);
    /// The spectrum that multiplies a grey field, where the medium is such a product; the field is then looked up.
    std::conditional_t<(C > 1), std::optional<Value>, std::monostate> factors = {};

    static std::array<T, 3> narrowed(const Vec3& v) {
      return {static_cast<T>(v.x()), static_cast<T>(v.y()), static_cast<T>(v.z())};
    }

    /// Coordinates along which the ray does not move keep the value from the begin of the block.
    bool moves_along(std::size_t axis) const { return direction[axis] != 0; }

    [[gnu::flatten]] void block(std::size_t count) {
      Tally tally{.walks = count};
      if constexpr (kKeeps) begin_kept(count);
      std::size_t lanes = (count + N - 1) / N * N;
      const Medium* field = &medium;
      // One number a lookup, multiplied in registers, takes less time than a spectrum in memory.
      if constexpr (C > 1)
        if (const auto parts = medium.scaled()) field = parts->grey, factors = Value(parts->factors);
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (!moves_along(axis)) std::fill_n(state.points[axis].begin(), lanes, origin[axis]);
      for (std::size_t k = 0; k < lanes; k += N) set_out(k, tally);
      lanes = close_ranks(lanes, tally);
      for (std::uint32_t step = 1; lanes > 0; ++step) {
        if (step % Base::kStepsBetweenStops == 0 && state.stop()) return;
        if (step == state.most_lookups) {
          counters.overruns += lanes - tally.dead;
          break;
        }
        const auto& [x, y, z] = state.points;
        field->extinction(BasicPoints<T>{x.data(), y.data(), z.data(), looked_up(tally.walks)}, state.extinction.data());
        if (rates.has_several())
          go_on<true>(lanes, step, tally);
        else
          go_on<false>(lanes, step, tally);
        // Moving walks costs more than idle lanes do, until a quarter of them idles.
        if (4 * tally.dead >= lanes) lanes = close_ranks(lanes, tally);
      }
      counters.draws += tally.draws;
      counters.lookups += tally.lookups;
      counters.violations += tally.violations;
      if constexpr (!Traits::kIgnoresMajorant) counters.null_collisions += tally.lookups - tally.real;
    }

    [[gnu::always_inline]] Value extinction_at(std::size_t k) const {
      if constexpr (C > 1)
        if (factors) return *factors * Value(Pack::load(&state.extinction[k]));
      return Value::load(&state.extinction[k * C]);
    }

    /// Number of lanes that look the medium up.  Where the last register is at most half full, its walks look up one by one: the
    /// lookups of its idle lanes may cost more than a step.
    static std::size_t looked_up(std::size_t walks) { return walks % N <= N / 2 ? walks : (walks + N - 1) / N * N; }

    /// Lanes from k on that hold a walk; all but the last register are full.
    [[gnu::always_inline]] static Mask there(std::size_t k, const Tally& tally) {
      return k + N <= tally.walks ? Mask(true) : Mask::first(tally.walks - k);
    }

    [[gnu::noinline, gnu::flatten]] void set_out(std::size_t k, Tally& tally) {
      const Mask there = this->there(k, tally);
      Walks walks;
      walks.stream = Streams::seeded({first.key, first.ray, first.sample + k});
      walks.sample = Index::counting_from(static_cast<typename Index::Number>(k));
      LaneFlight<T, N> flight(rates, walks.place, 0);
      Streams rng(walks.stream, there);
      flight.start(state.ray.majorant);
      kernel.estimator_.init(walks.walk, state.ray, flight, rng);
      bits(walks.sample).store(&state.numbers[kSample][k]);
      propose(k, walks, there, false, flight, rng, 0, tally);
      tally.dead += N - count(there);
    }

    /// One step of all walks.  What the loop reads is copied first: the compiler must assume that a register's store changes
    /// anything else.
    template <bool several>
    [[gnu::always_inline]] void go_on(std::size_t lanes, std::uint32_t step, Tally& tally) {
      Run here = *this;
      for (std::size_t k = 0; k < lanes; k += N) here.template step_on<several>(k, step, tally);
    }

    template <bool several>
    [[gnu::always_inline]] void step_on(std::size_t k, std::uint32_t step, Tally& tally) {
      const Mask ended = Mask::load(&state.ended[k / N * Mask::kBytes]), alive = there(k, tally) & !ended;
      Walks walks;
      walks.place.piece = Index(0);
      walks.each_moving([&](auto& lanes, std::size_t n) __attribute__((always_inline)) {
        if (n != kPiece || several) load(lanes, state.numbers[n], k);
      });
      LaneFlight<T, N, several> flight(rates, walks.place, step);
      Streams rng(walks.stream, alive);
      const Value extinction = extinction_at(k);
      if constexpr (!Traits::kIgnoresMajorant)
        audit_majorant(largest(extinction), majorant.template rate<several>(flight.piece()), alive, tally.violations,
                       counters.largest_violation);
      kernel.estimator_.consume(walks.walk, state.ray, flight, extinction, rng);
      if constexpr (kKeeps)
        kernel.estimator_.keep(walks.walk, state.ray, flight, alive, [&](std::size_t lane) -> OneWalk& {
          return state.kept[sample_at(state.numbers[kSample], k + lane)];
        });
      propose(k, walks, alive, ended, flight, rng, step, tally);
    }

    /// Computes the next points of the walks.  The numbers of an ended walk stay what they were at its end.
    template <bool several>
    [[gnu::always_inline]] void propose(std::size_t k, Walks& walks, Mask alive, Mask ended, LaneFlight<T, N, several>& flight,
                                        Streams& rng, std::uint32_t step, Tally& tally) {
      const Mask goes_on = alive & kernel.estimator_.propose(walks.walk, state.ray, flight, rng), ends = alive & !goes_on;
      tally.draws += rng.draws();
      tally.dead += count(ends);
      if constexpr (requires { kernel.estimator_.real_collisions(walks.walk, state.ray); })
        tally.real += count(ends & kernel.estimator_.real_collisions(walks.walk, state.ray));
      if (step > 0)
        walks.each_of_walk([&](auto& lanes, std::size_t n) __attribute__((always_inline)) {
          auto before = lanes;
          load(before, state.numbers[n], k);
          lanes = select(ended, before, lanes);
        });
      bits(Index(static_cast<typename Index::Number>(step))).store(&state.steps[k], ends);
      (ended | ends).store(&state.ended[k / N * Mask::kBytes]);
      walks.each_moving([&](auto& lanes, std::size_t n) __attribute__((always_inline)) {
        if (n == kPiece && !several) return;
        bits(lanes).store(&state.numbers[n][k]);
      });
      const Pack t = walks.place.position;
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (moves_along(axis)) (Pack(origin[axis]) + t * Pack(direction[axis])).store(&state.points[axis][k]);
    }

    /// Begins what the estimator keeps of each sample.
    [[gnu::noinline]] void begin_kept(std::size_t count) {
      for (std::size_t i = 0; i < count; ++i) kernel.one().begin(state.kept[i], state.ray);
    }

    static std::size_t sample_at(const std::array<T, kRow>& samples, std::size_t k) {
      return static_cast<std::size_t>(std::bit_cast<typename Index::Number>(samples[k]));
    }

    Value answer(const Walks& walks) const {
      if constexpr (requires { kernel.estimator_.optical_depth(walks.walk, state.ray); })
        if (quantity == Quantity::optical_depth) return kernel.estimator_.optical_depth(walks.walk, state.ray);
      return kernel.estimator_.result(walks.walk, state.ray);
    }

    /// Writes out the results of ended walks and compacts the others; returns the number of lanes that these take.
    [[gnu::noinline]] std::size_t close_ranks(std::size_t lanes, Tally& tally) {
      std::size_t kept = 0, left = 0;
      for (std::size_t k = 0; k < lanes; k += N) {
        const Mask dead = Mask::load(&state.ended[k / N * Mask::kBytes]), alive = there(k, tally) & !dead;
        const auto close = [k](const ClosedRanks<T, N>& ranks, const auto& from, auto& to, std::size_t at) {
          Pack(ranks(Pack::load(&from[k]).vector())).store(&to[at]);
        };
        const ClosedRanks<T, N> close_dead(dead), close_living(alive);
        for (std::size_t n = 0; n < state.left_walk.size(); ++n)
          close(close_dead, state.numbers[kWalk + n], state.left_walk[n], left);
        close(close_dead, state.steps, state.left_steps, left);
        close(close_dead, state.numbers[kSample], state.left_sample, left);
        left += count(dead);
        for (std::size_t n = 0; n < kNumbers; ++n)
          if (n != kPiece || rates.has_several()) close(close_living, state.numbers[n], state.numbers[n], kept);
        for (std::size_t axis = 0; axis < 3; ++axis)
          if (moves_along(axis)) close(close_living, state.points[axis], state.points[axis], kept);
        kept += count(alive);
      }
      if constexpr (!kKeeps)
        for (std::size_t i = 0; i < left; i += N) {
          Walks walks;
          walks.each_of_walk([&](auto& number, std::size_t n)
                                 __attribute__((always_inline)) { load(number, state.left_walk[n - kWalk], i); });
          const Value answer = this->answer(walks);
          for (std::size_t c = 0; c < C; ++c) channel(answer, c).store(&state.left_result[c][i]);
        }
      for (std::size_t i = 0; i < left; ++i) {
        const std::size_t sample = sample_at(state.left_sample, i);
        if constexpr (kKeeps) {
          kernel.one().finish(state.kept[sample], state.ray);
          store(kernel.one().result(state.kept[sample], state.ray), &values[sample * C]);
        } else {
          for (std::size_t c = 0; c < C; ++c) values[sample * C + c] = state.left_result[c][i];
        }
        lookups[sample] = static_cast<std::uint32_t>(std::bit_cast<typename Index::Number>(state.left_steps[i]));
        tally.lookups += lookups[sample];
      }
      lanes = (kept + N - 1) / N * N;
      for (std::size_t k = 0; k < lanes; k += N) Mask(false).store(&state.ended[k / N * Mask::kBytes]);
      tally.dead = lanes - kept;
      tally.walks = kept;
      return lanes;
    }

    /// Reads a register of a row, from the k-th walk on.
    template <class Number>
    [[gnu::always_inline]] static void load(Number& lanes, const std::array<T, kRow>& row, std::size_t k) {
      lanes = Number(hn::BitCast(hn::DFromV<decltype(raw(lanes))>(), Pack::load(&row[k]).vector()));
    }

    static auto raw(const auto& lanes) {
      if constexpr (requires { lanes.vector(); })
        return lanes.vector();
      else
        return lanes;
    }

    /// Any register, as stored among the numbers.
    static Pack bits(const auto& lanes) { return hn::BitCast(typename Pack::Tag(), raw(lanes)); }
  };

  E estimator_;
};

/// The estimator in registers of this build's width.
template <template <class> class Estimator, class T, std::size_t C = 1>
using LanesOf = Estimator<LaneValue<T, kNativeLanes<T>, C>>;

/// Whether all functions of a walk over C channels accept lanes.
template <template <class> class Estimator, std::size_t C = 1>
constexpr bool runs_in_lanes() {
  if constexpr (requires { requires Estimator<Real>::kLanes; }) {
    using E = LanesOf<Estimator, Real, C>;
    using Along = typename detail::RayDataOf<Estimator<OfChannels<C>>, OfChannels<C>>::type;
    constexpr std::size_t kWidth = kNativeLanes<Real>;
    return requires(const E& e, typename E::Walk& walk, const Along& ray, LaneFlight<Real, kWidth>& flight,
                    LaneRng<Real, kWidth>& rng, const LaneValue<Real, kWidth, C>& extinction) {
      e.init(walk, ray, flight, rng);
      e.propose(walk, ray, flight, rng);
      e.consume(walk, ray, flight, extinction, rng);
      requires requires { typename E::Kept; } || requires {
        e.result(walk, ray);
      };
    };
  } else {
    return false;
  }
}

}  // namespace nullmark
