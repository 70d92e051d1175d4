#pragma once

#include <atomic>
#include <functional>
#include <vector>

#include "harness/gate.h"
#include "harness/moments.h"
#include "harness/scene.h"

namespace nullmark {

/// The statistics of one cell, per ray, in an order that no thread count changes.
struct Sampled {
  std::vector<Moments> moments;        ///< [ray * channels + c], errors around the measured reference
  std::vector<Real> reference;         ///< [ray * channels + c], of the measured quantity
  std::vector<std::uint64_t> lookups;  ///< per ray
  std::vector<Real> lookups_squared;   ///< per ray, sum over the samples
  std::vector<GroupErrors> groups;     ///< per channel
  Counters counters;
  std::uint64_t nonfinite = 0, out_of_range = 0;
  std::vector<Evidence> evidence;                   ///< one per test of the gate
  double judging_seconds = 0, working_seconds = 0;  ///< of all threads: evidence alone, and everything
};

/// Which of a cell's samples: first .. first + per_ray - 1 of every ray.
struct SampleSpan {
  std::uint64_t first = 0, per_ray = 0;
  bool about_zero = false;  ///< moments of the samples themselves instead of their errors
};

/// clamp, then quantise, as configured.
Real measured(Real value, const Measurement& measurement);

/// Draws every sample of the cell with TBB's threads.  Chunks are cut by the plan alone and merged in their order.  `stop` is
/// asked between chunks; the result is empty where it answered true.  Evidence is gathered for the gate's tests where there is
/// one.
std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, SampleSpan span,
                                   const CellGate* gate, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress);

/// Exact moments of a cell over its rays, where the estimator states them.
struct CellTheory {
  std::vector<std::optional<Real>> variance;      ///< per channel, averaged over rays
  std::vector<std::optional<Real>> squared_bias;  ///< per channel, mean over rays of (mean - reference)^2
  std::vector<std::optional<Real>> bias;
  std::optional<Real> lookups;  ///< averaged over rays
  /// Per ray and channel; empty where not known for all.  The estimator's target; variance of a sample; the estimator's own mean
  /// minus the target.
  std::vector<Real> ray_expected, ray_variance, ray_shift;
  std::vector<Real> ray_lookups, ray_lookups_variance;  ///< per ray; empty where not known for all
};

/// The targets of a kernel on every ray, for kernels that state no theory.
std::vector<Real> expected_of(const Scene& scene, const Kernel& kernel, Quantity quantity);

/// Whether the majorant bounds the extinction in every segment of every ray.
bool bounds_everywhere(const Scene& scene, const Kernel& kernel);

/// Theory of several kernels over one scene: each ray's profile is made once for all of them.
std::vector<CellTheory> compute_theory(const Scene& scene, const std::vector<const Kernel*>& kernels,
                                       const std::vector<Quantity>& quantities);

}  // namespace nullmark
