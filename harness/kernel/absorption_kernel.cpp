#include <cmath>

#include "harness/kernel/optical_depth.h"
#include "harness/kernel/radiance_kernel.h"

namespace nullmark {

Spectrum radiance_behind(const TransportScene& scene, const SurfaceHit& hit) {
  return or_black(hit.surface ? hit.surface->radiance : scene.environment.radiance, scene.medium->channels());
}

Spectrum known_radiance(const TransportScene& scene, const Ray& camera) {
  const int channels = scene.medium->channels();
  const Effects effects = effects_of(scene);
  Spectrum environment = or_black(scene.environment.radiance, channels);
  const Spectrum emitted = or_black(scene.emission.radiance, channels);
  if (effects.emission && scene.emission.field) return Spectrum::Constant(channels, std::nan(""));
  if (!effects.scattering) {
    Sight sight;
    MediumFrame(*scene.medium).look(camera, scene.surfaces, sight);
    const Spectrum depth = optical_depth(*scene.medium, sight.local).depth;
    const Spectrum transmittance = (-depth).exp(), absorbed = -depth.unaryExpr([](Real x) { return std::expm1(-x); });
    return transmittance * radiance_behind(scene, sight.hit) + absorbed * emitted;
  }
  bool equilibrium = !effects.absorption || (emitted == environment).all();
  for (const Surface& surface : scene.surfaces)
    equilibrium = equilibrium && (or_black(surface.radiance, channels) == environment).all();
  if (equilibrium && !scene.options.most_scatterings) return environment;
  return Spectrum::Constant(channels, std::nan(""));
}

namespace {

/// Where light is only absorbed, by constant extinction: nothing is drawn.
class BeerLambertKernel final : public RadianceKernel {
  struct State final : Workspace {
    Spectrum radiance;
  };

 public:
  using RadianceKernel::RadianceKernel;

  std::unique_ptr<Workspace> workspace() const override { return std::make_unique<State>(); }

  void begin_ray(Workspace& workspace, const Medium&, const Extrema&, const PreparedRay& context) const override {
    static_cast<State&>(workspace).radiance = known_radiance(scene_, camera_ray(context));
  }

  void sample(Workspace& workspace, const Medium&, const PreparedRay&, std::uint64_t, std::uint64_t, std::size_t count, Quantity,
              SampleBlock& out, Counters& counters) const override {
    const Spectrum& radiance = static_cast<State&>(workspace).radiance;
    out.values.clear();
    for (std::size_t i = 0; i < count; ++i) out.values.insert(out.values.end(), radiance.begin(), radiance.end());
    out.lookups.assign(count, 0);
    counters.samples += count;
  }

  Spectrum expected(const Workspace& workspace, const Spectrum&, Quantity) const override {
    return static_cast<const State&>(workspace).radiance;
  }
};

/// Where light is only absorbed, by any medium: the estimator's T times the radiance behind.
class AbsorptionKernel final : public RadianceKernel {
  struct State final : Workspace {
    std::unique_ptr<Workspace> inner;
    PreparedRay context;
    Ray camera;
    Spectrum behind;
  };

 public:
  AbsorptionKernel(const TransportScene& scene, std::unique_ptr<const Kernel> transmittance)
      : RadianceKernel(scene), transmittance_(std::move(transmittance)) {}

  std::unique_ptr<Workspace> workspace() const override {
    auto state = std::make_unique<State>();
    state->inner = transmittance_->workspace();
    return state;
  }

  void begin_ray(Workspace& workspace, const Medium& medium, const Extrema&, const PreparedRay& context) const override {
    State& state = static_cast<State&>(workspace);
    state.camera = camera_ray(context);
    Sight sight;
    frame_.look(state.camera, scene_.surfaces, sight);
    state.behind = radiance_behind(scene_, sight.hit);
    PreparedRay& mine = state.context;
    mine.world = sight.world;
    mine.local = sight.local;
    mine.index = context.index;
    mine.albedo = context.albedo;
    mine.bounds.start(*scene_.majorant, mine.world, mine.local);
    mine.knots.clear();
    mine.exact_depth.reset();
    if (transmittance_->needs_knots()) sorted_knots(medium, mine.local, mine.knots);
    if (transmittance_->needs_optical_depth()) mine.exact_depth = optical_depth(medium, mine.local).depth;
    transmittance_->begin_ray(*state.inner, medium, extrema_, mine);
  }

  void sample(Workspace& workspace, const Medium& medium, const PreparedRay&, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity, SampleBlock& out, Counters& counters) const override {
    State& state = static_cast<State&>(workspace);
    state.inner->stop = state.stop;
    state.inner->recording = state.recording;
    transmittance_->sample(*state.inner, medium, state.context, key, first, count, Quantity::transmittance, out, counters);
    const auto channels = static_cast<std::size_t>(channels_);
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t c = 0; c < channels; ++c) out.values[i * channels + c] *= state.behind[static_cast<Eigen::Index>(c)];
  }

  Spectrum expected(const Workspace& workspace, const Spectrum&, Quantity) const override {
    return known_radiance(scene_, static_cast<const State&>(workspace).camera);
  }

 private:
  std::unique_ptr<const Kernel> transmittance_;
};

}  // namespace

std::unique_ptr<const Kernel> make_beer_lambert_kernel(const TransportScene& scene) {
  return std::make_unique<BeerLambertKernel>(scene);
}

std::unique_ptr<const Kernel> make_absorption_kernel(const TransportScene& scene, std::unique_ptr<const Kernel> transmittance) {
  return std::make_unique<AbsorptionKernel>(scene, std::move(transmittance));
}

}  // namespace nullmark
