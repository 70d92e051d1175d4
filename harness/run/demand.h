#pragma once

#include <optional>

#include "harness/sampling/cell_preparation.h"
#include "harness/verdict/judge.h"

namespace nullmark {

/// What a cell would draw, foreseen from some of its rays and a few samples: counts, which are the same on every machine. Samples
/// are those of each of these rays, which stand for as many of the cell's.
struct Demand {
  /// `prepared` has its theory, and one ray for `rays_for_each` of the cell's.  Where theory states no variance, a small pilot is
  /// drawn.
  Demand(const PreparedCell& prepared, const TestLevels& levels, double rays_for_each);
  Demand(const Demand&) = delete;
  Demand& operator=(const Demand&) = delete;

  Counters probe;      ///< of some samples
  Cell cell;           ///< with as many samples in total, on the rays at hand
  PreparedCell whole;  ///< of that cell
  std::optional<TestPlan> tests;
  double samples = 0, pilot = 0;  ///< for the statistics and the verdict; for the pilot
  double laws = 0;                ///< samples that cost as much as the laws of walks
};

}  // namespace nullmark
