#include "harness/analysis/comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "harness/analysis/comparison_test.h"
#include "harness/io/json_input.h"
#include "harness/report/comparison_text.h"
#include "harness/statistics/moments.h"
#include "harness/testing/record_examples.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

using namespace comparison_test;

Comparison only_comparison(const std::vector<CellRecord>& cells, const std::string& baseline = "") {
  static std::vector<RunRecord> runs;
  runs.assign(1, {});
  runs[0].cells = cells;
  return comparisons(runs, baseline).at(0);
}

TEST(Cost, SecondsToATargetAreVarianceOverRoomTimesTheTimeOfASample) {
  const Cost cost = *cost_of(cell("ratio"));
  // .04 / (.01 * .5)^2 = 1600 samples of 10 ns
  EXPECT_NEAR(seconds_to(cost, 0.01)->value, 1600 * 10e-9, 1e-15);
  EXPECT_NEAR(seconds_to(cost, 0.001)->value, 160000 * 10e-9, 1e-13);
  EXPECT_NEAR(cost.variance_x_lookups->value, 0.08, 1e-15);
  EXPECT_NEAR(cost.variance_x_ns->low, 0.4 * 0.99, 1e-12);
  EXPECT_FALSE(cost.floor);
  // One sample at least.
  EXPECT_NEAR(seconds_to(*cost_of(cell("exact", 0)), 0.01)->value, 10e-9, 1e-18);
}

TEST(Cost, ASampleVarianceIsAsUncertainAsItsKurtosisSays) {
  CellRecord record = cell("ratio");
  record.channel[0].variance = record.channel[0].variance_theory;
  record.channel[0].variance_theory.reset();
  record.channel[0].kurtosis = 5;
  EXPECT_NEAR(cost_of(record)->variance.high, 0.04 * std::exp(kNormal975 * 0.2), 1e-12);
  EXPECT_FALSE(cost_of(record)->analytic);
}

TEST(Cost, AVarianceThatRareSamplesDecideIsUncertain) {
  CellRecord record = cell("delta");
  ChannelRecord& channel = record.channel[0];
  channel.variance_theory.reset();
  channel.variance = 3.5e-20;
  channel.bias = -1e-9;  // all samples were 0
  channel.reference = channel.reference_rms = 1e-9;
  EXPECT_TRUE(variance_is_uncertain(record, channel));
  // Of a bias that is proven no unseen sample is to blame.
  record.verdict.emplace().biased = true;
  EXPECT_FALSE(variance_is_uncertain(record, channel));
  record.verdict.reset();
  EXPECT_GT(cost_of(record)->variance.high / cost_of(record)->variance.value, 40);
  channel.bias = 1e-11;
  EXPECT_FALSE(variance_is_uncertain(record, channel));
  channel.kurtosis = 99;
  EXPECT_TRUE(variance_is_uncertain(record, channel));
  channel.variance_theory = 1e-9;
  EXPECT_FALSE(variance_is_uncertain(record, channel));
}

TEST(Cost, FloorsAreForThoseThatDoNotClaimToBeUnbiased) {
  const Cost cost = *cost_of(marching(0.002));
  EXPECT_NEAR(cost.floor->value, 0.002, 1e-12);
  EXPECT_TRUE(cost.floor->exact());
  EXPECT_TRUE(std::isfinite(seconds_to(cost, 0.01)->value));
  EXPECT_EQ(seconds_to(cost, 0.001)->value, kInfinity);
  // With variance the floor is told no better than the mean: sd of its square is sqrt(2 s^4 + 4 b^2 s^2), s^2 = V / n.
  const Cost noisy = *cost_of(marching(0.002, 0.04));
  EXPECT_NEAR(noisy.floor->value, 0.002, 1e-9);
  EXPECT_EQ(noisy.floor->low, 0);
  EXPECT_GT(noisy.floor->high, 0.04);
}

TEST(Cost, BreakEvenIsWhereBothHaveTheSameErrorInTheSameTime) {
  const Cost biased = *cost_of(marching(0.01, 0.001)), unbiased = *cost_of(cell("ratio"));
  const BreakEven found = *break_even(biased, unbiased);
  ASSERT_EQ(found.kind, BreakEven::Kind::no_floor_seen);  // 100 samples do not tell .01 from noise
  CellRecord seen = marching(0.01, 0.001);
  seen.cell.samples_per_ray = 10'000'000;
  seen.channel[0].rmse = std::sqrt(0.005 * 0.005 + 0.001 / 1e7);
  const Cost known = *cost_of(seen);
  const BreakEven even = *break_even(known, unbiased);
  ASSERT_EQ(even.kind, BreakEven::Kind::at);
  const Real t = even.seconds.value;
  const Real of_biased = 0.001 * 20e-9 / t + 0.005 * 0.005, of_unbiased = 0.04 * 10e-9 / t;
  EXPECT_NEAR(of_biased, of_unbiased, 1e-9 * of_biased);
  EXPECT_NEAR(even.error.value, std::sqrt(of_unbiased) / 0.5, 1e-12);
  EXPECT_LT(even.seconds.low, t);
  EXPECT_GT(even.seconds.high, t);
}

TEST(Cost, AMarchThatCostsMoreThanTheNoiseIsWorthIsNeverCheaper) {
  EXPECT_EQ(break_even(*cost_of(marching(0.5, 0, 1000)), *cost_of(cell("ratio")))->kind, BreakEven::Kind::never_cheaper);
}

TEST(Cost, WhatHasItsFirstSampleSoonerIsCheaperUntilTheOthersFirst) {
  // .001 / (.05 * .5)^2 = 1.6 samples of 20 ns
  const CellRecord unbiased = cell("unbiased_ray_marching", 0.001, 20);
  EXPECT_EQ(break_even(*cost_of(marching(0.05, 0, 5)), *cost_of(unbiased))->kind, BreakEven::Kind::at);
  EXPECT_EQ(break_even(*cost_of(marching(0.1, 0, 19)), *cost_of(unbiased))->kind, BreakEven::Kind::first_sample);
  EXPECT_EQ(break_even(*cost_of(marching(0.1, 0, 21)), *cost_of(unbiased))->kind, BreakEven::Kind::never_cheaper);
}

TEST(Cost, FewSamplesCostWhatAsFewCostWhenTheyWereTimed) {
  CellRecord record = cell("exact", 0);
  record.time->samples_per_traversal = 64;
  // One sample is enough, but 64 shared a walk through the majorant structure.
  EXPECT_NEAR(seconds_to(*cost_of(record), 0.01)->value, 10e-9, 1e-18);
  EXPECT_TRUE(is_amortised(*cost_of(record), 0.01));
  record.time->repetitions = 3;
  record.time->batches = {{1, 120, 1}, {8, 30, 1}, {64, 10, 1}};
  EXPECT_NEAR(seconds_to(*cost_of(record), 0.01)->value, 120e-9, 1e-18);
  EXPECT_FALSE(is_amortised(*cost_of(record), 0.01));
  record.channel[0].variance_theory = 20 * 0.01 * 0.01 * 0.25;
  // Twenty samples between eight of 240 ns together and 64 of 640 ns.
  EXPECT_NEAR(seconds_to(*cost_of(record), 0.01)->value, (240 + 12 * 400 / 56.) * 1e-9, 1e-15);
  record.channel[0].variance_theory = 0.04;
  EXPECT_NEAR(seconds_to(*cost_of(record), 0.01)->value, 1600 * 10e-9, 1e-15);
}

TEST(Cost, RoundingIsNoVarianceAndNoFloor) {
  EXPECT_EQ(cost_of(cell("ratio", 1e-26))->variance.value, 0);
  const Cost cost = *cost_of(marching(1e-13, 1e-28));
  EXPECT_EQ(cost.floor->high, 0);
  EXPECT_EQ(break_even(cost, *cost_of(cell("ratio")))->kind, BreakEven::Kind::exact);
}

TEST(Comparison, TiesAreTimesWhoseRatioMayBeOne) {
  const Comparison comparison =
      only_comparison({cell("slow", 0.04, 20), cell("ratio", 0.04, 10), cell("same", 0.04, 10.1), cell("exact", 0, 5)});
  ASSERT_EQ(comparison.cells.size(), 4u);
  EXPECT_EQ(comparison.cells[0].label, "exact");
  EXPECT_EQ(comparison.cells[1].label, "ratio");
  EXPECT_EQ(*comparison.cells[1].rank, 2u);
  EXPECT_EQ(*comparison.cells[2].rank, 2u);
  EXPECT_TRUE(comparison.cells[1].tied && comparison.cells[2].tied);
  EXPECT_EQ(*comparison.cells[3].rank, 4u);
  EXPECT_FALSE(comparison.cells[3].tied);
  EXPECT_NEAR(comparison.cells[3].relative->value / comparison.cells[1].relative->value, 2, 1e-12);
}

/// One whose time is hardly known is tied with the first, and stands before those that are proven slower.
TEST(Comparison, RanksRise) {
  CellRecord vague = cell("vague", 0.04, 30);
  vague.time->repetition_ns = {1, 30, 59};
  const Comparison comparison = only_comparison({vague, cell("slow", 0.04, 20), cell("fast", 0.04, 10)});
  ASSERT_EQ(comparison.cells.size(), 3u);
  EXPECT_EQ(comparison.cells[0].label, "fast");
  EXPECT_EQ(comparison.cells[1].label, "vague");
  EXPECT_EQ(*comparison.cells[1].rank, 1u);
  EXPECT_TRUE(comparison.cells[0].tied && comparison.cells[1].tied);
  EXPECT_EQ(*comparison.cells[2].rank, 2u);
}

TEST(Comparison, BaselinesAreTheFirstUnbiasedOrTheOneNamed) {
  std::vector<CellRecord> cells = {cell("delta", 0.1), cell("ratio"), marching(0.002)};
  EXPECT_EQ(only_comparison(cells).cells[*only_comparison(cells).baseline].label, "ratio");
  EXPECT_EQ(only_comparison(cells, "delta").cells[*only_comparison(cells, "delta").baseline].label, "delta");
  EXPECT_THROW(only_comparison(cells, "dleta"), InputError);
  EXPECT_EQ(only_comparison(cells).cells[*only_comparison(cells).best_unbiased].label, "ratio");
}

TEST(Comparison, TheSameTrackerTwiceIsToldApart) {
  std::vector<CellRecord> cells = {cell("ratio"), cell("ratio"), cell("delta")};
  cells[1].cell.seed = 2;
  const Comparison comparison = only_comparison(cells);
  std::set<std::string> labels;
  for (const RankedCell& ranked : comparison.cells) labels.insert(ranked.label);
  EXPECT_EQ(labels, (std::set<std::string>{"ratio/seed:1", "ratio/seed:2", "delta"}));
}

/// Of one tracker's results, and of results of others between them.
TEST(Comparison, ResultsOfOneTrackerAreNoRivals) {
  std::vector<RunRecord> runs(2);
  runs[0].cells = {cell("ratio", 0.04, 10), cell("delta", 0.05, 15), cell("slow", 0.06, 40)};
  runs[1].cells = {cell("ratio", 0.04, 20)};
  runs[1].cells[0].cell.samples_per_ray = 1000;
  const Comparison comparison = comparisons(runs, "").at(0);
  std::map<std::string, const RankedCell*> by;
  for (const RankedCell& ranked : comparison.cells) by[ranked.label] = &ranked;
  EXPECT_EQ(*by.at("ratio/samples:100")->rank, 1u);
  EXPECT_EQ(*by.at("delta")->rank, 1u);  // one result of ratio is faster, one is slower
  EXPECT_EQ(*by.at("ratio/samples:1000")->rank, 2u);
  EXPECT_FALSE(by.at("ratio/samples:1000")->tied);
  EXPECT_EQ(*by.at("slow")->rank, 3u);  // ratio counts once
  EXPECT_TRUE(by.at("ratio/samples:1000")->pareto);
  EXPECT_TRUE(by.at("delta")->pareto);  // as for ranks, all results of ratio would have to beat it
  EXPECT_FALSE(by.at("slow")->pareto);
  EXPECT_TRUE(by.at("ratio/samples:100")->relative);
  EXPECT_FALSE(by.at("ratio/samples:1000")->relative);
  const std::string split = compare_text(runs, "", false);
  EXPECT_EQ(split.find("Fastest to 1 % error, alone or tied, of 1 scene: ratio/samples:100 in 1 scene, delta in 1 scene; "), 0u)
      << split;
  EXPECT_NE(split.find("\nranks of ratio: 1 and 2; a tracker is faster than another only if all of its results are\n"),
            std::string::npos)
      << split;
  EXPECT_NE(split.find("\n- under / baseline: another result of the baseline's tracker, which is no rival\n"), std::string::npos)
      << split;
  runs[1].cells[0].time->repetition_ns = runs[0].cells[0].time->repetition_ns;
  const std::string text = compare_text(runs, "", false);
  EXPECT_EQ(
      text.find("Fastest to 1 % error, alone or tied, of 1 scene: ratio in 1 scene; of those that claim to be unbiased: ratio "
                "in 1 scene\n"),
      0u)
      << text;
  EXPECT_EQ(text.find("1=  "), std::string::npos) << text;
}

TEST(Comparison, ParetoFrontHoldsWhatNoneBeatsInBoth) {
  const Comparison comparison = only_comparison({cell("a", 1, 10), cell("b", 0.5, 20), cell("dominated", 1, 20)});
  for (const RankedCell& ranked : comparison.cells) EXPECT_EQ(ranked.pareto, ranked.label != "dominated");
}

TEST(Comparison, CommonStreamsMakeRatiosOfErrorsSharper) {
  // Errors of b are twice those of a, whose blocks scatter by half: paired, the ratio is exact.
  CellRecord a = cell("a"), b = cell("b");
  for (std::size_t i = 0; i < BlockErrors::kBlocks; ++i) {
    a.squared_error_blocks.push_back(1 + (i % 2 == 0 ? 0.5 : -0.5));
    b.squared_error_blocks.push_back(4 * a.squared_error_blocks.back());
  }
  const Comparison comparison = only_comparison({a, b}, "a");
  ASSERT_EQ(comparison.pairings.size(), 1u);
  EXPECT_NEAR(comparison.pairings[0].ratio.value, 4, 1e-12);
  EXPECT_NEAR(comparison.pairings[0].ratio.high, 4, 1e-9);
  EXPECT_GT(comparison.pairings[0].unpaired.high, 4.5);
  EXPECT_FALSE(comparison.pairings[0].of_the_means);
  b.cell.seed = 2;
  const Comparison other = only_comparison({a, b}, "a");
  EXPECT_TRUE(other.pairings.empty());
  ASSERT_EQ(other.unpaired.size(), 1u);
  EXPECT_EQ(other.unpaired[0].reason, "has another seed");
}

TEST(Comparison, TheErrorOfOneSampleDoesNotSpeakForAMarchWithAFloor) {
  // Variance .04 against none, floor .05 * .5: at one sample 64 times the march's error, of 100 samples 1 / 1.56 of it.
  CellRecord unbiased = cell("ratio"), march = marching(0.05);
  for (std::size_t i = 0; i < BlockErrors::kBlocks; ++i) {
    unbiased.squared_error_blocks.push_back(0.04 * (i % 2 == 0 ? 0.9 : 1.1));
    march.squared_error_blocks.push_back(0.025 * 0.025);
  }
  const Comparison comparison = only_comparison({unbiased, march});
  ASSERT_EQ(comparison.pairings.size(), 1u);
  EXPECT_NEAR(comparison.pairings[0].ratio.value, 1. / 64, 1e-9);
  EXPECT_NEAR(comparison.pairings[0].of_the_means->value, 0.025 * 0.025 / (0.04 / 100), 1e-9);
  std::vector<RunRecord> runs(1);
  runs[0].cells = {unbiased, march};
  for (const std::string& text : {compare_text(runs, "", true), compare_markdown(runs, "", true)}) {
    EXPECT_NE(text.find("mean squared error of 1 sample"), std::string::npos) << text;
    EXPECT_NE(text.find("of 100 samples, bias included"), std::string::npos) << text;
    EXPECT_NE(text.find("interval if streams were independent"), std::string::npos) << text;
    EXPECT_NE(text.find("1.56"), std::string::npos) << text;
  }
  runs[0].cells[1].cell.seed = 7;
  EXPECT_NE(compare_text(runs, "", true).find("not paired: ray_marching has another seed"), std::string::npos);
}

/// 200 runs of real trackers whose ratio of mean squared errors is known: (ratio's variance) / (delta's variance).  The
/// jackknife's 95 % intervals must hold it at least 88 % of the time: 1e-4 is the chance of fewer than 176 of 200 at a true 95 %.
TEST(Comparison, PairedIntervalsHoldTheTrueRatio) {
  int covered = 0, sharper = 0;
  constexpr int kRuns = 200;
  for (int seed = 1; seed <= kRuns; ++seed) {
    const Plan plan = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e",
        "rays":"single","samples_per_ray":4096,"verdict":{"enabled":false},
        "matrix":{"estimator":["ratio","delta"],"medium":{"type":"linear","optical_depth":1}}}]})",
                                  "test.json", static_cast<std::uint64_t>(seed));
    RunRecord run;
    run.cells = run_untimed(plan);
    const std::vector<RunRecord> runs = {run};
    const Comparison comparison = comparisons(runs, "delta").at(0);
    ASSERT_EQ(comparison.pairings.size(), 1u);
    const Interval ratio = comparison.pairings[0].ratio;
    const auto theory = [&](std::size_t i) {
      return *std::find_if(run.cells.begin(), run.cells.end(),
                           [&](const CellRecord& record) { return record.cell.estimator->type == (i == 0 ? "ratio" : "delta"); })
                  ->channel[0]
                  .variance_theory;
    };
    const Real truth = theory(0) / theory(1);
    covered += ratio.low <= truth && truth <= ratio.high;
    sharper += ratio.high / ratio.low < comparison.pairings[0].unpaired.high / comparison.pairings[0].unpaired.low;
  }
  EXPECT_GE(covered, kRuns * 88 / 100);
  EXPECT_LT(covered, kRuns);
  EXPECT_GT(sharper, kRuns / 2);
}

TEST(Compare, TablesTellTiesFloorsAndBreakEven) {
  std::vector<RunRecord> runs(1);
  runs[0].cells = {cell("ratio"), cell("same", 0.04, 10.1), marching(0.002)};
  const std::string text = compare_text(runs, "", false);
  EXPECT_NE(text.find("2=  "), std::string::npos) << text;
  EXPECT_NE(text.find("0.2 %"), std::string::npos) << text;
  EXPECT_NE(text.find("never"), std::string::npos) << text;
  EXPECT_NE(text.find(" s, at 0.2 %"), std::string::npos) << text;
  EXPECT_NE(text.find("baseline: ratio"), std::string::npos) << text;
  EXPECT_EQ(text.find("same streams"), std::string::npos) << text;
  EXPECT_NE(compare_markdown(runs, "", false).find("| 2= | ratio |"), std::string::npos) << compare_markdown(runs, "", false);
  EXPECT_TRUE(compare_text({}, "", false).empty());
}

TEST(Compare, NobodyIsFastestAlone) {
  std::vector<RunRecord> runs(1);
  runs[0].cells = {cell("a"), cell("a")};
  EXPECT_EQ(compare_text(runs, "", false).find("no scene has two trackers to compare\n"), 0u) << compare_text(runs, "", false);
  runs[0].cells.push_back(cell("b"));
  EXPECT_EQ(compare_text(runs, "", false).find("Fastest to 1 % error"), 0u) << compare_text(runs, "", false);
}

TEST(Compare, SaysThatTheOthersAreTrackers) {
  std::vector<RunRecord> runs(1);
  runs[0].cells = {cell("a"), cell("b"), cell("c"), cell("d")};
  EXPECT_EQ(compare_text(runs, "", false)
                .find("Fastest to 1 % error, alone or tied, of 1 scene: a in 1 scene, b in 1 scene and 2 more trackers; "),
            0u)
      << compare_text(runs, "", false);
}

TEST(Compare, ATrackerWhoseVerdictIsFailIsNeverTheBaseline) {
  for (const Outcome outcome : {Outcome::fail, Outcome::violated}) {
    const CellRecord wrong = disproven("wrong", outcome, 0.5);
    const Comparison comparison = only_comparison({wrong, cell("ratio")});
    ASSERT_TRUE(comparison.baseline && comparison.best_unbiased);
    EXPECT_EQ(comparison.cells[*comparison.baseline].label, "ratio");
    EXPECT_EQ(comparison.cells[*comparison.best_unbiased].label, "ratio");
    const auto& ranked = comparison.cells[comparison.cells[0].label == "wrong" ? 0 : 1];
    ASSERT_TRUE(ranked.cost->floor);
    EXPECT_NEAR(ranked.cost->floor->value, 0.5, 1e-9);
    std::vector<RunRecord> runs(1);
    runs[0].cells = {wrong, cell("ratio")};
    EXPECT_NE(compare_text(runs, "", false).find(outcome == Outcome::fail ? "FAIL" : "VIOLATED"), std::string::npos);
    EXPECT_NE(compare_markdown(runs, "", false).find("not tested (claims unbiased)"), std::string::npos);
  }
  const CellRecord right = disproven("right", Outcome::pass, 0);
  EXPECT_EQ(only_comparison({right, cell("ratio")}).cells[0].label, "right");
  EXPECT_EQ(*only_comparison({right, cell("ratio")}).baseline, 0u);
}

TEST(Compare, CellsWithTheSameSamplesAndWalksInLanesAreRemarkedOn) {
  std::vector<RunRecord> runs(1);
  runs[0].cells = {cell("ratio"), cell("residual_ratio"), cell("other")};
  for (CellRecord& record : runs[0].cells) record.draws = 700;
  runs[0].cells[2].channel[0].mean = 0.4;
  runs[0].cells[0].in_lanes = true;
  const std::string text = compare_text(runs, "", false);
  EXPECT_NE(text.find("the same samples to the last bit: ratio, residual_ratio\n"), std::string::npos) << text;
  EXPECT_NE(text.find("side by side in registers: ratio; the others"), std::string::npos) << text;
  for (CellRecord& record : runs[0].cells) record.in_lanes = true;
  EXPECT_EQ(compare_text(runs, "", false).find("side by side"), std::string::npos);
}

TEST(Compare, TheConfigurationsTablesComeWithIt) {
  const std::vector<RunRecord> runs = {example_results()};
  EXPECT_NE(compare_text(runs, "", false).find("T (rmse)\n"), std::string::npos);
  EXPECT_NE(compare_markdown(runs, "", false).find("**T (rmse)**\n\n|  | paper | here | theory | note |"), std::string::npos)
      << compare_markdown(runs, "", false);
}

}  // namespace
}  // namespace nullmark
