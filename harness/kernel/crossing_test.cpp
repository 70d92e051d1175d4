// What crossing a cell costs: random numbers drawn under either rule, against theory, and the law of the collisions, which no
// partition and no rule changes.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "harness/config/config.h"
#include "harness/registry/components.h"
#include "harness/sampling/scene.h"
#include "harness/testing/run_untimed.h"
#include "media/majorants/tree.h"

namespace nullmark {
namespace {

Plan planned(const std::string& experiment) {
  return read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"cells",)" + experiment + "}]}",
                     "test.json");
}

constexpr const char* kFourCells[] = {
    R"({"type":"grid","resolution":4,"resolution_y":1,"resolution_z":1,"crossing":"%"})",
    R"({"type":"kd_tree","resolution":4,"resolution_y":1,"resolution_z":1,"forced_depth":2,"crossing":"%"})",
    R"({"type":"octree","max_depth":2,"forced_depth":2,"crossing":"%"})"};

std::string with_rule(std::string majorant, const std::string& rule) { return majorant.replace(majorant.find('%'), 1, rule); }

/// mu = 2 x log 2 on [0,1], T = 2^{-x^2}, in four cells of bounds i log(2)/2.  Ratio tracking makes M = 5/4 log 2 lookups, each a
/// draw, and one more draw for the escape or one per cell; delta tracking makes sum k_i int T lookups, each two draws (flight and
/// decision), and one more with probability T(1), or with T at the end of each cell.
TEST(Crossing, DrawsAreThoseOfTheory) {
  constexpr std::uint64_t kSamples = 4'000'000;
  // Deviations of 4e-8: draws of ratio tracking are Poisson(M) and a constant; those of delta tracking are at most 2 K + 4 with K
  // Poisson(M), of second moment below 37.
  const Real ratio_error = 5.5 * std::sqrt(0.8665 / kSamples), delta_error = 5.5 * std::sqrt(37. / kSamples);
  for (const char* majorant : kFourCells)
    for (const bool rewinds : {false, true}) {
      const auto records = run_untimed(planned(fmt::format(
          R"("rays":"single","samples_per_ray":{},"matrix":{{"estimator":["ratio","delta"],
             "medium":{{"type":"linear","optical_depth":0.6931471805599453}},"majorant":{}}})",
          kSamples, with_rule(majorant, rewinds ? "rewind" : "carry"))));
      ASSERT_EQ(records.size(), 2u);
      const CellRecord &ratio = records[0], &delta = records[1];
      EXPECT_NEAR(*ratio.lookups_theory, 0.8664, 5e-5) << majorant;
      EXPECT_NEAR(*delta.lookups_theory, 0.6440, 5e-5) << majorant;
      EXPECT_NEAR(*ratio.draws_per_sample, rewinds ? 4.8664 : 1.8664, 5e-5 + ratio_error) << majorant;
      EXPECT_NEAR(*delta.draws_per_sample, (rewinds ? 3.6196 : 0.6440 + 0.5) + 0.6440, 1e-4 + delta_error) << majorant;
      EXPECT_NEAR(*ratio.lookups_per_sample, *ratio.lookups_theory, ratio_error);
      EXPECT_NEAR(*delta.lookups_per_sample, *delta.lookups_theory, delta_error);
      EXPECT_NEAR(*ratio.channel[0].variance_theory, 0.19652, 5e-6);
      EXPECT_NEAR(*ratio.channel[0].bias, 0, 5.5 * std::sqrt(0.19652 / kSamples));
      EXPECT_NEAR(*delta.channel[0].bias, 0, 5.5 * std::sqrt(0.25 / kSamples));
    }
}

/// A cut of a homogeneous medium of tau = 1 in its middle: one draw more per ratio walk, e^{-1/2} more per delta walk, none where
/// the flight is carried over; not a lookup saved.
TEST(Crossing, AForcedCutOfAHomogeneousMediumIsWasted) {
  constexpr std::uint64_t kSamples = 1'000'000;
  for (const char* structure : {"kd_tree", "octree"})
    for (const char* rule : {"carry", "rewind"}) {
      const auto records = run_untimed(planned(fmt::format(
          R"("rays":"single","samples_per_ray":{},"matrix":{{"estimator":["ratio","delta"],"medium":{{"type":"homogeneous","extinction":1}},
             "majorant":{{"type":"{}","max_depth":4,"forced_depth":[0,1],"crossing":"{}"}}}})",
          kSamples, structure, rule)));
      ASSERT_EQ(records.size(), 4u);
      for (std::size_t i = 0; i < 4; i += 2) {
        const CellRecord &one = records[i], &cut = records[i + 1];
        EXPECT_EQ(one.structure->cells, 1u);
        EXPECT_GT(cut.structure->cells, 1u);
        EXPECT_NEAR(*one.lookups_theory, *cut.lookups_theory, 1e-12);
        const bool is_ratio = one.cell.estimator->type == "ratio";
        if (std::string(rule) == "carry") {
          EXPECT_EQ(one.draws, cut.draws);
          continue;
        }
        // Draws of either walk have a variance of at most 9/4 (ratio: 1).
        EXPECT_NEAR(*cut.draws_per_sample - *one.draws_per_sample, is_ratio ? 1 : std::exp(-0.5),
                    5.5 * std::sqrt(2 * 2.25 / kSamples))
            << structure;
      }
    }
}

/// Random lines through a medium so thin under a majorant so loose that walks end at the far side: a delta walk under rewind
/// draws an exponential for each lookup, each crossing and the escape, and a decision for each lookup.
TEST(Crossing, CostPredictsWhatThinWalksSpend) {
  const Plan plan = planned(
      R"("rays":{"type":"chords","count":5000},"samples_per_ray":16,"verdict":{"enabled":false},
         "matrix":{"estimator":["delta","ratio"],
                   "medium":[{"type":"fractal_noise","peak":0.02,"sharpness":4},{"type":"gaussian_bump","amplitude":0.02,"hi":[2,1,1]}],
                   "majorant":[{"type":"kd_tree","resolution":32,"looseness":10000,"crossing":"rewind"},
                               {"type":"octree","max_depth":5,"looseness":10000,"crossing":"rewind"}]})");
  for (const CellRecord& record : run_untimed(plan)) {
    const auto structure = make_majorant(*record.majorant)->build(build_medium(*record.medium).medium);
    const auto& tree = dynamic_cast<const TreeMajorant&>(*structure);
    EXPECT_GT(tree.size().cells, 1u) << record.cell.name;
    const Real decisions = record.cell.estimator->type == "delta" ? *record.lookups_per_sample : 0;
    const Real spent = *record.draws_per_sample - decisions - 1;
    EXPECT_GT(tree.expected_cost() / spent, 0.9) << record.cell.name;
    EXPECT_LT(tree.expected_cost() / spent, 1.1) << record.cell.name;
  }
}

/// Means, lookups and the laws of the walks, at a family-wise error of 1e-4: what a partition and a rule must not change.
TEST(Crossing, NoPartitionAndNoRuleChangesTheLaw) {
  const Plan plan = planned(
      R"("rays":{"type":"single","from":[0.02,0.1,0.3],"to":[0.97,0.9,0.6]},"samples_per_ray":20000,
         "verdict":{"epsilon":0.02,"max_samples_per_ray":4000000,"laws":"always"},
         "matrix":{"estimator":["delta","ratio",{"type":"residual_ratio","control":"average"},"residual_delta","next_flight_ratio",
                                "next_flight_delta"],
                   "medium":[{"type":"linear","optical_depth":1},{"type":"gaussian_bump","amplitude":8},
                             {"type":"fractal_noise","peak":6},{"type":"checkerboard","cells_x":3,"cells_y":3,"cells_z":3}],
                   "majorant":["global",{"type":"grid","resolution":5,"crossing":["carry","rewind"]},
                               {"type":"kd_tree","resolution":16,"forced_depth":4,"crossing":["carry","rewind"]},
                               {"type":"octree","max_depth":4,"forced_depth":2,"crossing":["carry","rewind"]}]})");
  std::size_t passed = 0;
  const auto records = run_untimed(plan);
  for (const CellRecord& record : records) {
    ASSERT_EQ(record.status, Status::ok) << record.cell.name << record.reason;
    ASSERT_TRUE(record.verdict) << record.cell.name;
    const VerdictRecord& verdict = *record.verdict;
    EXPECT_NE(verdict.unbiased, Outcome::fail) << record.cell.name << ": " << verdict.reason;
    EXPECT_NE(verdict.unbiased, Outcome::violated) << record.cell.name;
    EXPECT_NE(verdict.lookups, Outcome::fail) << record.cell.name;
    EXPECT_EQ(verdict.lawful, Outcome::pass) << record.cell.name << ": " << verdict.reason;
    passed += verdict.unbiased == Outcome::pass;
  }
  EXPECT_EQ(records.size(), 6u * 4u * 7u);
  EXPECT_GT(passed, records.size() * 9 / 10);
}

}  // namespace
}  // namespace nullmark
