#include "harness/kernel/path_kernel.h"

#include <fmt/format.h>

#include "harness/kernel/homogeneous_walker.h"
#include "harness/kernel/radiance_kernel.h"
#include "harness/kernel/walker.h"

namespace nullmark {
namespace {

/// Paths, compiled for the effects that can be seen in their code; absorption, chromatic and heterogeneous are decided by who
/// constructs it.
template <class Value, Effects kEffects>
class PathKernel final : public RadianceKernel {
  using Phase = std::conditional_t<kEffects.anisotropic, HenyeyGreenstein, Isotropic>;
  using Paths = std::shared_ptr<const Walker<Value>>;

  struct Leg {
    Sight sight;
    std::unique_ptr<WalkMemory> memory;
  };
  struct State final : Workspace {
    Ray camera_ray;
    Leg camera, onward, shadow;  ///< of all samples; after a scattering; towards the environment
    PathScene<Value> path_scene;
  };

 public:
  PathKernel(const TransportScene& scene, Paths walker, Paths shadow_walker)
      : RadianceKernel(scene),
        phase_(make_phase(scene.mean_cosine)),
        walker_(std::move(walker)),
        shadow_walker_(std::move(shadow_walker)),
        albedo_(radiance_or_black<Value>(scene.albedo, channels_)),
        environment_(radiance_or_black<Value>(scene.environment.radiance, channels_)) {
    for (const Surface& surface : scene_.surfaces) surfaces_.push_back(radiance_or_black<Value>(surface.radiance, channels_));
  }

  std::unique_ptr<Workspace> workspace() const override {
    auto state = std::make_unique<State>();
    state->camera.memory = walker_->memory();
    state->onward.memory = walker_->memory();
    state->shadow.memory = shadow_walker_->memory();
    state->path_scene = {nullptr,          &extrema_, scene_.majorant.get(), channels_, albedo_, scene_.albedo_field.get(),
                         kEffects.emission};
    return state;
  }

  void begin_ray(Workspace& workspace, const Medium& medium, const Extrema&, const PreparedRay& context) const override {
    State& state = static_cast<State&>(workspace);
    state.path_scene.medium = &medium;
    const Ray camera = camera_ray(context);
    begin_leg(state, state.camera, *walker_, camera);
    state.camera_ray = camera;
  }

  void sample(Workspace& workspace, const Medium&, const PreparedRay& context, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity, SampleBlock& out, Counters& counters) const override {
    State& state = static_cast<State&>(workspace);
    const auto channels = static_cast<std::size_t>(channels_);
    out.values.resize(count * channels);
    out.lookups.resize(count);
    counters.samples += count;
    EventBudget budget(state.stop);
    for (std::size_t k = 0; k < count && !budget.stopped(); ++k) {
      Rng rng(SampleAddress{key, context.index, first + k});
      const std::uint64_t lookups_before = counters.lookups;
      budget.start(scene_.options.most_events);
      store(path(state, rng, budget, counters), &out.values[k * channels]);
      out.lookups[k] = static_cast<std::uint32_t>(counters.lookups - lookups_before);
      counters.draws += rng.draws();
      if (state.recording) {
        state.recording->walks.emplace_back();
        state.recording->walks.back().draws = rng.draws();
      }
    }
    counters.overruns += budget.overruns();
  }

  Spectrum expected(const Workspace& workspace, const Spectrum&, Quantity) const override {
    return known_radiance(scene_, static_cast<const State&>(workspace).camera_ray);
  }

 private:
  static Phase make_phase(Real mean_cosine) {
    if constexpr (kEffects.anisotropic)
      return HenyeyGreenstein(mean_cosine);
    else
      return Isotropic();
  }

  Value uniform(Real x) const { return uniform_value<Value>(channels_, x); }

  void begin_leg(State& state, Leg& leg, const Walker<Value>& walker, const Ray& ray) const {
    if constexpr (kEffects.surfaces)
      frame_.look(ray, scene_.surfaces, leg.sight);
    else
      frame_.look(ray, leg.sight);
    if (leg.sight.world.length() > 0) walker.begin(*leg.memory, state.path_scene, leg.sight.world, leg.sight.local);
  }

  Event<Value> fly(State& state, const Leg& leg, const Value& throughput, Rng& rng, EventBudget& budget,
                   Counters& counters) const {
    if (leg.sight.world.length() > 0) return walker_->fly(*leg.memory, state.path_scene, throughput, rng, budget, counters);
    return {EventKind::escape, 0, uniform(1)};
  }

  Value path(State& state, Rng& rng, EventBudget& budget, Counters& counters) const {
    Value radiance = uniform(0), throughput = uniform(1);
    Leg* leg = &state.camera;
    Real environment_weight = 1;  // of the environment that the leg's end sees
    for (int scatterings = 0;; ++scatterings) {
      const Event<Value> event = fly(state, *leg, throughput, rng, budget, counters);
      if (!budget.spend()) return radiance;
      throughput *= event.weight;
      if (!is_collision(event.kind)) {
        radiance += throughput * radiance_at_end(leg->sight, environment_weight);
        return radiance;
      }
      const Vec3 point = leg->sight.world.at(event.distance);
      if (!scatters(event.kind, point, throughput, rng)) {
        if constexpr (kEffects.emission) radiance += throughput * scene_.emission.at<Value>(point, channels_, counters.lookups);
        return radiance;
      }
      if constexpr (!kEffects.scattering) return radiance;
      if (scene_.options.most_scatterings && scatterings == *scene_.options.most_scatterings) return radiance;
      const Vec3& direction = leg->sight.world.direction;
      if constexpr (kEffects.next_event)
        if (scene_.options.next_event != NextEvent::off)
          radiance += throughput * from_environment(state, point, direction, rng, budget, counters);
      if (vanished(throughput) || !survives(scatterings + 1, throughput, rng)) return radiance;
      const Vec3 onward = phase_.sample(direction, rng);
      if constexpr (kEffects.next_event) environment_weight = weight_by_phase(direction, onward);
      begin_leg(state, state.onward, *walker_, {point, onward, 0, kInfinity});
      leg = &state.onward;
    }
  }

  /// Of the surface met or of the environment.
  Value radiance_at_end(const Sight& sight, Real environment_weight) const {
    if constexpr (kEffects.surfaces)
      if (sight.hit.surface) return surfaces_[static_cast<std::size_t>(sight.hit.surface - scene_.surfaces.data())];
    if constexpr (kEffects.next_event) return environment_ * environment_weight;
    return environment_;
  }

  /// Share of the environment that is left to a path scattered by the phase function; next events count the rest.
  Real weight_by_phase(const Vec3& from, const Vec3& to) const {
    if (scene_.options.next_event == NextEvent::off) return 1;
    if (scene_.options.next_event != NextEvent::mis) return 0;
    const Real phase = phase_.value(from, to);
    return phase / (phase + Isotropic().value(from, to));
  }

  /// Whether a collision is a scattering; weighs the throughput accordingly.  Where nothing emits it always is, for absorption
  /// adds nothing; otherwise one of the two is drawn, on chromatic media with the albedo averaged over what each channel carries,
  /// so that the mean of |throughput| over the channels stays what it was [Kutz et al. 2017, Sec. 5].
  bool scatters(EventKind kind, const Vec3& point, Value& throughput, Rng& rng) const {
    if (kind != EventKind::collision) return kind == EventKind::scatter;
    if constexpr (!kEffects.scattering) return false;
    if (scene_.albedo_field) [[unlikely]]
      return scatters_by(albedo_at<Value>(*scene_.albedo_field, point, channels_), throughput, rng);
    return scatters_by(albedo_, throughput, rng);
  }

  bool scatters_by(const Value& albedo, Value& throughput, Rng& rng) const {
    if constexpr (!kEffects.emission) {
      throughput *= albedo;
      return true;
    } else if constexpr (std::is_same_v<Value, Real>) {
      return rng.uniform() < albedo;
    } else {
      const Real whole = channel_sum(throughput.abs());
      if (whole == 0) return true;
      const Real scattered = channel_sum(throughput.abs() * albedo), absorbed = channel_sum(throughput.abs() * (1 - albedo));
      const Real both = scattered + absorbed;
      const bool chosen = rng.uniform() * both < scattered;
      throughput *= chosen ? Value(albedo * (both / scattered)) : Value((1 - albedo) * (both / absorbed));
      return chosen;
    }
  }

  /// Radiance that comes from the environment straight to a point and is scattered there into the path.
  Value from_environment(State& state, const Vec3& point, const Vec3& direction, Rng& rng, EventBudget& budget,
                         Counters& counters) const {
    Vec3 towards;
    Real weight = 1;  // phase function over density of the direction, or over the sum of both densities
    if (scene_.options.next_event == NextEvent::phase) {
      towards = phase_.sample(direction, rng);
    } else {
      const Isotropic uniform_directions;
      towards = uniform_directions.sample(direction, rng);
      const Real phase = phase_.value(direction, towards), density = uniform_directions.value(direction, towards);
      weight = phase / (scene_.options.next_event == NextEvent::mis ? phase + density : density);
    }
    Leg& leg = state.shadow;
    begin_leg(state, leg, *shadow_walker_, {point, towards, 0, kInfinity});
    if (leg.sight.hit.surface) return uniform(0);
    if (!(leg.sight.world.length() > 0)) return environment_ * weight;
    return shadow_walker_->transmittance(*leg.memory, state.path_scene, rng, budget, counters) * environment_ * weight;
  }

  bool survives(int scatterings, Value& throughput, Rng& rng) const {
    if (!scene_.options.roulette_from || scatterings < *scene_.options.roulette_from) return true;
    const Real probability = std::max(scene_.options.roulette_floor, std::min<Real>(1, largest(magnitude(throughput))));
    if (probability == 1) return true;
    throughput /= probability;
    return rng.uniform() < probability;
  }

  Phase phase_;
  Paths walker_, shadow_walker_;
  Value albedo_, environment_;
  std::vector<Value> surfaces_;  ///< radiance of each
};

/// f(std::true_type or std::false_type): a flag of the run becomes one of the compiler.
template <class F>
auto compiled(bool flag, const F& f) {
  return flag ? f(std::true_type{}) : f(std::false_type{});
}

template <class Value>
std::unique_ptr<const Kernel> compiled_path_kernel(const TransportScene& scene, const Effects& effects,
                                                   std::shared_ptr<const Walker<Value>> walker,
                                                   std::shared_ptr<const Walker<Value>> shadow) {
  using Result = std::unique_ptr<const Kernel>;
  return compiled(effects.surfaces, [&](auto surfaces) -> Result {
    // Without scattering there is neither a phase function nor a next event, and without emission there would be no path.
    if (!effects.scattering) {
      constexpr Effects kEffects{.scattering = false, .anisotropic = false, .surfaces = surfaces(), .next_event = false};
      return std::make_unique<PathKernel<Value, kEffects>>(scene, walker, shadow);
    }
    return compiled(effects.emission, [&](auto emission) -> Result {
      return compiled(effects.anisotropic, [&](auto anisotropic) -> Result {
        return compiled(effects.next_event, [&](auto next_event) -> Result {
          constexpr Effects kEffects{
              .emission = emission(), .anisotropic = anisotropic(), .surfaces = surfaces(), .next_event = next_event()};
          return std::make_unique<PathKernel<Value, kEffects>>(scene, walker, shadow);
        });
      });
    });
  });
}

/// Those of `Walkers` that walk by one type of Value.
template <class Value>
using WalkersOf = std::shared_ptr<const Walker<Value>> Walkers::*;

template <class Value>
std::unique_ptr<const Kernel> make(const TransportScene& scene, const Effects& effects, const Walkers& walkers,
                                   WalkersOf<Value> chosen) {
  const int channels = scene.medium->channels();
  if (!effects.heterogeneous) {
    const Spectrum extinction = scene.medium->extrema(scene.medium->bounds()).maximum;
    const auto walker = std::make_shared<HomogeneousWalker<Value>>(load<Value>(extinction.data(), channels));
    return compiled_path_kernel<Value>(scene, effects, walker, walker);
  }
  const auto &sampler = walkers.*chosen, &shadow = scene.towards_environment.*chosen;
  return compiled_path_kernel<Value>(scene, effects, sampler, shadow ? shadow : sampler);
}

/// Whether all that walks in the chromatic scene has a form of this width.
template <class Value>
bool fits(const TransportScene& scene, const Effects& effects, const Walkers& walkers, WalkersOf<Value> chosen) {
  const Walkers& shadow = scene.towards_environment;
  return !effects.heterogeneous || (walkers.*chosen && (!shadow.chromatic || shadow.*chosen));
}

template <class Walk>
std::string why_not(const Walk& walk, const Medium& medium) {
  if (walk.needs_knots() && !medium.polynomial_degree()) return "the medium is not polynomial between knots";
  const Box bounds = medium.bounds();
  if (walk.needs_optical_depth() && !medium.optical_depth({bounds.lo, bounds.extent(), 0, 1}))
    return "the medium has no closed-form optical depth";
  return "";
}

template <class Value>
std::string why_no_flights(const std::shared_ptr<const Walker<Value>>& sampler,
                           const std::shared_ptr<const Walker<Value>>& shadow, const TransportScene& scene) {
  const int channels = scene.medium->channels();
  if (!sampler || !sampler->samples_events(channels))
    return fmt::format("it samples no free paths{}, which scattering and emission need",
                       channels > 1 ? " of several channels" : "");
  const std::string reason = why_not(*sampler, *scene.medium);
  return reason.empty() && shadow ? why_not(*shadow, *scene.medium) : reason;
}

Effects asked_for(const TransportScene& scene, bool general) { return general ? Effects{} : effects_of(scene); }

}  // namespace

std::string why_no_paths(const EstimatorSource& estimator, const TransportScene& scene, bool general) {
  const Effects effects = asked_for(scene, general);
  if (!effects.heterogeneous) return "";
  if (!effects.scattering && !effects.emission) return why_not(*estimator.kernel(scene.medium->channels()), *scene.medium);
  const Walkers walkers = estimator.walkers(), &shadow = scene.towards_environment;
  return effects.chromatic ? why_no_flights(walkers.chromatic, shadow.chromatic, scene)
                           : why_no_flights(walkers.grey, shadow.grey, scene);
}

std::unique_ptr<const Kernel> make_path_kernel(const EstimatorSource& estimator, const TransportScene& scene, bool general) {
  scene.check();
  if (const std::string reason = why_no_paths(estimator, scene, general); !reason.empty())
    throw ParameterError("type", "the estimator cannot compute radiance here: " + reason);
  const Effects effects = asked_for(scene, general);
  if (!effects.scattering && !effects.emission) {
    if (!effects.heterogeneous) return make_beer_lambert_kernel(scene);
    return make_absorption_kernel(scene, estimator.kernel(scene.medium->channels()));
  }
  const Walkers walkers = estimator.walkers();
  if (!effects.chromatic) return make(scene, effects, walkers, &Walkers::grey);
  const int channels = scene.medium->channels();
  if (channels == 3 && fits(scene, effects, walkers, &Walkers::three)) return make(scene, effects, walkers, &Walkers::three);
  if (channels == 4 && fits(scene, effects, walkers, &Walkers::four)) return make(scene, effects, walkers, &Walkers::four);
  return make(scene, effects, walkers, &Walkers::chromatic);
}

}  // namespace nullmark
