// From figures to verdicts.

#include "harness/verdict/verdict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "harness/io/verdict_json.h"
#include "harness/testing/verdict_examples.h"

namespace nullmark {
namespace {

/// Of a cell with this test alone.
Outcome decide(const TestRecord& test, Real alpha_fail, Real alpha_pass) {
  const Proof proof = proven(test, alpha_fail, alpha_pass);
  if (proof.biased) return Outcome::fail;
  return proof.within ? Outcome::pass : Outcome::inconclusive;
}

Outcome decided(VerdictRecord verdict) {
  decide(verdict);
  return verdict.unbiased;
}

Real just_below(Real x) { return std::nextafter(x, -kInfinity); }

TEST(Verdict, ThresholdsAreTheLevels) {
  TestRecord test = passing();
  const Real proof = -std::log(kAlpha);
  test.log_e_fail = proof;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::fail);
  test.log_e_fail = just_below(proof);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.log_e_low = test.log_e_high = kNeeded;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.log_e_low = just_below(kNeeded);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
  test.log_e_low = 100;
  test.log_e_high = just_below(kNeeded);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
}

TEST(Verdict, EvidenceThatIsNoNumberProvesNothing) {
  for (const Real nothing : {-kInfinity, std::numeric_limits<Real>::quiet_NaN()})
    for (Real TestRecord::*figure : {&TestRecord::log_e_low, &TestRecord::log_e_high}) {
      TestRecord test = passing();
      test.*figure = nothing;
      EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
    }
  EXPECT_EQ(decide(deterministic(std::numeric_limits<Real>::quiet_NaN()), kAlpha, kAlphaPass), Outcome::fail);
}

TEST(Verdict, AReferenceTooCoarseProvesNothing) {
  TestRecord test = passing();
  test.reference_error = 0.25 * test.epsilon;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.reference_error = 0.26 * test.epsilon;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
  test.log_e_fail = 100;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::fail);
  // Samples that are all the same as well.
  test = deterministic(0.005);
  test.reference_error = 0.006;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
}

TEST(Verdict, WithoutVarianceEverySampleMustBeRight) {
  TestRecord test = deterministic(0);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.largest_error = test.rounding + test.reference_error;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  test.largest_error = std::nextafter(test.largest_error, 1);
  test.log_e_fail = kCertain;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::fail);
  test.largest_error = 0;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
}

/// What theory calls no variance may be a small one.
TEST(Verdict, SamplesThatAreOffABitNeedEvidence) {
  TestRecord test = deterministic(0.009);
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::fail);
  test.log_e_fail = just_below(-std::log(kAlpha));
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::pass);
  VerdictRecord verdict = verdict_of({test});
  verdict.tests[0].reference = 1;
  decide(verdict);
  EXPECT_EQ(verdict.proves, "|bias| < 0.9 % of the mean");
  verdict.tests[0].log_e_fail = 100;
  decide(verdict);
  EXPECT_NE(verdict.reason.find("a sample is off by 0.009, "), std::string::npos) << verdict.reason;
  EXPECT_NE(verdict.reason.find("biased, or theory() is wrong to state a variance of 0"), std::string::npos) << verdict.reason;
  verdict.variance_basis = "none";
  decide(verdict);
  EXPECT_EQ(verdict.reason.find("theory()"), std::string::npos) << verdict.reason;
  test.largest_error = 0.011;
  EXPECT_EQ(decide(test, kAlpha, kAlphaPass), Outcome::inconclusive);
  verdict = verdict_of({test});
  decide(verdict);
  EXPECT_NE(verdict.reason.find("a sample is off by 0.011, "), std::string::npos) << verdict.reason;
}

TEST(Verdict, LevelsAreSharedOutOverTheFamily) {
  VerdictRecord verdict = verdict_of({passing()});
  verdict.tests[0].log_e_fail = -std::log(kAlpha);
  EXPECT_EQ(decided(verdict), Outcome::fail);
  verdict.family = 2;
  EXPECT_EQ(decided(verdict), Outcome::pass);
  verdict.tests[0].log_e_fail = -std::log(kAlpha / 2);
  EXPECT_EQ(decided(verdict), Outcome::fail);
  // PASS needs every test, so it needs no correction.
  verdict = verdict_of({passing(), passing(1)});
  verdict.family = 1'000'000;
  EXPECT_EQ(decided(verdict), Outcome::pass);
  // Lookups are a family of their own.
  verdict = verdict_of({passing(), passing(-1)});
  verdict.family = 1'000'000;
  verdict.tests[1].log_e_fail = -std::log(kAlpha);
  decide(verdict);
  EXPECT_EQ(verdict.unbiased, Outcome::pass);
  EXPECT_EQ(verdict.lookups, Outcome::fail);
}

TEST(Verdict, TheWorstTestDecides) {
  EXPECT_EQ(decided(verdict_of({})), Outcome::none);
  EXPECT_EQ(decided(verdict_of({passing(-1)})), Outcome::none);
  EXPECT_EQ(decided(verdict_of({passing(), passing(1)})), Outcome::pass);
  EXPECT_EQ(decided(verdict_of({passing(), open_one(1)})), Outcome::inconclusive);
  EXPECT_EQ(decided(verdict_of({open_one(), failing(1)})), Outcome::fail);
  EXPECT_EQ(decided(verdict_of({deterministic(0), open_one(1)})), Outcome::inconclusive);
  EXPECT_EQ(decided(verdict_of({deterministic(1), passing(1)})), Outcome::fail);
  TestRecord group = failing();
  group.group = 7;
  VerdictRecord verdict = verdict_of({passing(), group});
  decide(verdict);
  EXPECT_EQ(verdict.unbiased, Outcome::fail);
  EXPECT_EQ(verdict.reason.find("ray group 7: "), 0u) << verdict.reason;
  group.channel = 1;
  verdict = verdict_of({passing(), passing(1), group});
  decide(verdict);
  EXPECT_EQ(verdict.reason.find("channel 1, ray group 7: "), 0u) << verdict.reason;
}

TEST(Verdict, ReasonsAreGivenAndForgotten) {
  VerdictRecord verdict = verdict_of({open_one(2)});
  decide(verdict);
  EXPECT_EQ(verdict.reason, "undecided after 1000 samples a ray; 800 were planned");
  verdict.tests = {passing()};
  decide(verdict);
  EXPECT_EQ(verdict.reason, "");
  // The plan's own reason stands.
  verdict = verdict_of({open_one()});
  verdict.planned_undecidable = true;
  verdict.reason = "too deep";
  EXPECT_EQ(decided(verdict), Outcome::inconclusive);
  decide(verdict);
  EXPECT_EQ(verdict.reason, "too deep");
}

/// A channel whose samples are all the same must not speak for one whose mean is known to epsilon.
TEST(Verdict, APassProvesWhatTheWidestOfItsTestsExcludes) {
  TestRecord same = deterministic(0), wide = passing(1), group = passing();
  same.reference = wide.reference = group.reference = 0.5;
  group.group = 2;
  group.epsilon = 0.04;
  VerdictRecord verdict = verdict_of({same, wide, group, passing(-1)});
  decide(verdict);
  EXPECT_EQ(verdict.unbiased, Outcome::pass);
  EXPECT_EQ(verdict.proves, "|bias| < 2 % of the mean");
  EXPECT_DOUBLE_EQ(excluded_bias(verdict), 0.02);
  EXPECT_DOUBLE_EQ(excluded_bias_of_groups(verdict), 0.08);
  verdict = verdict_of({same});
  EXPECT_EQ(excluded_bias_of_groups(verdict), 0);
  EXPECT_DOUBLE_EQ(excluded_bias(verdict), (same.rounding + same.reference_error) / 0.5);
}

TEST(Verdict, ViolationsAndImpossibleSamplesComeFirst) {
  VerdictRecord verdict = verdict_of({passing()});
  verdict.out_of_range = 1;
  decide(verdict);
  EXPECT_EQ(verdict.unbiased, Outcome::fail);
  EXPECT_EQ(verdict.reason,
            "1 sample lies outside the declared range; if such samples are right, the tracker must declare a wider range");
  decide(verdict, {}, "unit");
  EXPECT_EQ(verdict.reason,
            "1 sample lies outside the declared range (unit: 0 to 1); if such samples are right, the tracker must declare a "
            "wider range");
  // What the mean shows stands beside it, so that nobody widens the range and believes the rest.
  VerdictRecord both = verdict_of({failing()});
  both.out_of_range = 1;
  decide(both);
  EXPECT_EQ(both.unbiased, Outcome::fail);
  EXPECT_NE(both.reason.find("the tracker must declare a wider range; mean "), std::string::npos) << both.reason;
  EXPECT_NE(both.reason.find("no bias is proven: the evidence (log E "), std::string::npos) << both.reason;
  verdict.out_of_range = 0;
  verdict.nonfinite = 1;
  EXPECT_EQ(decided(verdict), Outcome::fail);
  verdict.violated = true;
  EXPECT_EQ(decided(verdict), Outcome::violated);
  // Without a true majorant a bias is no fault.
  verdict = verdict_of({failing()});
  verdict.violated = true;
  EXPECT_EQ(decided(verdict), Outcome::violated);
}

TEST(Verdict, AnEstimatorThatPredictsItsBiasIsNeverCalledUnbiased) {
  for (TestRecord test : {passing(), open_one(), failing()}) {
    VerdictRecord verdict = verdict_of({test});
    verdict.against = "own mean";
    verdict.unbiased = Outcome::pass;  // as a file may falsely say
    decide(verdict);
    EXPECT_EQ(verdict.unbiased, Outcome::none);
    EXPECT_EQ(verdict.own_mean, decided(verdict_of({test})));
    EXPECT_TRUE(verdict_json(verdict)["unbiased"].is_null());
  }
}

}  // namespace
}  // namespace nullmark
