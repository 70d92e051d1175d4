#pragma once

#include <functional>
#include <vector>

#include "harness/sampling/draw_portions.h"
#include "harness/sampling/kept_samples.h"
#include "harness/sampling/scene.h"
#include "harness/sampling/targets.h"
#include "harness/sampling/test_evidence.h"
#include "harness/sampling/test_plan.h"
#include "harness/statistics/moments.h"

namespace nullmark {

/// The statistics of one cell, per ray.  Their order does not depend on the number of threads.
struct Sampled {
  std::vector<Moments> moments;                ///< [ray * outputs + o], errors around the measured target
  std::vector<std::uint64_t> lookups;          ///< per ray
  std::vector<Real> lookups_squared;           ///< per ray, sum over the samples
  std::vector<std::uint64_t> null_collisions;  ///< per ray
  std::vector<GroupErrors> groups;             ///< per output
  std::vector<BlockErrors> blocks;             ///< per output
  Counters counters;
  std::uint64_t nonfinite = 0, out_of_range = 0;
  Real largest = 0;                 ///< max |X| of the finite samples
  std::vector<Evidence> evidence;   ///< one per test of the plan
  std::vector<Evidence> variances;  ///< one per variance that the plan tests; empty with only_evidence
  KeptSamples kept;                 ///< if the span asks for them
  /// Time of all threads: for evidence; for all statistics of drawn samples; in total.
  double judging_seconds = 0, statistics_seconds = 0, working_seconds = 0;

  Real lookups_of_a_sample() const {
    return static_cast<Real>(counters.lookups) / static_cast<Real>(std::max<std::uint64_t>(1, counters.samples));
  }
};

/// Clamps, then quantises, as configured.
Real measured(Real value, const Measurement& measurement);

/// Folds all portions of a span in their order.
Sampled fold(const Portions& portions, std::size_t rays, std::size_t outputs, const SampleSpan& span, const TestPlan* plan);

/// Draws every sample of the span and folds it: the same bits for any number of threads.
std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets,
                                   SampleSpan span, const TestPlan* plan, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress);

}  // namespace nullmark
