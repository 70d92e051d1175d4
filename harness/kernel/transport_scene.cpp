#include "harness/kernel/transport_scene.h"

#include <fmt/format.h>

namespace nullmark {
namespace {

void check_spectrum(const char* part, const Spectrum& values, int channels) {
  if (values.size() == 0) return;
  if (values.size() != channels)
    throw ParameterError(part, fmt::format("found {} channels; the medium has {}", values.size(), channels));
  if (!(values >= 0).all() || !values.isFinite().all())
    throw ParameterError(part, "found a negative or infinite number; expected finite ones >= 0");
}

}  // namespace

void TransportScene::check() const {
  const int channels = medium->channels();
  check_spectrum("albedo", albedo, channels);
  if (albedo.size() > 0 && albedo.maxCoeff() > 1)
    throw ParameterError("albedo", fmt::format("found {}; expected at most 1", albedo.maxCoeff()));
  HenyeyGreenstein{mean_cosine};
  emission.check(channels);
  check_spectrum("environment", environment.radiance, channels);
  for (const Surface& surface : surfaces) check_spectrum("surfaces", surface.radiance, channels);
  if (options.roulette_from && *options.roulette_from < 0)
    throw ParameterError("roulette_from", fmt::format("found {}; expected a number >= 0", *options.roulette_from));
  if (!(options.roulette_floor > 0 && options.roulette_floor <= 1))
    throw ParameterError("roulette_floor", fmt::format("found {}; expected a number in (0, 1]", options.roulette_floor));
  if (options.most_scatterings && *options.most_scatterings < 0)
    throw ParameterError("most_scatterings", fmt::format("found {}; expected a number >= 0", *options.most_scatterings));
}

Real brightest(const TransportScene& scene) {
  const auto most = [](const Spectrum& radiance) { return radiance.size() > 0 ? radiance.maxCoeff() : 0; };
  if (scene.emission.any() && scene.emission.field) return kInfinity;
  Real result = std::max(most(scene.environment.radiance), most(scene.emission.radiance));
  for (const Surface& surface : scene.surfaces) result = std::max(result, most(surface.radiance));
  return result;
}

Effects effects_of(const TransportScene& scene) {
  const Extrema extrema = scene.medium->extrema(scene.medium->bounds());
  const bool vacuum = !(extrema.maximum.maxCoeff() > 0);
  Effects effects;
  effects.scattering = !vacuum && scene.albedo.size() > 0 && scene.albedo.maxCoeff() > 0;
  effects.absorption = !vacuum && (scene.albedo.size() == 0 || scene.albedo.minCoeff() < 1 ||
                                   (scene.albedo_field && scene.albedo_field->least(scene.medium->channels()).minCoeff() < 1));
  effects.emission = effects.absorption && scene.emission.any();
  effects.anisotropic = effects.scattering && scene.mean_cosine != 0;
  effects.chromatic = scene.medium->channels() > 1;
  effects.heterogeneous = (extrema.minimum != extrema.maximum).any();
  effects.surfaces = !scene.surfaces.empty();
  effects.next_event = effects.scattering && scene.options.next_event != NextEvent::off && scene.environment.any();
  return effects;
}

std::vector<std::string> effect_names(const Effects& effects) {
  std::vector<std::string> names;
  const auto add = [&](bool on, const char* name) {
    if (on) names.emplace_back(name);
  };
  add(effects.absorption, "absorption");
  add(effects.scattering, "scattering");
  add(effects.emission, "emission");
  add(effects.anisotropic, "anisotropic");
  add(effects.chromatic, "chromatic");
  add(effects.heterogeneous, "heterogeneous");
  add(effects.surfaces, "surfaces");
  add(effects.next_event, "next_event");
  return names;
}

}  // namespace nullmark
