#pragma once

#include <string>
#include <vector>

#include "harness/sampling/scene.h"

namespace nullmark {

/// What the samples of a cell estimate, ray by ray: one number an output.  A transmittance has one output a channel, a free path
/// or a profile several: outputs are listed slowest, channels fastest.
struct Targets {
  std::size_t outputs = 1;         ///< numbers that one sample gives
  std::vector<std::string> names;  ///< per output; empty where outputs are channels
  std::vector<Real> mean, error;   ///< [ray * outputs + o]; the error is a bound on the mean's own
  std::string method;              ///< how they were computed
  bool known = true;               ///< false: no mean is known, and those above are 0
};

/// Exact means of a quantity on every ray of a scene.
///
///   transmittance, optical_depth   what the kernel says it estimates: T, tau, or a factor of T
///   transmittance_profile          T(begin, x) at kProfileMarks equidistant x
///   free_path                      E[w; collision in bin] of kFreePathBins bins, T(x_j) - T(x_{j+1}) each; E[w; scattered],
///                                  albedo (1 - T), where anything scatters; E[w; escape] = T; E[w] = 1
///   radiance                       closed form where nothing scatters, and in equilibrium
///
/// What the configuration gives takes the place of those that are not known, or with a larger error; the others it must agree
/// with.
Targets compute_targets(const Scene& scene, const Kernel& kernel, Quantity quantity,
                        const std::optional<GivenReference>& given = {});

}  // namespace nullmark
