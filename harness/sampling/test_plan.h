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

/// Number of ray groups: tiles of an image, or runs of a list.  Each group is judged beside all rays together, because pooled
/// biases can cancel.
inline constexpr int kRayGroups = 16;

/// Without a configured allowance, a cell may draw at most this factor times its samples, if the plan says that they suffice.
inline constexpr std::uint64_t kMostSampleFactor = 4;

/// The group of each ray; all 0 if there are too few rays for groups.
std::vector<int> ray_groups(const BuiltRays& rays);

/// One test of a cell: of the mean error of a channel over all rays or over one group, or of the mean lookups.  Chosen before the
/// first sample is drawn.
struct MeanTest {
  static constexpr int kAllRays = -1, kLookups = -1;
  int channel = 0;  ///< output of the quantity (a channel of a transmittance); kLookups: lookups against their expectation
  int group = kAllRays;
  std::size_t rays = 0;        ///< number of rays in the test
  Real epsilon = 0;            ///< absolute margin of PASS
  Real reference_error = 0;    ///< absolute, of the reference
  Real variance = 0;           ///< per sample, averaged over the rays, from theory or a pilot
  Real rounding = 0;           ///< errors up to here are rounding
  bool deterministic = false;  ///< no variance beyond rounding: every single sample should be right
  Real certainly_biased = 0;   ///< deterministic: a sample that is off by more proves a bias; smaller errors are bet on
  TestBasis basis = TestBasis::none;
  Real reference = 0;         ///< expected mean, averaged over the rays
  std::uint64_t planned = 0;  ///< samples per ray at which the test of an unbiased mean passes with a chance of .95
  std::uint64_t sure = 0;     ///< the same, if all tests of the configuration together pass with a chance of .999
  std::vector<std::pair<Role, Bet>> bets;
  std::vector<int> sum_lengths = {1};  ///< errors per sum, ascending: powers of two that divide the samples of a ray

  void place(std::vector<std::pair<Role, Bet>> placed);
};

/// The tests of a cell.
struct TestPlan {
  std::vector<MeanTest> tests;
  /// Tests of stated variances: errors are squared distances to the expected mean minus that variance.
  std::vector<MeanTest> variances;
  std::vector<Real> stated_variance;  ///< [ray * outputs + o]; empty where none is tested
  std::vector<int> group_of;          ///< per ray
  std::vector<Real>
      shift;  ///< [ray * outputs + o], the claimed mean minus the reference, for estimators judged by their own mean
  std::vector<Real> lookups;                ///< per ray, expected; empty where unknown
  Real low = -kInfinity, high = kInfinity;  ///< the declared range of samples
  std::string against;                      ///< see VerdictRecord
  std::string variance_basis;               ///< "analytic", "pilot" or "none"
  std::uint64_t longest_sum = 1;            ///< rounds of samples are multiples of this: a power of two, 1 to 64
  std::uint64_t planned = 0;                ///< samples per ray, of the most demanding test of the mean
  std::uint64_t affordable = 0;             ///< samples per ray that the configuration allows
  std::uint64_t allowance = 0;              ///< samples per ray that an undecided cell may draw
  std::string undecidable;                  ///< why an unbiased cell may stay undecided; empty if at most a thousandth do
  std::vector<std::string> untested;        ///< laws that are not tested, and why
  std::string remedies;                     ///< if nothing, or only one side, can be bet on: what the estimator could state
};

/// Variance per ray and channel from a pilot run, if theory states none.
struct Pilot {
  std::vector<Real> variance;              ///< [ray * outputs + o]
  std::vector<Real> lookups_variance;      ///< per ray
  std::uint64_t samples = 0, lookups = 0;  ///< of all rays
  Real variance_of_variance = 0;           ///< largest over outputs of sum d^4/(sum d^2)^2 - 1/n
  std::uint64_t taken = 0;                 ///< samples a ray that it took of those that were handed in; 0 where it drew its own
};

/// Levels that tests are planned for.
struct TestLevels {
  Real alpha_pass = ErrorRates{}.alpha_pass;
  std::uint64_t tests = 1;  ///< of means, in the whole configuration
};

/// Plans the tests of a cell.  If the majorant is not a bound, ranges of samples that rest on it are not used.  `pilot` is used
/// if theory states no variance.
TestPlan plan_tests(const Cell& cell, const Scene& scene, const Targets& targets, SampleRange range, Guarantee claim,
                    const CellTheory& theory, const std::optional<Pilot>& pilot, const TestLevels& levels);

}  // namespace nullmark
