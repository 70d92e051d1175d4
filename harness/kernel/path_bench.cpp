#include <fmt/format.h>

#include "estimators/delta.h"
#include "harness/kernel/estimator_template.h"
#include "harness/kernel/path_kernel.h"
#include "harness/testing/bench.h"
#include "media/gaussian_bump.h"
#include "media/homogeneous.h"
#include "media/majorants/global.h"

namespace nullmark {
namespace {

// One path of each scene by the kernel that knows every effect and by the one composed for the scene; items are paths.

std::shared_ptr<const Medium> medium(bool constant) {
  if (constant) return std::make_shared<FieldMedium<Homogeneous>>(Homogeneous{4});
  AlongAxis<GaussianBumpProfile> field;
  field.profile = {8, {0.4, 0.2}};
  field.prepare();
  return std::make_shared<FieldMedium<AlongAxis<GaussianBumpProfile>>>(field);
}

TransportScene scene_with(const Effects& effects) {
  const auto grey = [](Real x) { return Spectrum(Spectrum::Constant(1, x)); };
  TransportScene scene;
  scene.medium = medium(!effects.heterogeneous);
  scene.majorant = std::make_shared<GlobalMajorant>(*scene.medium, 1);
  scene.environment.radiance = grey(1);
  if (effects.scattering) scene.albedo = grey(0.8);
  if (effects.emission) scene.emission.radiance = grey(2);
  if (effects.anisotropic) scene.mean_cosine = 0.6;
  if (effects.surfaces) scene.surfaces = {{Sphere{{0.5, 0.5, 0.9}, 0.2}, grey(3)}, {Plane{{0, -0.1, 0}, {0, 1, 0}}, grey(0.5)}};
  if (effects.next_event) scene.options.next_event = NextEvent::phase;
  return scene;
}

class Paths {
 public:
  Paths(const TransportScene& scene, bool general)
      : scene_(scene), kernel_(make_path_kernel(EstimatorTemplate<DeltaTracking>(), scene, general)) {
    workspace_ = kernel_->workspace();
    context_.world = {{-0.3, 0.2, 0.1}, Vec3(1, 0.4, 0.5).normalized(), 0, kInfinity};
    kernel_->begin_ray(*workspace_, *scene_.medium, scene_.medium->extrema(scene_.medium->bounds()), context_);
  }

  void draw(std::size_t count) {
    kernel_->sample(*workspace_, *scene_.medium, context_, 1, counters_.samples, count, Quantity::transmittance, block_,
                    counters_);
  }

  const Counters& counters() const { return counters_; }

  /// Of the samples drawn last.
  double variance() const {
    double sum = 0, squares = 0;
    for (const Real value : block_.values) {
      sum += value;
      squares += value * value;
    }
    const auto n = static_cast<double>(block_.values.size());
    return std::max(0., squares / n - sum / n * (sum / n));
  }

 private:
  TransportScene scene_;
  std::unique_ptr<const Kernel> kernel_;
  std::unique_ptr<Workspace> workspace_;
  PreparedRay context_;
  SampleBlock block_;
  Counters counters_;
};

void add(const std::string& group, const char* kernel, const Effects& effects, bool general) {
  const TransportScene scene = scene_with(effects);
  Paths first(scene, general);
  first.draw(16384);
  const Counters& cost = first.counters();
  const auto per_path = [&](std::uint64_t n) { return static_cast<double>(n) / static_cast<double>(cost.samples); };
  benchmark::RegisterBenchmark(fmt::format("radiance, {}/{}, {:.2f} lookups, {:.2f} draws, variance {:.2f}", group, kernel,
                                           per_path(cost.lookups), per_path(cost.draws), first.variance())
                                   .c_str(),
                               [=](benchmark::State& state) {
                                 Paths paths(scene, general);
                                 for ([[maybe_unused]] auto _ : state) paths.draw(256);
                                 count_items(state, "path", paths.counters().samples);
                                 count_lookups(state, paths.counters().lookups);
                               });
}

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  const Effects all{.chromatic = false};
  const auto without = [&](auto... left_out) {
    Effects effects = all;
    ((effects.*left_out = false), ...);
    return effects;
  };
  const std::pair<const char*, Effects> scenes[] = {
      {"all effects but chromatic", all},
      {"without surfaces", without(&Effects::surfaces)},
      {"without anisotropy", without(&Effects::anisotropic)},
      {"without next events", without(&Effects::next_event)},
      {"without emission", without(&Effects::emission)},
      {"without heterogeneity", without(&Effects::heterogeneous)},
      {"only scattering", without(&Effects::surfaces, &Effects::anisotropic, &Effects::next_event, &Effects::emission)},
      {"only scattering, constant",
       without(&Effects::surfaces, &Effects::anisotropic, &Effects::next_event, &Effects::emission, &Effects::heterogeneous)},
      {"only emission", without(&Effects::surfaces, &Effects::scattering, &Effects::anisotropic, &Effects::next_event)},
      {"only absorption",
       without(&Effects::surfaces, &Effects::scattering, &Effects::anisotropic, &Effects::next_event, &Effects::emission)},
      {"only absorption, constant", without(&Effects::surfaces, &Effects::scattering, &Effects::anisotropic, &Effects::next_event,
                                            &Effects::emission, &Effects::heterogeneous)}};
  for (const auto& [name, effects] : scenes) {
    add(name, "0 general", effects, true);
    add(name, "composed", effects, false);
  }
});

}  // namespace
}  // namespace nullmark
