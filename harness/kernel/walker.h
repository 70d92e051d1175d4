#pragma once

#include <array>
#include <functional>
#include <type_traits>

#include "harness/kernel/estimator_traits.h"
#include "harness/kernel/kernel.h"
#include "harness/kernel/majorant_audit.h"
#include "harness/kernel/optical_depth.h"
#include "harness/kernel/ray_preparation.h"
#include "media/majorants/majorant.h"

namespace nullmark {

/// Data that all walks of a scene share.
template <class Value>
struct PathScene {
  const Medium* medium = nullptr;
  const Extrema* extrema = nullptr;  ///< over the whole medium
  const MajorantStructure* majorant = nullptr;
  int channels = 1;
  Value albedo;  ///< its most where it varies
  const AlbedoField* albedo_field = nullptr;
  bool draws_absorption = true;
};

/// Budget of the walks of one sample.  Every lookup and every flight is one event.
class EventBudget {
 public:
  explicit EventBudget(const std::function<bool()>& stop) : stop_(stop) {}

  /// Begins a sample with a budget of this many events.
  void start(std::uint64_t most_events) { left_ = most_events; }

  /// Counts an event.  False if the sample must be aborted, because its budget is spent (an overrun) or the run stops.
  bool spend() {
    if (left_ == 0) return false;
    if (--left_ == 0) ++overruns_;
    if (++spent_ % kEventsBetweenStops == 0 && stop_()) {
      stopped_ = true;
      left_ = 0;
    }
    return left_ > 0;
  }

  bool exhausted() const { return left_ == 0; }
  std::uint64_t overruns() const { return overruns_; }
  bool stopped() const { return stopped_; }

 private:
  static constexpr std::uint64_t kEventsBetweenStops = 1u << 14;
  const std::function<bool()>& stop_;
  std::uint64_t left_ = 0, spent_ = 0, overruns_ = 0;
  bool stopped_ = false;
};

/// Scratch memory of walks along one ray at a time.
struct WalkMemory {
  virtual ~WalkMemory() = default;
};

/// Walks one at a time along any ray, for light paths: free flights, and transmittance towards lights.  Immutable; one instance
/// serves all threads.  A walk that runs out of budget returns early, and its result must not be used.
template <class Value>
class Walker {
 public:
  virtual ~Walker() = default;
  virtual std::unique_ptr<WalkMemory> memory() const = 0;

  /// Whether `fly` supports this many channels.
  virtual bool samples_events(int channels) const = 0;

  /// Requirements on the medium: a polynomial extinction between knots, a closed-form optical depth.
  virtual bool needs_knots() const = 0;
  virtual bool needs_optical_depth() const = 0;

  /// Prepares a ray in both frames, cut to the medium, with begin 0; walks along it follow.  No allocation once the memory has
  /// grown.
  virtual void begin(WalkMemory&, const PathScene<Value>&, const Ray& world, const Ray& local) const = 0;

  /// One free flight.  `throughput` is the weight of the path before it.
  virtual Event<Value> fly(WalkMemory&, const PathScene<Value>&, const Value& throughput, Rng&, EventBudget&,
                           Counters&) const = 0;

  /// One estimate of the transmittance.
  virtual Value transmittance(WalkMemory&, const PathScene<Value>&, Rng&, EventBudget&, Counters&) const = 0;
};

/// Walks once along a prepared ray and returns the flight at its end.  goes_on() says before each step whether to go on;
/// look_up(walk, flight) is the extinction there.  All of a step is inlined.
template <class E, class RayData>
[[gnu::always_inline]] inline Flight walk_once(const E& estimator, typename E::Walk& walk, const RayData& ray, auto& rng,
                                               const auto& goes_on, const auto& look_up) {
  Flight flight;
  flight.start(ray.majorant);
  estimator.init(walk, ray, flight, rng);
  for (std::uint32_t lookups = 1; goes_on() && estimator.propose(walk, ray, flight, rng); ++lookups) {
    const auto& extinction = look_up(walk, flight);
    flight.set_lookups(lookups);
    estimator.consume(walk, ray, flight, extinction, rng);
  }
  return flight;
}

/// Walks of an estimator.  If its RayData has a field `Value throughput`, this is set to the weight of the path so far, as
/// history-aware collision probabilities require [Kutz et al. 2017, Sec. 5].
template <template <class> class Estimator, class Value>
class EstimatorWalker final : public Walker<Value> {
  using E = Estimator<Value>;
  using Traits = EstimatorTraits<E, Value>;
  using Along = typename Traits::RayData;
  using Walk = typename E::Walk;

  struct State final : WalkMemory {
    Along ray;
    Walk walk;
    nullmark::Ray local;
    Value extinction;
  };

 public:
  explicit EstimatorWalker(const E& estimator) : estimator_(estimator) {}

  std::unique_ptr<WalkMemory> memory() const override { return std::make_unique<State>(); }

  bool samples_events(int channels) const override {
    if constexpr (!Traits::kEvent) return false;
    if constexpr (Traits::kSamplesEvents) return estimator_.samples_events(channels);
    return true;
  }

  bool needs_knots() const override { return Traits::kNeedsKnots; }

  bool needs_optical_depth() const override { return Traits::needs_optical_depth(estimator_); }

  void begin(WalkMemory& memory, const PathScene<Value>& path_scene, const Ray& world, const Ray& local) const override {
    State& state = static_cast<State&>(memory);
    Along& ray = state.ray;
    state.local = local;
    if constexpr (std::is_same_v<Value, Spectrum>) state.extinction.resize(path_scene.channels);
    ray.bounds.start(*path_scene.majorant, world, local);
    ray.exact_depth.reset();
    if (needs_optical_depth())
      ray.exact_depth = load<Value>(optical_depth(*path_scene.medium, local).depth.data(), path_scene.channels);
    ray.knots.clear();
    if (needs_knots()) sorted_knots(*path_scene.medium, local, ray.knots);
    prepare_ray<Traits>(ray, *path_scene.medium, *path_scene.extrema, world, state.local, path_scene.channels);
    ray.set_albedo(path_scene.albedo, path_scene.albedo_field, world);
    ray.draws_absorption = path_scene.draws_absorption;
    if constexpr (Traits::kPrepare) estimator_.prepare(ray);
  }

  Event<Value> fly(WalkMemory& memory, const PathScene<Value>& path_scene, const Value& throughput, Rng& rng, EventBudget& budget,
                   Counters& counters) const override {
    State& state = static_cast<State&>(memory);
    if constexpr (requires { state.ray.throughput; }) state.ray.throughput = throughput;
    [[maybe_unused]] const Flight at = walk(state, path_scene, rng, budget, counters);
    if constexpr (Traits::kEvent)
      return estimator_.event(state.walk, state.ray, at);
    else
      return {};
  }

  Value transmittance(WalkMemory& memory, const PathScene<Value>& path_scene, Rng& rng, EventBudget& budget,
                      Counters& counters) const override {
    State& state = static_cast<State&>(memory);
    if constexpr (requires { state.ray.throughput; }) state.ray.throughput = uniform_value<Value>(path_scene.channels, 1);
    walk(state, path_scene, rng, budget, counters);
    return estimator_.result(state.walk, state.ray);
  }

 private:
  /// Walks to the end of the ray or of the budget.
  [[gnu::flatten]] Flight walk(State& state, const PathScene<Value>& path_scene, Rng& rng, EventBudget& budget,
                               Counters& counters) const {
    const Vec3 origin = state.local.origin, direction = state.local.direction;
    const auto look_up = [&](const Walk& walk, const Flight& flight) -> const Value& {
      const Real t = flight.position();
      // Three numbers instead of a point: a point is read in pairs of numbers, and such a read waits for both stores.
      const Real x = origin.x() + t * direction.x(), y = origin.y() + t * direction.y(), z = origin.z() + t * direction.z();
      if constexpr (Traits::kNeedsShares) {
        const int component = estimator_.component(walk);
        channel(state.extinction, 0) =
            path_scene.medium->component_extinction(component, {x, y, z}) / state.ray.shares[flight.piece()][component];
      } else {
        path_scene.medium->extinction({&x, &y, &z, 1}, numbers_of(state.extinction));
      }
      const Value& extinction = state.extinction;
      if constexpr (!Traits::kIgnoresMajorant)
        audit_majorant(largest(extinction), state.ray.majorant.rate_on_the_way(flight.piece()), counters);
      budget.spend();
      return extinction;
    };
    const Flight end = walk_once(
        estimator_, state.walk, state.ray, rng, [&] { return !budget.exhausted(); }, look_up);
    counters.lookups += end.lookups();
    if constexpr (!Traits::kIgnoresMajorant) {
      counters.null_collisions += end.lookups();
      if constexpr (Traits::kRealCollisions)
        counters.null_collisions -= static_cast<std::uint64_t>(estimator_.real_collisions(state.walk, state.ray));
    }
    return end;
  }

  E estimator_;
};

}  // namespace nullmark
