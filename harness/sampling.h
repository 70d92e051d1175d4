#pragma once

#include <atomic>
#include <functional>
#include <vector>

#include "harness/moments.h"
#include "harness/scene.h"

namespace nullmark {

/// The statistics of one cell, per ray, in an order that no thread count changes.
struct Sampled {
  std::vector<Moments> moments;        ///< [ray * channels + c], errors around the measured reference
  std::vector<Real> reference;         ///< [ray * channels + c], of the measured quantity
  std::vector<std::uint64_t> lookups;  ///< per ray
  std::vector<GroupErrors> groups;     ///< per channel
  Counters counters;
  std::uint64_t nonfinite = 0;
};

/// clamp, then quantise, as configured.
Real measured(Real value, const Measurement& measurement);

/// Draws every sample of the cell with TBB's threads.  Chunks are cut by the plan alone and merged in their order.  `stop` is
/// asked between chunks; the result is empty where it answered true.
std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress);

/// Exact moments of a cell over its rays, where the estimator states them.
struct CellTheory {
  std::vector<std::optional<Real>> variance;      ///< per channel, averaged over rays
  std::vector<std::optional<Real>> squared_bias;  ///< per channel, mean over rays of (mean - reference)^2
  std::vector<std::optional<Real>> bias;
  std::optional<Real> lookups;  ///< averaged over rays
};

/// Theory of several kernels over one scene: each ray's profile is made once for all of them.
std::vector<CellTheory> compute_theory(const Scene& scene, const std::vector<const Kernel*>& kernels,
                                       const std::vector<Quantity>& quantities);

}  // namespace nullmark
