// What the plan of a cell's tests advises where nothing can be bet on, and what it believes of theory.

#include "harness/sampling/test_plan.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "harness/sampling/test_evidence.h"

namespace nullmark {
namespace {

/// The plan for one ray of mean 1/2.
TestPlan plan_of(std::uint64_t samples, SampleRange range, bool bounding, const CellTheory& theory,
                 const std::optional<Pilot>& pilot, Quantity quantity = Quantity::transmittance,
                 Guarantee claim = Guarantee::unbiased) {
  Scene scene;
  const auto rays = std::make_shared<BuiltRays>();
  rays->world.resize(1);
  scene.rays = rays;
  scene.bounding = bounding;
  Cell cell;
  cell.quantity = quantity;
  cell.samples_per_ray = samples;
  Targets targets;
  targets.mean = {0.5};
  targets.error = {1e-12};
  return plan_tests(cell, scene, targets, range, claim, theory, pilot, {});
}

/// Without theory and with a pilot that shows a heavy tail.
std::string advice(SampleRange range, bool bounding, Quantity quantity = Quantity::transmittance) {
  return plan_of(1024, range, bounding, {}, Pilot{{0.1}, {1}, 1000, 1000, 1}, quantity).remedies;
}

TEST(TestPlan, AdvisesOnlyWhatWouldHelp) {
  constexpr const char *kBound = "a majorant that is known to bound",
                       *kRange = "the tracker could state a range of its samples (kRange; in other languages: range)";
  EXPECT_EQ(advice(SampleRange::unit, true), "");
  EXPECT_EQ(advice(SampleRange::any_sign, true).rfind(kRange, 0), 0u);
  EXPECT_EQ(advice(SampleRange::non_negative, true)
                .rfind("the tracker could state a range that is bounded above (kRange; in other languages: range)", 0),
            0u);
  // A range of 0 and 1 holds whatever the majorant is; others do not.
  EXPECT_EQ(advice(SampleRange::binary, false), "");
  for (const SampleRange range : {SampleRange::unit, SampleRange::non_negative, SampleRange::any_sign}) {
    EXPECT_NE(advice(range, false).find(kBound), std::string::npos) << advice(range, false);
    EXPECT_EQ(advice(range, false).find("state a range"), std::string::npos) << advice(range, false);
  }
  // kRange is that of the transmittance.
  for (const bool bounding : {true, false})
    EXPECT_EQ(advice(SampleRange::unit, bounding, Quantity::optical_depth).find("kRange"), std::string::npos);
  for (const bool bounding : {true, false})
    for (const char* remedy : {"(theory)", "\"exact\""})
      EXPECT_NE(advice(SampleRange::any_sign, bounding).find(remedy), std::string::npos);
}

TEST(TestPlan, AsksForNoLessThanItPlans) {
  for (Real variance = 0.01; variance < 0.25; variance *= 1.07) {
    CellTheory theory;
    theory.variance = {variance};
    theory.ray_variance = {variance};
    const TestPlan plan = plan_of(4, SampleRange::unit, true, theory, {});
    const std::size_t needs = plan.undecidable.find(" needs ");
    ASSERT_NE(needs, std::string::npos) << plan.undecidable;
    const double told = std::stod(plan.undecidable.substr(needs + 7));
    EXPECT_GE(told, static_cast<double>(plan.planned)) << plan.undecidable;
    EXPECT_LE(told, 1.1 * static_cast<double>(plan.planned)) << plan.undecidable;
  }
}

/// The test of the mean of 4096 samples, every other one off by `even`, the others by `odd`, where theory states no variance.
TestRecord without_variance(Guarantee claim, Real even, Real odd) {
  CellTheory theory;
  theory.variance = {0};
  theory.ray_variance = {0};
  const TestPlan plan = plan_of(4096, SampleRange::any_sign, true, theory, {}, Quantity::transmittance, claim);
  std::map<std::size_t, Evidence> evidence;
  EvidenceAccumulator accumulator(&plan, plan.tests, 1, EvidenceAccumulator::Memory::of_this_thread(), evidence);
  std::vector<Real> errors;
  for (int i = 0; i < 2048; ++i) errors.insert(errors.end(), {even, odd});
  accumulator.add_errors(0, 0, errors);
  accumulator.finish();
  return test_record(plan.tests.at(0), evidence.at(0));
}

TEST(TestPlan, WhatTheoryCallsNoVarianceHasFewDigits) {
  constexpr Real kProof = 30;
  EXPECT_EQ(without_variance(Guarantee::unbiased, 1e-15, -1e-15).log_e_fail, 0);
  // E[X^2] - T^2 of theory may be 0 where the variance is below its rounding.
  EXPECT_LT(without_variance(Guarantee::unbiased, 3e-7, -3e-7).log_e_fail, 0);
  for (const Real bias : {5e-7, -5e-7, 1e-5, 4e-4})
    EXPECT_GT(without_variance(Guarantee::unbiased, bias, bias).log_e_fail, kProof);
  // No noise of last digits.
  EXPECT_EQ(without_variance(Guarantee::unbiased, 0.1, -0.1).log_e_fail, kCertain);
  // Whoever guarantees to be exact needs no theory.
  EXPECT_EQ(without_variance(Guarantee::exact, 3e-7, -3e-7).log_e_fail, kCertain);
}

}  // namespace
}  // namespace nullmark
