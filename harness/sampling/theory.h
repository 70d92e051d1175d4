#pragma once

#include <optional>
#include <vector>

#include "harness/sampling/scene.h"
#include "harness/sampling/targets.h"

namespace nullmark {

/// Exact moments of a cell over its rays, if the estimator states them.
struct CellTheory {
  std::vector<std::optional<Real>> variance;      ///< per output, averaged over rays
  std::vector<std::optional<Real>> squared_bias;  ///< per output, mean over rays of (mean - reference)^2
  std::vector<std::optional<Real>> bias;
  std::optional<Real> lookups;  ///< averaged over rays
  Real most_lookups = 0;        ///< expected of a sample of the ray with most; may be infinite; 0 where none are stated
  Real majorant_depth = 0;      ///< averaged over rays: an estimate of the lookups if none are stated
  bool unit_weights = false;    ///< for a free path: its weight is always 1
  /// Per ray and output; empty unless known for all: variance of a sample; the estimator's own mean minus the target.
  std::vector<Real> ray_variance, ray_shift;
  bool infinite_variance = false;                       ///< stated for some ray: no sample variance can be trusted
  std::vector<Real> ray_lookups, ray_lookups_variance;  ///< per ray; empty unless known for all
  Real work = 0;  ///< points of the medium that the theory of a ray looked at, on average: what it costs
};

/// Theory of several kernels over one scene; the profile of each ray is computed once for all of them.
struct TheoryQuery {
  const Kernel* kernel = nullptr;
  Quantity quantity = Quantity::transmittance;
  SampleRange range = SampleRange::any_sign;
  const Targets* targets = nullptr;
  const std::string* name = nullptr;  ///< of the cell, for messages; must outlive the computation
};
std::vector<CellTheory> compute_theory(const Scene& scene, const std::vector<TheoryQuery>& queries);

/// The extinction at distances along a ray.  Adds the number of distances to `count`.
RayProfile::Lookup lookups_along(const Medium& medium, const Ray& local, std::uint64_t* count = nullptr);

/// The extinction along a ray, cut at the medium's knots and the segments' ends.
RayProfile make_profile(const Medium& medium, const Ray& local, const std::vector<Segment>& segments,
                        std::uint64_t* count = nullptr);

}  // namespace nullmark
