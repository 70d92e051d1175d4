// What the plan of a cell's tests advises where nothing can be bet on.

#include "harness/sampling/test_plan.h"

#include <gtest/gtest.h>

namespace nullmark {
namespace {

/// The plan for one ray of mean 1/2.
TestPlan plan_of(std::uint64_t samples, SampleRange range, bool bounding, const CellTheory& theory,
                 const std::optional<Pilot>& pilot, Quantity quantity = Quantity::transmittance) {
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
  return plan_tests(cell, scene, targets, range, Guarantee::unbiased, theory, pilot, {});
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

}  // namespace
}  // namespace nullmark
