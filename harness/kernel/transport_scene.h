#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimators/transport/emission.h"
#include "estimators/transport/phase.h"
#include "estimators/transport/surface.h"
#include "harness/kernel/kernel.h"
#include "media/majorants/majorant.h"

namespace nullmark {

/// How the direction towards the environment is drawn at a scattering, if it is drawn at all.
enum class NextEvent { off, phase, uniform };

/// How paths are sampled; none of it changes the mean, except `most_scatterings`, which changes what is asked for.
struct PathOptions {
  NextEvent next_event = NextEvent::off;
  /// Scatterings from which on Russian roulette decides whether a path goes on: with probability min(1, largest |throughput|),
  /// but at least `roulette_floor` in (0, 1].  Left out: never.
  std::optional<int> roulette_from = 4;
  Real roulette_floor = 0.05;
  /// The quantity becomes the radiance of light that was scattered at most so often, 0 being emission and what is seen through
  /// the medium.  Left out: all light.
  std::optional<int> most_scatterings{};
  /// Flights and lookups after which a path is given up and counted as an overrun.
  std::uint64_t most_events = 1u << 30;
};

/// All that light meets.  Parts that are left out cost nothing: see Effects.
struct TransportScene {
  std::shared_ptr<const Medium> medium;
  std::shared_ptr<const MajorantStructure> majorant;
  Spectrum albedo;          ///< mu_s / mu per channel, in [0, 1]; empty: 0
  Real mean_cosine = 0;     ///< Henyey-Greenstein's g in (-1, 1); 0: isotropic
  Emission emission;        ///< of the medium
  Environment environment;  ///< behind everything
  std::vector<Surface> surfaces;
  PathOptions options;
  Walkers towards_environment;  ///< whose transmittance weighs next events; empty: that of the paths' sampler

  /// Throws ParameterError, naming the part, where the parts do not fit each other.
  void check() const;
};

/// What a scene asks a path for.  Kernels are compiled for scattering, emission, anisotropic, surfaces and next_event, and for
/// chromatic by their kind of Value; heterogeneous decides between the sampler and closed-form flights.
struct Effects {
  bool absorption = true, scattering = true, emission = true, anisotropic = true, chromatic = true, heterogeneous = true,
       surfaces = true, next_event = true;

  bool operator==(const Effects&) const = default;
};

/// Largest radiance of environment, surfaces and emission; infinite where emission varies in space.
Real brightest(const TransportScene& scene);

Effects effects_of(const TransportScene& scene);

/// Names of those that are on, in the order of the fields.
std::vector<std::string> effect_names(const Effects& effects);

}  // namespace nullmark
