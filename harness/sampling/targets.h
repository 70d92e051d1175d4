#pragma once

#include <string>
#include <vector>

#include "harness/sampling/scene.h"

namespace nullmark {

/// The means that the samples of a cell estimate: one number per ray and output.  A transmittance has one output per channel, a
/// free path or a profile has several.  Channels vary fastest in the list of outputs.
struct Targets {
  std::size_t outputs = 1;         ///< numbers per sample
  std::vector<std::string> names;  ///< per output; empty if outputs are channels
  std::vector<Real> mean, error;   ///< [ray * outputs + o]; `error` bounds the error of `mean`
  std::vector<Real> size;          ///< [ray * outputs + o], what margins are relative to; empty: `mean`
  std::string method;              ///< how they were computed
  bool known = true;               ///< false: no mean is known, and `mean` is 0
};

/// Exact means of a quantity on every ray of a scene.
///
///   transmittance, optical_depth   what the kernel estimates: T, tau, or a factor of T
///   transmittance_profile          T(begin, x) at kProfileMarks equidistant x
///   free_path                      E[w; collision in bin] of kFreePathBins bins, T(x_j) - T(x_{j+1}) each; E[w; scattered],
///                                  albedo (1 - T), if anything scatters; E[w; escape] = T; E[w] = 1
///   radiance                       closed form if nothing scatters, and in equilibrium
///
/// A mean from the configuration replaces an unknown one, or one with a larger error.  It must agree with any other.
Targets compute_targets(const Scene& scene, const Kernel& kernel, Quantity quantity,
                        const std::optional<GivenReference>& given = {});

}  // namespace nullmark
