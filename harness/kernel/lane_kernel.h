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
/// same steps, and in double the same samples bit for bit.  All walks of a block take a step together.  Walks that end with it
/// leave the block after it, and the block's last walks take their places.  An estimator takes part by `static constexpr bool
/// kLanes = true`, with a Walk of Value, Distance<Value>, Truth<Value> and structs of them, and with functions that take ray,
/// flight and stream as auto.  Lanes answer transmittance and optical depth.  In double the base answers the other quantities;
/// float has no others.
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
  static constexpr std::size_t kSample = 0, kPiece = 1, kWalk = 4, kStream = kWalk + sizeof(typename E::Walk) / sizeof(Pack);
  static constexpr std::size_t kNumbers = sizeof(Walks) / sizeof(Pack);
  /// From this number of the walk on only lookups that complete something change it.
  static constexpr std::size_t kComplete = [] {
    constexpr bool has = requires(typename E::Walk walk) { walk.complete; };
    static_assert(has || !Traits::kCompletes, "with `completes`, Walk has a last member `complete`");
    if constexpr (has && Traits::kCompletes) {
      static_assert(offsetof(typename E::Walk, complete) + sizeof(E::Walk::complete) == sizeof(typename E::Walk),
                    "with `completes`, the last member of Walk is `complete`");
      return kStream - sizeof(E::Walk::complete) / sizeof(Pack);
    }
    return kStream;
  }();
  /// Rows of a multiple of 2 KiB would let loads wait for stores to other rows, whose addresses have the same low bits.
  static constexpr std::size_t kRow = kBlock + HWY_MAX_BYTES / sizeof(T);
  struct State final : Base::State {
    /// [number of a walk][walk]; whole registers may be read at the end.
    alignas(HWY_MAX_BYTES) std::array<std::array<T, kRow>, kNumbers> numbers{};
    alignas(HWY_MAX_BYTES) std::array<std::array<T, kRow>, 3> points{};  ///< [axis][walk]
    alignas(HWY_MAX_BYTES) std::array<T, kRow * C> extinction{};
    std::array<std::uint32_t, kRow> ended{};  ///< lanes of the walks that end with this step
    /// Of the walks that have left: their numbers and samples; whole registers are read at the end.
    alignas(HWY_MAX_BYTES) std::array<std::array<T, kRow>, kStream - kWalk> left_walk{};
    alignas(HWY_MAX_BYTES) std::array<T, kRow> left_sample{};
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
    std::size_t count = 0;  ///< of walks
    std::size_t walks = 0;  ///< that have not left, in the first lanes
    std::size_t ended = 0;  ///< of them, with this step
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
    Pack allowed = largest_allowed(majorant.template rate<false>(Index(0)));  ///< where the rates have one piece
    std::array<T, 3> origin = narrowed(context.local.origin), direction = narrowed(context.local.direction);
    /// Along which axes; coordinates along the others keep their value from the begin of the block.
    std::array<bool, 3> moves = {direction[0] != 0, direction[1] != 0, direction[2] != 0};
    /// The spectrum that multiplies a grey field, where the medium is such a product; the field is then looked up.
    std::conditional_t<(C > 1), std::optional<Value>, std::monostate> factors = {};

    static std::array<T, 3> narrowed(const Vec3& v) {
      return {static_cast<T>(v.x()), static_cast<T>(v.y()), static_cast<T>(v.z())};
    }

    [[gnu::flatten]] void block(std::size_t count) {
      Tally tally{.count = count, .walks = count};
      if constexpr (kKeeps) begin_kept(count);
      const Medium* field = &medium;
      // One number a lookup, multiplied in registers, takes less time than a spectrum in memory.
      if constexpr (C > 1)
        if (const auto parts = medium.scaled()) field = parts->grey, factors = Value(parts->factors);
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (!moves[axis]) std::fill_n(state.points[axis].begin(), (count + N - 1) / N * N, origin[axis]);
      for (std::size_t k = 0; k < count; k += N) set_out(k, tally);
      take_out_ended(0, tally);
      for (std::uint32_t step = 1; tally.walks > 0; ++step) {
        if (step % Base::kStepsBetweenStops == 0 && state.stop()) return;
        if (step == state.most_lookups) {
          counters.overruns += tally.walks;
          break;
        }
        const auto& [x, y, z] = state.points;
        field->extinction(BasicPoints<T>{x.data(), y.data(), z.data(), looked_up(tally.walks)}, state.extinction.data());
        if (rates.has_several())
          go_on<true>(step, tally);
        else
          go_on<false>(step, tally);
        take_out_ended(step, tally);
      }
      write_results(count - tally.walks);
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
      flight.start(majorant);
      kernel.estimator_.init(walks.walk, state.ray, flight, rng);
      bits(walks.sample).store(&state.numbers[kSample][k]);
      propose(k, walks, there, flight, rng, tally);
    }

    /// One step of all walks.  What the loop reads is copied first: the compiler must assume that a register's store changes
    /// anything else.
    template <bool several>
    [[gnu::always_inline]] void go_on(std::uint32_t step, Tally& tally) {
      Run here = *this;
      bool completes = true;
      if constexpr (Traits::kCompletes) completes = kernel.estimator_.completes(state.ray, step);
      for (std::size_t k = 0; k < tally.walks; k += N) here.template step_on<several>(k, step, completes, tally);
    }

    template <bool several>
    [[gnu::always_inline]] void step_on(std::size_t k, std::uint32_t step, bool completes, Tally& tally) {
      const Mask alive = there(k, tally);
      Walks walks;
      walks.place.piece = Index(0);
      walks.each_moving([&](auto& lanes, std::size_t n) __attribute__((always_inline)) {
        if (may_change<several>(n, completes)) load(lanes, state.numbers[n], k);
      });
      LaneFlight<T, N, several> flight(rates, walks.place, step);
      Streams rng(walks.stream, alive, std::min(N, tally.walks - k));
      const Value extinction = extinction_at(k);
      if constexpr (!Traits::kIgnoresMajorant) {
        const Pack bound = majorant.template rate<several>(flight.piece());
        audit_majorant(largest(extinction), bound, several ? largest_allowed(bound) : allowed, alive, tally.violations,
                       counters.largest_violation);
      }
      kernel.estimator_.consume(walks.walk, state.ray, flight, extinction, rng);
      // Weights that went on shrinking in idle lanes would become denormal, and such numbers take hundreds of cycles.  Truths go
      // on: a tracker may ask whether one holds in all lanes.
      if (k + N > tally.walks)
        walks.each_of_walk([&](auto& lanes, std::size_t n) __attribute__((always_inline)) {
          if constexpr (std::is_same_v<std::remove_cvref_t<decltype(lanes)>, Pack>)
            if (may_change<several>(n, completes)) lanes = select(alive, lanes, Pack::load(&state.numbers[n][k]));
        });
      if constexpr (kKeeps)
        kernel.estimator_.keep(walks.walk, state.ray, flight, alive, [&](std::size_t lane) -> OneWalk& {
          return state.kept[sample_at(state.numbers[kSample], k + lane)];
        });
      propose(k, walks, alive, flight, rng, tally, completes);
    }

    /// Whether a step may change a number.
    template <bool several>
    static bool may_change(std::size_t n, bool completes) {
      return (n != kPiece || several) && (completes || n < kComplete || n >= kStream);
    }

    /// Computes the next points of the walks.
    template <bool several>
    [[gnu::always_inline]] void propose(std::size_t k, Walks& walks, Mask alive, LaneFlight<T, N, several>& flight, Streams& rng,
                                        Tally& tally, bool completes = true) {
      const Mask goes_on = alive & kernel.estimator_.propose(walks.walk, state.ray, flight, rng), ends = alive & !goes_on;
      tally.draws += rng.draws();
      if constexpr (requires { kernel.estimator_.real_collisions(walks.walk, state.ray); })
        tally.real += count(ends & kernel.estimator_.real_collisions(walks.walk, state.ray));
      store_numbers(ends, static_cast<std::uint32_t>(k), &state.ended[tally.ended]);
      tally.ended += count(ends);
      walks.each_moving([&](auto& lanes, std::size_t n) __attribute__((always_inline)) {
        if (may_change<several>(n, completes)) bits(lanes).store(&state.numbers[n][k]);
      });
      const Pack t = walks.place.position;
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (moves[axis]) (Pack(origin[axis]) + t * Pack(direction[axis])).store(&state.points[axis][k]);
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

    /// Takes the walks that have ended out of the block; its last walks take their places.  From the last one on, so that a walk
    /// that moves has not ended.  The walks of a march end together, and leave row by row.
    [[gnu::noinline]] void take_out_ended(std::uint32_t step, Tally& tally) {
      const std::size_t ended = tally.ended, stay = tally.walks - ended;
      tally.lookups += ended * step;
      tally.walks = stay;
      tally.ended = 0;
      if (stay == 0 && ended > N) return take_out_rows(ended, step, tally.count - ended);
      for (std::size_t i = ended; i-- > 0;) {
        const std::size_t k = state.ended[i], last = stay + i, left = tally.count - 1 - last;
        lookups[sample_at(state.numbers[kSample], k)] = step;
        state.left_sample[left] = state.numbers[kSample][k];
        for (std::size_t n = 0; n < state.left_walk.size(); ++n) state.left_walk[n][left] = state.numbers[kWalk + n][k];
        for (std::size_t n = 0; n < kNumbers; ++n)
          if (n != kPiece || rates.has_several()) state.numbers[n][k] = state.numbers[n][last];
        for (std::size_t axis = 0; axis < 3; ++axis)
          if (moves[axis]) state.points[axis][k] = state.points[axis][last];
      }
    }

    void take_out_rows(std::size_t ended, std::uint32_t step, std::size_t left) {
      for (std::size_t k = 0; k < ended; ++k) lookups[sample_at(state.numbers[kSample], k)] = step;
      std::copy_n(state.numbers[kSample].begin(), ended, state.left_sample.begin() + left);
      for (std::size_t n = 0; n < state.left_walk.size(); ++n)
        std::copy_n(state.numbers[kWalk + n].begin(), ended, state.left_walk[n].begin() + left);
    }

    [[gnu::noinline]] void write_results(std::size_t left) {
      if constexpr (kKeeps) {
        for (std::size_t i = 0; i < left; ++i) {
          const std::size_t sample = sample_at(state.left_sample, i);
          kernel.one().finish(state.kept[sample], state.ray);
          store(kernel.one().result(state.kept[sample], state.ray), &values[sample * C]);
        }
      } else {
        for (std::size_t k = 0; k < left; k += N) {
          Walks walks;
          walks.each_of_walk([&](auto& number, std::size_t n)
                                 __attribute__((always_inline)) { load(number, state.left_walk[n - kWalk], k); });
          const Value answer = this->answer(walks);
          std::array<std::array<T, N>, C> results;
          for (std::size_t c = 0; c < C; ++c) channel(answer, c).store(results[c].data());
          for (std::size_t lane = 0; lane < std::min(N, left - k); ++lane)
            for (std::size_t c = 0; c < C; ++c) values[sample_at(state.left_sample, k + lane) * C + c] = results[c][lane];
        }
      }
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
