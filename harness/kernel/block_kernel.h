#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>

#include "harness/kernel/free_path_scores.h"
#include "harness/kernel/kernel.h"
#include "harness/kernel/majorant_audit.h"
#include "harness/kernel/ray_preparation.h"
#include "media/base/elementary.h"

namespace nullmark {

/// The loop that runs an estimator.  A block of walks of one ray steps together: all propose, the medium answers all points in
/// one indirect call, all consume, and finished walks leave.  There is one kernel per estimator and one per medium instead of one
/// per pair.  The loop counts lookups, checks the majorant and provides random streams.
template <template <class> class Estimator, class Value>
class BlockKernel : public Kernel {
  using E = Estimator<Value>;
  using Traits = EstimatorTraits<E, Value>;
  using RayData = typename Traits::RayData;
  using Walk = typename E::Walk;

  /// As many walks as the L1 cache holds together, but enough of them to share what is done once a step.
  static constexpr std::size_t kBlock = std::bit_floor(
      std::clamp<std::size_t>((std::size_t{24} << 10) / (sizeof(Walk) + sizeof(Flight) + sizeof(Rng) + sizeof(Value)), 32, 256));

 protected:
  /// A walk this long is an error: no walk may hang, and none may be cut short silently.
  static constexpr std::uint32_t kStepsBetweenStops = 1u << 14;

  struct State : Workspace {
    RayData ray;
    Ray local;
    std::array<Walk, kBlock> walk;
    std::array<Flight, kBlock> flight;
    std::array<Rng, kBlock> rng;
    std::array<std::uint32_t, kBlock> active;
    std::array<Real, kBlock> x, y, z, ahead{};
    std::array<Real, kBlock* static_cast<std::size_t>(kMostChannels<Value>)> extinction;
    std::vector<std::uint32_t> marked;  ///< for a profile, per walk: number of marks passed
  };

 public:
  BlockKernel(const E& estimator, int channels) : estimator_(estimator), channels_(channels) {}

  bool needs_optical_depth() const override { return Traits::needs_optical_depth(estimator_); }
  bool needs_knots() const override { return Traits::kNeedsKnots; }
  bool states_theory() const override { return Traits::kTheory; }

  bool answers(Quantity quantity) const override {
    if (quantity == Quantity::optical_depth) return Traits::kOpticalDepth;
    if (quantity == Quantity::transmittance_profile) return Traits::kTransmittanceAt && flies();
    if (quantity == Quantity::free_path) {
      if constexpr (Traits::kSamplesEvents) return estimator_.samples_events(channels_);
      return Traits::kEvent;
    }
    return quantity == Quantity::transmittance;
  }

  std::size_t outputs(Quantity quantity, const PreparedRay& context) const override {
    const auto channels = static_cast<std::size_t>(channels_);
    if (quantity == Quantity::transmittance_profile) return context.marks.size() * channels;
    if (quantity == Quantity::free_path) return free_path_outputs(context.albedo, channels);
    return channels;
  }

  std::unique_ptr<Workspace> workspace() const override { return std::make_unique<State>(); }

  void begin_ray(Workspace& workspace, const Medium& medium, const Extrema& extrema, const PreparedRay& context) const override {
    State& state = static_cast<State&>(workspace);
    RayData& ray = state.ray;
    state.local = context.local;
    ray.bounds = context.bounds;
    ray.exact_depth.reset();
    if (context.exact_depth) ray.exact_depth = load<Value>(context.exact_depth->data(), channels_);
    ray.knots.assign(context.knots.begin(), context.knots.end());
    prepare_ray<Traits>(ray, medium, extrema, context.world, state.local, channels_);
    if (context.albedo.size() > 0)
      ray.set_albedo(load<Value>(context.albedo.data(), channels_), context.albedo_field, context.world);
    if constexpr (Traits::kPrepare) estimator_.prepare(ray);
  }

  void sample(Workspace& workspace, const Medium& medium, const PreparedRay& context, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity quantity, SampleBlock& out, Counters& counters) const override {
    State& state = static_cast<State&>(workspace);
    const std::size_t outputs = this->outputs(quantity, context);
    out.values.resize(count * outputs);
    out.lookups.assign(count, 0);
    counters.samples += count;
    for (std::size_t done = 0; done < count; done += kBlock) {
      const auto run = state.recording ? &BlockKernel::run_block<true> : &BlockKernel::run_block<false>;
      (this->*run)(state, medium, context, key, first + done, std::min(kBlock, count - done), quantity,
                   &out.values[done * outputs], &out.lookups[done], counters);
    }
  }

  bool flies() const override {
    constexpr bool by_another_law = Traits::kIgnoresMajorant || Traits::kOwnFlights;
    if constexpr (Traits::kFliesOnce) return !by_another_law && estimator_.flies_once(channels_);
    return !by_another_law;
  }

  bool states_count_law() const override { return Traits::kCountLaw; }

  std::vector<CountLaw> count_law(const Workspace& workspace, const RayProfile& profile) const override {
    std::vector<CountLaw> laws;
    if constexpr (Traits::kCountLaw) {
      const RayData& ray = static_cast<const State&>(workspace).ray;
      for (int c = 0; c < channels_; ++c) laws.push_back(estimator_.count_law(ray, profile, c));
    }
    return laws;
  }

  Spectrum expected(const Workspace& workspace, const Spectrum& optical_depth, Quantity quantity) const override {
    if constexpr (Traits::kExpected) {
      const Value depth = load<Value>(optical_depth.data(), channels_);
      Spectrum result(channels_);
      store(estimator_.expected(depth, static_cast<const State&>(workspace).ray), result.data());
      return result;
    }
    return Kernel::expected(workspace, optical_depth, quantity);
  }

  std::vector<Theory> theory(const Workspace& workspace, const RayProfile& profile, Quantity quantity) const override {
    std::vector<Theory> result(static_cast<std::size_t>(channels_));
    if constexpr (Traits::kTheory) {
      const RayData& ray = static_cast<const State&>(workspace).ray;
      for (int c = 0; c < channels_; ++c) {
        Theory& theory = result[static_cast<std::size_t>(c)];
        theory = estimator_.theory(ray, profile, c, quantity);
        if (quantity == Quantity::free_path || quantity == Quantity::transmittance_profile) theory.mean = theory.variance = {};
        if constexpr (Traits::kWeightTheory)
          if (quantity == Quantity::free_path) theory = estimator_.weight_theory(ray, profile, c);
      }
    }
    return result;
  }

 protected:
  /// The estimator of one walk.
  const E& one() const { return estimator_; }

 private:
  // The loop that trackers are timed in stays in one piece.
  template <bool recorded>
  void run_block(State& state, const Medium& medium, const PreparedRay& context, std::uint64_t key, std::uint64_t first,
                 std::size_t count, Quantity quantity, Real* values, std::uint32_t* lookups, Counters& counters) const {
    const RayData& ray = state.ray;
    const auto channels = static_cast<std::size_t>(channels_);
    const std::size_t outputs = this->outputs(quantity, context);
    const bool profile = quantity == Quantity::transmittance_profile;
    if (profile) state.marked.assign(count, 0);
    for (std::size_t k = 0; k < count; ++k) {
      state.rng[k] = Rng(SampleAddress{key, context.index, first + k});
      state.flight[k].set_out(ray.majorant);
      estimator_.init(state.walk[k], ray, state.flight[k], state.rng[k]);
      state.active[k] = static_cast<std::uint32_t>(k);
    }
    std::size_t recorded_before = 0;
    if constexpr (recorded) {
      recorded_before = state.recording->walks.size();
      state.recording->add(count);
    }
    const Vec3 origin = context.local.origin, direction = context.local.direction;
    std::size_t active = count;
    for (std::uint32_t step = 1; active > 0; ++step) {
      if (step % kStepsBetweenStops == 0 && state.stop()) return;
      draw_ahead(state, active);
      std::size_t kept = 0;
      for (std::size_t a = 0; a < active; ++a) {
        const std::uint32_t k = state.active[a];
        Flight& flight = state.flight[k];
        const bool goes_on = estimator_.propose(state.walk[k], ray, flight, state.rng[k]);
        if (profile) mark(state, ray, k, goes_on ? flight.position() : kInfinity, context.marks, values + k * outputs);
        if (goes_on) {
          const Real t = flight.position();
          state.x[kept] = origin.x() + t * direction.x();
          state.y[kept] = origin.y() + t * direction.y();
          state.z[kept] = origin.z() + t * direction.z();
          state.active[kept++] = k;
        } else {
          finish(state, ray, k, quantity, context, values + k * outputs);
          if constexpr (recorded) {
            Recording::Walk& walk = state.recording->walks[recorded_before + k];
            walk.depth = flight.depth();
            walk.total_depth = flight.depth() + flight.depth_left();
            walk.draws = state.rng[k].draws();
            walk.collisions = flight.collisions();
            if constexpr (Traits::kEvent) {
              const Event<Value> event = estimator_.event(state.walk[k], ray, state.flight[k]);
              walk.end = event.kind;
              walk.distance = event.distance;
            }
          }
          counters.draws += state.rng[k].draws();
          counters.lookups += lookups[k];
          counters.null_collisions += null_collisions(state.walk[k], ray, lookups[k]);
        }
      }
      active = kept;
      if (active == 0) break;
      look_up(state, medium, active);
      for (std::size_t a = 0; a < active; ++a) {
        const std::uint32_t k = state.active[a];
        const Value extinction = load<Value>(&state.extinction[a * channels], channels_);
        if constexpr (recorded) {
          Recording::Walk& walk = state.recording->walks[recorded_before + k];
          const Flight& at = state.flight[k];
          walk.steps.push_back({at.position(), at.depth(), flies() ? at.rate() : 0, 0});
          walk.extinction.insert(walk.extinction.end(), &state.extinction[a * channels],
                                 &state.extinction[a * channels] + channels);
        }
        if constexpr (!Traits::kIgnoresMajorant)
          audit_majorant(largest(extinction), ray.majorant.rate(state.flight[k].piece()), counters);
        state.flight[k].set_lookups(step);
        estimator_.consume(state.walk[k], ray, state.flight[k], extinction, state.rng[k]);
        if constexpr (recorded) state.recording->walks[recorded_before + k].steps.back().draws = state.rng[k].draws();
        bool overrun = ++lookups[k] == state.most_lookups;
        if constexpr (recorded) overrun = overrun || ++state.recording->steps == Recording::kMostSteps;
        if (overrun) {
          ++counters.overruns;
          active = 0;
        }
      }
    }
  }

  void look_up(State& state, const Medium& medium, std::size_t active) const {
    if constexpr (Traits::kNeedsShares) {
      for (std::size_t a = 0; a < active; ++a) {
        const std::uint32_t k = state.active[a];
        const int component = estimator_.component(state.walk[k]);
        state.extinction[a] = medium.component_extinction(component, {state.x[a], state.y[a], state.z[a]}) /
                              state.ray.shares[state.flight[k].piece()][component];
      }
    } else {
      medium.extinction({state.x.data(), state.y.data(), state.z.data(), active}, state.extinction.data());
    }
  }

  /// Most walks draw an exponential next; their logarithms are taken together, where there are enough of them.
  static void draw_ahead(State& state, std::size_t active) {
    constexpr std::size_t kFew = 4;
    if constexpr (Traits::kIgnoresMajorant || (Traits::kOwnFlights && !Traits::kDrawsExponentials)) return;
    if (active <= kFew) return;
    for (std::size_t a = 0; a < active; ++a) state.ahead[a] = state.rng[state.active[a]].peek();
    negative_logarithms(state.ahead.data(), active, state.ahead.data());
    for (std::size_t a = 0; a < active; ++a) state.rng[state.active[a]].make_ready(state.ahead[a]);
  }

  /// Writes the profile at the marks that the walk passes before its next collision at `reached`.
  void mark(State& state, const RayData& ray, std::uint32_t k, Real reached, std::span<const Real> marks, Real* values) const {
    if constexpr (Traits::kTransmittanceAt) {
      std::uint32_t& marked = state.marked[k];
      for (; marked < marks.size() && marks[marked] < reached; ++marked)
        store(estimator_.transmittance_at(state.walk[k], ray, marks[marked]),
              values + marked * static_cast<std::size_t>(channels_));
    }
  }

  void score(State& state, const RayData& ray, std::uint32_t k, const PreparedRay& context, Real* values) const {
    if constexpr (Traits::kEvent)
      score_free_path(
          estimator_.event(state.walk[k], ray, state.flight[k]), context, static_cast<std::size_t>(channels_),
          [&](Real t) { return state.rng[k].uniform() < channel(ray.albedo_at(t), 0); }, values);
  }

  void finish(State& state, const RayData& ray, std::uint32_t k, Quantity quantity, const PreparedRay& context,
              Real* values) const {
    if (quantity == Quantity::transmittance_profile) return;
    if (quantity == Quantity::free_path) return score(state, ray, k, context, values);
    if constexpr (Traits::kOpticalDepth) {
      if (quantity == Quantity::optical_depth) {
        store(estimator_.optical_depth(state.walk[k], ray), values);
        return;
      }
    }
    store(estimator_.result(state.walk[k], ray), values);
  }

  std::uint64_t null_collisions(const Walk& walk, const RayData& ray, std::uint32_t lookups) const {
    if constexpr (Traits::kIgnoresMajorant) return 0;
    if constexpr (Traits::kRealCollisions) return lookups - static_cast<std::uint64_t>(estimator_.real_collisions(walk, ray));
    return lookups;
  }

  E estimator_;
  int channels_;
};

}  // namespace nullmark
