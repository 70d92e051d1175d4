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

/// How a direction towards the environment is drawn at each scattering, if at all: by the phase function, uniformly, or uniformly
/// and weighted against the paths that reach the environment by the phase function, with the balance heuristic [Veach and Guibas
/// 1995, Eq. 14].  `uniform` has a relative variance of about (1 + g^2) / (1 - g^2)^2 a scattering; weights of `mis` are at
/// most 1.
enum class NextEvent { off, phase, uniform, mis };

/// How paths are sampled.  Only `most_scatterings` changes the mean, because it changes the quantity.
struct PathOptions {
  NextEvent next_event = NextEvent::off;
  /// Number of scatterings after which Russian roulette begins.  A path continues with probability min(1, largest |throughput|),
  /// but at least `roulette_floor` in (0, 1].  Absent: no roulette.
  std::optional<int> roulette_from = 4;
  Real roulette_floor = 0.05;
  /// Restricts the quantity to light that was scattered at most this many times; 0 is emission and what is seen through the
  /// medium. Absent: all light.
  std::optional<int> most_scatterings{};
  /// Flights and lookups after which a path is aborted and counted as an overrun.
  std::uint64_t most_events = 1u << 30;
};

/// The scene for light.  Absent parts cost nothing: see Effects.
struct TransportScene {
  std::shared_ptr<const Medium> medium;
  std::shared_ptr<const MajorantStructure> majorant;
  Spectrum albedo;                                  ///< mu_s / mu per channel, in [0, 1], its most where it varies; empty: 0
  std::shared_ptr<const AlbedoField> albedo_field;  ///< where it varies in space
  Real mean_cosine = 0;                             ///< Henyey-Greenstein's g in (-1, 1); 0: isotropic
  Emission emission;                                ///< of the medium
  Environment environment;                          ///< behind everything
  std::vector<Surface> surfaces;
  PathOptions options;
  Walkers towards_environment;  ///< estimate the transmittance of next events; empty: the sampler of the paths does

  /// Throws ParameterError that names the part if the parts do not fit each other.
  void check() const;
};

/// Effects of a scene.  Kernels are compiled for scattering, emission, anisotropic, surfaces and next_event, and for chromatic by
/// their type of Value.  heterogeneous decides between the sampler and closed-form flights.
struct Effects {
  bool absorption = true, scattering = true, emission = true, anisotropic = true, chromatic = true, heterogeneous = true,
       surfaces = true, next_event = true;

  bool operator==(const Effects&) const = default;
};

/// Largest radiance of environment, surfaces and emission; infinite where emission varies in space.
Real brightest(const TransportScene& scene);

Effects effects_of(const TransportScene& scene);

/// Names of the effects that are on, in the order of the fields.
std::vector<std::string> effect_names(const Effects& effects);

}  // namespace nullmark
