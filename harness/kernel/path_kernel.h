#pragma once

#include <memory>
#include <string>

#include "harness/kernel/transport_scene.h"

namespace nullmark {

/// A kernel whose samples estimate the radiance that arrives at the origin of a ray from its direction: one path each, traced
/// backwards [Kutz et al. 2017, Sec. 3].  The camera ray starts at its origin and ends where the scene ends it, whatever part of
/// it the context keeps.
///
/// The estimator samples free flights; it must have `event`, unless nothing scatters or emits.  The kernel is composed from the
/// effects of the scene:
///
///   only absorption     the estimator's own transmittance kernel, times the radiance behind the medium
///   no emission         absorption is no event: scattered light is weighted by the albedo [Kutz et al. 2017, Sec. 5.1.3]
///   no scattering       a path is one flight
///   constant extinction closed-form flights for any estimator: no lookup (transmittances exact)
///   no anisotropy, no surfaces, no next events, grey: none of their code
///
/// `general` has all of them, and the same mean.
///
/// `expected` is known if nothing scatters and the emission is constant, and in equilibrium: if medium, environment and surfaces
/// all emit the same radiance (or the medium none, at albedo 1), this radiance arrives.  Elsewhere it is NaN.
///
/// Throws ParameterError if the parts of the scene, or the estimator and the scene, do not fit: see why_no_paths.
std::unique_ptr<const Kernel> make_path_kernel(const EstimatorSource& estimator, const TransportScene& scene,
                                               bool general = false);

/// Why the estimator cannot compute radiance in the scene, as part of a sentence: it samples no free paths of this many channels,
/// or the medium lacks something it needs.  Empty if it can.
std::string why_no_paths(const EstimatorSource& estimator, const TransportScene& scene, bool general = false);

}  // namespace nullmark
