#pragma once

#include <memory>
#include <string>

#include "harness/kernel/transport_scene.h"

namespace nullmark {

/// A kernel whose samples estimate the radiance that arrives at the origin of a ray from its direction: one path each, traced
/// backwards [Kutz et al. 2017, Sec. 3].  The camera ray starts at its origin and ends where the scene ends it, whatever
/// part of it the context keeps.
///
/// Free flights are the estimator's; it must answer `event`, unless nothing scatters or emits.  The kernel is composed from the
/// scene's effects:
///
///   only absorption     the estimator's own transmittance kernel, times the radiance behind the medium
///   no emission         absorption is no event: scattered light is weighted by the albedo [Kutz et al. 2017, Sec. 5.1.3]
///   no scattering       a path is one flight
///   constant extinction closed-form flights, whatever the estimator: no lookup (transmittances exact)
///   no anisotropy, no surfaces, no next events, grey: none of their code
///
/// `general` leaves out none of them, and has the same mean.
///
/// `expected` is known where nothing scatters and what is emitted is constant, and in equilibrium: where medium, environment and
/// surfaces all emit the same radiance (or the medium nothing, at albedo 1) that is what arrives.  Elsewhere it is NaN.
///
/// Throws ParameterError where the scene's parts do not fit each other, or the estimator the scene: see why_no_paths.
std::unique_ptr<const Kernel> make_path_kernel(const EstimatorSource& estimator, const TransportScene& scene,
                                               bool general = false);

/// Why the estimator cannot carry light through the scene, in half a sentence: it samples no free paths of so many channels, or
/// needs of the medium what it has not.  Empty where it can.
std::string why_no_paths(const EstimatorSource& estimator, const TransportScene& scene, bool general = false);

}  // namespace nullmark
