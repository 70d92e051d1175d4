#pragma once

#include <atomic>
#include <functional>
#include <vector>

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
};

/// A range of a cell's samples: first .. first + per_ray - 1 of every ray.
struct SampleSpan {
  std::uint64_t first = 0, per_ray = 0;
  bool only_evidence = false;  ///< leave moments, groups, blocks and squares of lookups empty
  bool keep = false;           ///< keep some values, to draw them again later
};

/// Clamps, then quantises, as configured.
Real measured(Real value, const Measurement& measurement);

/// Draws every sample of the cell with TBB's threads.  Chunks depend only on the plan and are merged in order.  `stop` is called
/// between chunks; once it returns true, the result is empty.  If there is a plan, evidence is gathered for its tests.
std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets,
                                   SampleSpan span, const TestPlan* plan, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress);

}  // namespace nullmark
