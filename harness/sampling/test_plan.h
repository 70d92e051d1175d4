#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/plan.h"
#include "harness/model/record.h"
#include "harness/sampling/scene.h"
#include "harness/sampling/theory.h"
#include "harness/statistics/bets.h"

namespace nullmark {

/// Groups that rays are judged in beside all of them together, since pooled biases cancel: tiles of an image, or runs of a list.
inline constexpr int kRayGroups = 16;

/// Where the configuration names no allowance, a cell that is decidable by its samples may draw so many times as many.
inline constexpr std::uint64_t kMostSampleFactor = 4;

/// The group of each ray; all 0 where there are too few rays for groups.
std::vector<int> ray_groups(const BuiltRays& rays);

/// One test of a cell: the mean error of a channel over all rays or over one group, or the mean lookups.  Decided before the
/// first sample is drawn.
struct MeanTest {
  static constexpr int kAllRays = -1, kLookups = -1;
  int channel = 0;  ///< output of the quantity (a channel of a transmittance); kLookups: lookups against their expectation
  int group = kAllRays;
  std::size_t rays = 0;        ///< that take part
  Real epsilon = 0;            ///< absolute margin of PASS
  Real reference_error = 0;    ///< absolute, of the reference
  Real variance = 0;           ///< per sample, averaged over the rays, as theory or a pilot has it
  Real rounding = 0;           ///< errors up to here are rounding
  bool deterministic = false;  ///< no variance beyond rounding: every single sample must be right
  std::string basis;           ///< see TestRecord
  Real reference = 0;          ///< expected mean, averaged over the rays
  std::uint64_t planned = 0;   ///< samples per ray at which the test of an unbiased mean passes with a chance of .95
  std::uint64_t sure = 0;      ///< the same, where all tests of the configuration together do with a chance of .999
  std::vector<std::pair<Role, Bet>> bets;
  std::vector<int> sum_lengths = {1};  ///< errors that share a sum, ascending: powers of two that divide the samples of a ray

  void place(std::vector<std::pair<Role, Bet>> placed);
};

/// What a cell's samples are judged by.
struct TestPlan {
  std::vector<MeanTest> tests;
  /// Of outputs whose stated variance is tested: errors are squared distances to the expected mean less that variance.
  std::vector<MeanTest> variances;
  std::vector<Real> stated_variance;  ///< [ray * outputs + o]; empty where none is tested
  std::vector<int> group_of;          ///< per ray
  std::vector<Real>
      shift;  ///< [ray * outputs + o], the claimed mean minus the reference, for estimators judged by their own mean
  std::vector<Real> lookups;                ///< per ray, expected; empty where unknown
  Real low = -kInfinity, high = kInfinity;  ///< the declared range of samples
  std::string against;                      ///< "reference" or "own mean"
  std::string variance_basis;               ///< "analytic", "pilot" or "none"
  std::uint64_t longest_sum = 1;            ///< what rounds of samples are multiples of: 1 to 64, a power of two
  std::uint64_t planned = 0;                ///< samples per ray, of the most demanding test of the mean
  std::uint64_t affordable = 0;             ///< samples per ray that the configuration allows
  std::uint64_t allowance = 0;              ///< samples per ray that an undecided cell may draw
  std::string undecidable;            ///< why an unbiased cell may stay undecided; empty where a thousandth of such do at most
  std::vector<std::string> untested;  ///< laws that would be tested, and why they are not
  std::string remedies;  ///< of a cell in which nothing, or one side only, could be bet: what its estimator could state
};

/// Variance per ray and channel from a pilot run, where theory has none.
struct Pilot {
  std::vector<Real> variance;              ///< [ray * outputs + o]
  std::vector<Real> lookups_variance;      ///< per ray
  std::uint64_t samples = 0, lookups = 0;  ///< of all rays
  Real variance_of_variance = 0;           ///< largest over outputs of sum d^4/(sum d^2)^2 - 1/n
};

/// What tests are planned for.
struct TestLevels {
  Real alpha_pass = ErrorRates{}.alpha_pass;
  std::uint64_t tests = 1;  ///< of means, in the whole configuration
};

/// Plans the tests of a cell.  Where the majorant does not bound, ranges that rest on it are not claimed.  `pilot` serves where
/// theory has no variance.
TestPlan plan_tests(const Cell& cell, const Scene& scene, const Targets& targets, SampleRange range, Guarantee claim,
                    const CellTheory& theory, const std::optional<Pilot>& pilot, const TestLevels& levels);

}  // namespace nullmark
