// Pairs of trackers that are compared with each other, where no mean is known.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "harness/analysis/check.h"
#include "harness/config/config.h"
#include "harness/io/results_json.h"
#include "harness/testing/run_untimed.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

RunRecord run_pairs(const std::string& estimators, const std::string& minus, const std::string& more = "", int samples = 524288) {
  const Plan plan = read_config(
      fmt::format(R"({{"nullmark":"config/2","name":"pairs","timing":{{"enabled":false}},"experiments":[{{"name":"pairs",
        "rays":"single","samples_per_ray":{},{}"matrix":{{"estimator":[{}],"minus":[{}],
        "medium":[{{"type":"linear","optical_depth":1}}],"majorant":[{{"type":"global","looseness":2}}]}}}}]}})",
                  samples, more, estimators, minus),
      "pairs.json");
  RunRecord run;
  run.name = plan.name;
  run.config_text = plan.config_text;
  run.cells = run_untimed(plan);
  return run;
}

TEST(Difference, UnbiasedTrackersAgree) {
  RunRecord run = run_pairs(R"("ratio","next_flight_ratio")", R"("delta","ratio")");
  ASSERT_EQ(run.cells.size(), 4u);
  for (const CellRecord& record : run.cells) {
    EXPECT_EQ(kind_of(record), Kind::agree) << record.cell.name << ": " << reason_of(record);
    EXPECT_EQ(*record.channel[0].reference, 0);
    EXPECT_EQ(record.reference_method, "difference");
    EXPECT_NE(finding_of(record).find("|difference of the means| < "), std::string::npos) << finding_of(record);
  }
  EXPECT_EQ(run.cells[0].cell.name, "ratio/minus:delta/linear/optical_depth:1/global/looseness:2");
  const Summary summary = summarise(run);
  EXPECT_EQ(summary.agree, 4u);
  EXPECT_EQ(summary.pass, 0u);
  EXPECT_TRUE(summary.disagreements.empty());
  EXPECT_EQ(summary.exit, ExitCode::inconclusive) << "agreement alone proves no mean";
}

/// Streams of their own: T (1 - T) of delta tracking twice.
TEST(Difference, HasTheVarianceOfBoth) {
  const RunRecord run = run_pairs(R"("delta")", R"("delta")");
  const Real t = std::exp(-1.), variance = 2 * t * (1 - t);
  EXPECT_NEAR(*run.cells[0].channel[0].variance / variance, 1, 0.03);
  EXPECT_EQ(run.cells[0].samples, 524288u);
  EXPECT_FALSE(run.cells[0].time);
}

TEST(Difference, ABiasedTrackerIsNamedWhereTwoOthersAgree) {
  // Ratio tracking that is .3 % too bright: within epsilon, and found by more samples.
  RunRecord run = run_pairs(R"("planted_slight","ratio")", R"("ratio",{"type":"residual_ratio","control":"minimum"})",
                            R"("verdict":{"epsilon":0.001,"max_samples_per_ray":40000000},)");
  const Summary summary = summarise(run);
  EXPECT_EQ(summary.differ, 2u);
  EXPECT_EQ(summary.agree, 2u);
  EXPECT_EQ(summary.exit, ExitCode::bias_proven);
  ASSERT_EQ(summary.disagreements.size(), 1u);
  EXPECT_NE(summary.disagreements[0].find("which agree with each other: planted_slight is biased, or both of them are"),
            std::string::npos)
      << summary.disagreements[0];
}

TEST(Difference, APairAloneNamesBoth) {
  RunRecord run = run_pairs(R"("planted_zero")", R"("delta")");
  const Summary summary = summarise(run);
  ASSERT_EQ(summary.disagreements.size(), 1u);
  EXPECT_NE(summary.disagreements[0].find("planted_zero and delta differ: one of them is biased"), std::string::npos);
  EXPECT_NE(finding_of(run.cells[0]).find("the means differ by -0.3"), std::string::npos) << finding_of(run.cells[0]);
}

/// What agreement does not prove, and why its word is another.
TEST(Difference, EqualBiasesPassUnseen) {
  const RunRecord run = run_pairs(R"("planted_zero")", R"("planted_zero")");
  EXPECT_NE(kind_of(run.cells[0]), Kind::pass);
  EXPECT_NE(kind_of(run.cells[0]), Kind::differ);
}

TEST(Difference, TrackersThatClaimABiasAreNotCompared) {
  const RunRecord run = run_pairs(R"({"type":"ray_marching","steps":4})", R"("delta")");
  EXPECT_EQ(kind_of(run.cells[0]), Kind::untested);
}

TEST(Difference, SurvivesTheFile) {
  const RunRecord run = run_pairs(R"("ratio")", R"({"type":"residual_ratio","control":"average"})");
  const RunRecord again = read_results(results_text(run), "again.json");
  ASSERT_TRUE(again.cells[0].cell.minus);
  EXPECT_EQ((*again.cells[0].cell.minus)->label, "residual_ratio/control:average");
  EXPECT_EQ(kind_of(again.cells[0]), Kind::agree);
}

TEST(Difference, OfFreePathsIsSkipped) {
  const RunRecord run = run_pairs(R"("delta")", R"("weighted_delta")", R"("quantity":"free_path",)");
  EXPECT_EQ(run.cells[0].status, Status::skipped);
  EXPECT_EQ(run.cells[0].reason, "differences of a free_path are not drawn");
}

}  // namespace
}  // namespace nullmark
