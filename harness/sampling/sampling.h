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

/// The statistics of one cell, per ray, in an order that no thread count changes.
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
  std::vector<Evidence> variances;  ///< one per variance that the plan tests; none of samples that are evidence alone
  KeptSamples kept;                 ///< where the span asks for them
  /// Of all threads: evidence alone; all that is done with samples once they are drawn; everything.
  double judging_seconds = 0, statistics_seconds = 0, working_seconds = 0;
};

/// Which of a cell's samples: first .. first + per_ray - 1 of every ray.
struct SampleSpan {
  std::uint64_t first = 0, per_ray = 0;
  bool only_evidence = false;  ///< moments, groups, blocks and squares of lookups hold nothing
  bool keep = false;           ///< some values are kept to be drawn again
};

/// clamp, then quantise, as configured.
Real measured(Real value, const Measurement& measurement);

/// Draws every sample of the cell with TBB's threads.  Chunks are cut by the plan alone and merged in their order.  `stop` is
/// asked between chunks; the result is empty where it answered true.  Evidence is gathered for the plan's tests where there is
/// one.
std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets,
                                   SampleSpan span, const TestPlan* plan, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress);

}  // namespace nullmark
