// Estimators that are registered to put published claims to the test.

#include <gtest/gtest.h>

#include "harness/config/config.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

std::vector<CellRecord> run_of(const std::string& estimator, const std::string& medium, std::uint64_t samples) {
  return run_untimed(
      read_config(R"({"nullmark":"config/2","name":"t","timing":{"enabled":false},"experiments":[{"name":"e","rays":"single",)"
                  R"("samples_per_ray":)" +
                      std::to_string(samples) + R"(,"verdict":{"enabled":false},"matrix":{"estimator":)" + estimator +
                      R"(,"medium":)" + medium + "}}]}",
                  "t.json"));
}

/// The march of one step and all differences make T: E e^{-v(o)} + sum_n E D_n, whose levels beyond 10 are below 1e-9 here.
TEST(TelescopingDifference, OneStepAndAllDifferencesAreTheTransmittance) {
  for (const char* marches : {"correlated", "independent"}) {
    const auto cells = run_of(std::string(R"([{"type":"ray_marching","steps":1,"offset":"uniform"},)"
                                          R"({"type":"telescoping_difference","level":[0,1,2,3,4,5,6,7],"marches":")") +
                                  marches + "\"}]",
                              R"({"type":"linear","optical_depth":1})", 400'000);
    Real sum = 0, squares = 0;
    for (const CellRecord& record : cells) {
      sum += *record.channel[0].mean;
      squares += *record.channel[0].variance / 400'000;
    }
    EXPECT_NEAR(sum, std::exp(-1.), 5 * std::sqrt(squares)) << marches;
    EXPECT_LT(std::sqrt(squares), 1e-3);
  }
}

TEST(TelescopingDifference, TakesWhatItsMarchesTake) {
  const auto cells = run_of(
      R"([{"type":"telescoping_difference","level":3},{"type":"telescoping_difference","level":3,"marches":"independent"}])",
      R"("linear")", 100);
  EXPECT_EQ(*cells[0].lookups_per_sample, 16);
  EXPECT_EQ(*cells[1].lookups_per_sample, 24);
}

/// The naive mean of two normal depths is off by e^{s^2/4}; the jackknife is not.
TEST(JackknifeNormal, HasTheMomentsOfItsClosedForms) {
  const auto cells = run_of(R"([{"type":"jackknife_normal","deviation":0.8,"mean":["jackknife","naive"]}])",
                            R"({"type":"homogeneous","extinction":1})", 2'000'000);
  const Real t = std::exp(-1.), s2 = 0.64;
  const std::vector<Real> means = {t, t * std::exp(s2 / 4)};
  const std::vector<Real> variances = {t * t * std::expm1(s2) / 2, t * t * (std::exp(s2) - std::exp(s2 / 2))};
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(*cells[i].channel[0].mean, means[i], 5 * std::sqrt(variances[i] / 2e6));
    EXPECT_NEAR(*cells[i].channel[0].variance / variances[i], 1, 0.01);
    EXPECT_NEAR(*cells[i].channel[0].variance_theory, variances[i], 1e-12);
    EXPECT_EQ(*cells[i].lookups_per_sample, 0);
  }
  EXPECT_NEAR(*cells[1].channel[0].bias_theory, means[1] - t, 1e-12);
}

/// Figures of the published listing's fault: mean free path .318 for .480, lookups 1.052 for .960.
TEST(PublishedDecomposition, StartsAnewAfterEveryNullCollision) {
  const auto cells = run_of(
      R"(["analog_decomposition","analog_decomposition_published_reset"])",
      R"({"type":"sum","media":[{"type":"homogeneous","extinction":1},{"type":"cosine","frequency":6.283185307179586,"phase":0}]})",
      1'000'000);
  const Real right = std::exp(-2.);
  EXPECT_NEAR(*cells[0].channel[0].mean, right, 5 * std::sqrt(right / 1e6));
  EXPECT_LT(*cells[1].channel[0].mean, 0.7 * right);
}

/// Its program's first lookup lies before the ray: T^(1 - 1/k), and of 2x the first 3 of 4 strata, whose integral is 9/16.
TEST(PublishedStratified, LosesTheLastStratum) {
  const auto exact = run_of(R"(["stratified_published_offset"])", R"({"type":"homogeneous","extinction":1})", 10);
  EXPECT_NEAR(*exact[0].channel[0].mean, std::exp(-0.999), 1e-12);
  EXPECT_EQ(*exact[0].lookups_per_sample, 999);
  const auto linear =
      run_of(R"([{"type":"stratified_published_offset","steps":4}])", R"({"type":"linear","optical_depth":1})", 400'000);
  // Each of three lookups is uniform in a stratum of 1/4: a depth of 2x is off by a uniform error of width 1/8, whose exponential
  // has the mean 16 sinh(1/16).
  EXPECT_NEAR(*linear[0].channel[0].mean, std::exp(-9 / 16.) * std::pow(16 * std::sinh(1 / 16.), 3),
              5 * std::sqrt(*linear[0].channel[0].variance / 400'000));
}

}  // namespace
}  // namespace nullmark
