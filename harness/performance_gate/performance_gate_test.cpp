// What comparisons of counts find, what becomes of baselines, what reports say.

#include "harness/performance_gate/performance_gate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "harness/io/json_input.h"
#include "harness/performance_gate/baseline.h"
#include "harness/performance_gate/report.h"

namespace nullmark {
namespace {

/// 10 lookups a sample, as a Poisson number of them: 100 000 samples tell the mean to .1 %.
Counts example() {
  Counts counts;
  counts.source = "example.json";
  counts.name = "example";
  counts.config_hash = "0123456789abcdef";
  counts.build = {"gcc 12", "-O3", "x86-64-v3", "AVX2", "glibc 2.36", ""};
  CellCounts cell;
  cell.name = "ratio/linear/global";
  cell.id = "1111";
  cell.setting = "2222";
  cell.samples = 100'000;
  cell.lookups = 1'000'000;
  cell.draws = 1'100'000;
  cell.null_collisions = 1'000'000;
  cell.lookups_variance = 10;
  cell.lookups_theory = 10;
  cell.instructions = 400'000'000;
  counts.cells = {cell};
  return counts;
}

CellCounts& only(Counts& counts) { return counts.cells.at(0); }

/// The example with its lookups, draws and null collisions made more by a share.
Counts with_more_lookups(Real share) {
  Counts counts = example();
  CellCounts& cell = only(counts);
  const auto more = static_cast<std::uint64_t>(std::llround(share * 1e6));
  cell.lookups += more;
  cell.draws += more;
  cell.null_collisions += more;
  return counts;
}

GateResult finding(const PerformanceReport& report, Tier tier, const std::string& metric) {
  for (const GateRow& row : report.rows)
    if (row.tier == tier && row.metric == metric) return row.finding;
  ADD_FAILURE() << "no row for " << metric;
  return GateResult::not_compared;
}

TEST(PerformanceGate, EqualCountsAreTheSame) {
  const PerformanceReport report = compare_counts(example(), example());
  EXPECT_EQ(report.rows.size(), 3u);
  EXPECT_EQ(report.count(GateResult::same), 3u);
  EXPECT_EQ(report.exit(), ExitCode::ok);
}

TEST(PerformanceGate, MoreDrawsOnTheSameWalksAreARegressionHoweverFew) {
  Counts after = example();
  ++only(after).draws;
  PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::counts, "draws"), GateResult::regression);
  EXPECT_EQ(report.rows.at(0).confidence, "exact");
  EXPECT_EQ(report.exit(), ExitCode::regression);
  EXPECT_EQ(compare_counts(example(), after, 0.001).exit(), ExitCode::ok);
  only(after).draws -= 2;
  report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::counts, "draws"), GateResult::better);
  EXPECT_EQ(report.exit(), ExitCode::ok);
}

TEST(PerformanceGate, OtherWalksAreChangedUnlessChanceCannotDoIt) {
  // Standard error of the ratio .14 %.
  for (const Real share : {0.0001, 0.001, -0.001, -0.0001}) {
    const PerformanceReport report = compare_counts(example(), with_more_lookups(share));
    EXPECT_EQ(finding(report, Tier::counts, "lookups"), GateResult::changed) << share;
    EXPECT_EQ(finding(report, Tier::counts, "draws"), GateResult::changed) << share;
    EXPECT_EQ(report.exit(), ExitCode::ok) << share;
  }
  const PerformanceReport report = compare_counts(example(), with_more_lookups(0.03));
  EXPECT_EQ(finding(report, Tier::counts, "lookups"), GateResult::regression);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::regression);
  EXPECT_EQ(report.exit(), ExitCode::regression);
  EXPECT_EQ(compare_counts(example(), with_more_lookups(0.03), 0.05).exit(), ExitCode::ok);
  EXPECT_EQ(finding(compare_counts(example(), with_more_lookups(-0.03)), Tier::counts, "lookups"), GateResult::better);
}

TEST(PerformanceGate, ViolationsAndUnknownVariancesAreToldButProveNothing) {
  Counts after = example();
  only(after).majorant_violations = 5;
  EXPECT_EQ(finding(compare_counts(example(), after), Tier::counts, "majorant violations"), GateResult::changed);
  after = with_more_lookups(0.03);
  only(after).lookups_variance.reset();
  only(after).lookups_theory.reset();
  const PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::counts, "lookups"), GateResult::changed);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::not_compared);
  EXPECT_EQ(report.exit(), ExitCode::ok);
}

TEST(PerformanceGate, ALooserMajorantIsFoundWhereExactCountsCannotBeCompared) {
  Counts after = with_more_lookups(0.03);
  only(after).id = "another seed";
  const PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::counts, "counts"), GateResult::not_compared);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::regression);
  EXPECT_EQ(finding(report, Tier::expected, "expected lookups"), GateResult::same);
  // Without samples enough for an interval, theory alone still tells.
  after = example();
  only(after).id = "another seed";
  only(after).samples = 100, only(after).lookups = 1030;
  only(after).lookups_theory = 10.3;
  const PerformanceReport few = compare_counts(example(), after);
  EXPECT_EQ(finding(few, Tier::expected, "mean lookups"), GateResult::not_compared);
  EXPECT_EQ(finding(few, Tier::expected, "expected lookups"), GateResult::regression);
}

TEST(PerformanceGate, AnotherSeedOfTheSameExpectationIsNoRegression) {
  Counts after = with_more_lookups(0.002);
  only(after).id = "another seed";
  const PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::same);
  EXPECT_EQ(report.exit(), ExitCode::ok);
  only(after).setting = "another medium";
  EXPECT_EQ(compare_counts(example(), after).exit(), ExitCode::nothing_ran);
}

TEST(PerformanceGate, TheMeanIsHeldAgainstItselfWhereTheoryDidNotHold) {
  Counts before = example(), after = example();
  only(before).lookups_theory = only(after).lookups_theory = 9;
  only(after).id = "another seed";
  const PerformanceReport report = compare_counts(before, after);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::same);
}

TEST(PerformanceGate, InstructionsBeyondTheirThresholdAreARegression) {
  const auto compared = [](Real share, std::vector<Real> history = {}) {
    Counts before = example(), after = example();
    only(before).instruction_history = std::move(history);
    only(after).instructions = static_cast<std::uint64_t>(std::llround(4e8 * (1 + share)));
    return finding(compare_counts(before, after), Tier::instructions, "instructions");
  };
  EXPECT_EQ(compared(0.03), GateResult::regression);
  EXPECT_EQ(compared(0.0021), GateResult::regression);
  EXPECT_EQ(compared(0.0019), GateResult::same);
  EXPECT_EQ(compared(-0.0019), GateResult::same);
  EXPECT_EQ(compared(-0.03), GateResult::better);
  EXPECT_EQ(compared(0.003, {0.0005, 0.001, 0.0015, 0.002}), GateResult::same);
  EXPECT_EQ(compared(0.03, {0, 0.1, 0.2, 0.3}), GateResult::regression) << "no history hides 3 %";
}

TEST(PerformanceGate, MissesBeyondFivePercentOfTheSameWalksAreARegression) {
  const auto compared = [](std::uint64_t before, std::uint64_t after, std::optional<Real> threshold = {}) {
    Counts old = example(), fresh = example();
    only(old).misses = before, only(fresh).misses = after;
    return finding(compare_counts(old, fresh, threshold), Tier::misses, "last-level misses");
  };
  EXPECT_EQ(compared(1'000'000, 1'060'000), GateResult::regression);
  EXPECT_EQ(compared(1'000'000, 1'040'000), GateResult::same);
  EXPECT_EQ(compared(1'000'000, 1'060'000, 0.1), GateResult::same);
  EXPECT_EQ(compared(1'000'000, 30'000), GateResult::better);
  // .01 misses a sample more, on next to none; then .06 more.
  EXPECT_EQ(compared(100, 1'100), GateResult::same);
  EXPECT_EQ(compared(100, 6'100), GateResult::regression);
  EXPECT_EQ(compared(0, 6'100), GateResult::regression);
}

TEST(PerformanceGate, MissesOfOtherWalksAreNotCompared) {
  Counts before = example(), after = example();
  only(before).misses = 1'000'000, only(after).misses = 9'000'000;
  only(after).id = "another seed";
  EXPECT_EQ(finding(compare_counts(before, after), Tier::misses, "last-level misses"), GateResult::not_compared);
  only(after) = only(before);
  only(after).misses.reset();
  EXPECT_EQ(finding(compare_counts(before, after), Tier::misses, "last-level misses"), GateResult::not_compared);
}

TEST(PerformanceGate, AStartOfOnePercentMoreIsARegression) {
  const auto compared = [](std::uint64_t after) {
    Counts old = example(), fresh = example();
    old.start_up = 100'000, fresh.start_up = after;
    return finding(compare_counts(old, fresh), Tier::start_up, "instructions");
  };
  EXPECT_EQ(compared(100'000), GateResult::same);
  EXPECT_EQ(compared(100'900), GateResult::same);
  EXPECT_EQ(compared(101'100), GateResult::regression);
  EXPECT_EQ(compared(90'000), GateResult::better);
  Counts old = example(), fresh = example();
  old.start_up = 100'000, fresh.start_up = 200'000;
  fresh.config_hash = "longer";
  EXPECT_EQ(finding(compare_counts(old, fresh), Tier::start_up, "instructions"), GateResult::not_compared);
}

TEST(PerformanceGate, ThresholdIsTheUpperFenceOfTheHistory) {
  EXPECT_EQ(instruction_threshold({}), 0.002);
  EXPECT_EQ(instruction_threshold({0.009, 0.009, 0.009}), 0.002);
  // Quartiles of 0 to .004 in five steps: .001 and .003.
  EXPECT_NEAR(instruction_threshold({0.004, 0, 0.002, 0.001, 0.003}), 0.009, 1e-15);
  EXPECT_EQ(instruction_threshold({0.1, 0.2, 0.3, 0.4}), 0.01);
}

TEST(PerformanceGate, ExactCountsOfAnotherBuildAreNotCompared) {
  Counts after = example();
  after.build.compiler = "gcc 13";
  ++only(after).draws;
  only(after).instructions = 500'000'000;
  PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(report.count(GateResult::regression), 0u);
  ASSERT_EQ(report.notes.size(), 1u);
  EXPECT_NE(report.notes[0].find("gcc 13"), std::string::npos);
  EXPECT_NE(performance_text(report).find("not compared (tier 1"), std::string::npos);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::same);
  // Old results do not say what they were built for; two such are not equal builds.
  Counts before = example();
  before.build = after.build = {};
  EXPECT_EQ(compare_counts(before, after).count(GateResult::regression), 0u);
}

TEST(PerformanceGate, CellsOfOneSideAloneAreNotCompared) {
  Counts after = example();
  only(after).name = "renamed";
  const PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(report.count(GateResult::not_compared), 2u);
  EXPECT_EQ(report.exit(), ExitCode::nothing_ran);
  for (const std::string& text : {performance_text(report), performance_markdown(report)}) {
    EXPECT_NE(text.find("only on the new side; cells are matched by name): 1 cell, for example renamed"), std::string::npos);
    EXPECT_NE(text.find("only on the old side; cells are matched by name): 1 cell"), std::string::npos);
  }
}

TEST(PerformanceGateBaseline, HistoryGoesOnWhereTheCodeDidNotChange) {
  Counts before = example(), after = example();
  only(before).instruction_history = {0.001};
  only(after).instructions = 400'400'000;
  const Counts carried = refreshed(before, after);
  ASSERT_EQ(carried.cells[0].instruction_history.size(), 2u);
  EXPECT_NEAR(carried.cells[0].instruction_history[1], 0.001, 1e-12);
  only(after).instructions = 440'000'000;
  EXPECT_TRUE(refreshed(before, after).cells[0].instruction_history.empty());
}

TEST(PerformanceGateBaseline, RefreshingLosesNoCellAndNoCount) {
  Counts before = example();
  only(before).misses = before.start_up = 1000;
  Counts after = before;
  EXPECT_NO_THROW(refreshed(before, after));
  only(after).instructions.reset();
  EXPECT_THROW(refreshed(before, after), InputError);
  after = before;
  only(after).misses.reset();
  EXPECT_THROW(refreshed(before, after), InputError);
  after = before;
  after.start_up.reset();
  EXPECT_THROW(refreshed(before, after), InputError);
  after.cells.clear();
  EXPECT_THROW(refreshed(example(), after), InputError);
  after.config_hash = "another configuration";
  EXPECT_NO_THROW(refreshed(example(), after));
}

TEST(PerformanceGateBaseline, AnotherSeedIsNotAnotherConfiguration) {
  const auto hash = [](const char* cell) {
    RunRecord run;
    run.config_text = std::string(R"({"nullmark":"config/2","experiments":[{"name":"e","include":[)") + cell + "]}]}";
    return counts_of(run, "results").config_hash;
  };
  EXPECT_EQ(hash(R"({"estimator":"ratio","seed":1})"), hash(R"({"estimator":"ratio","seed":2})"));
  EXPECT_NE(hash(R"({"estimator":"ratio","seed":1})"), hash(R"({"estimator":"delta","seed":1})"));
  // The seed of a medium is another medium.
  EXPECT_NE(hash(R"({"medium":{"type":"fractal_noise","seed":1}})"), hash(R"({"medium":{"type":"fractal_noise","seed":2}})"));
}

TEST(PerformanceGateBaseline, FilesAreNamedByConfigurationAndBuildButNotByItsHash) {
  const std::string name = baseline_file_name(example());
  EXPECT_EQ(name.rfind("example.gcc-12.x86-64-v3.", 0), 0u) << name;
  Counts changed = example();
  changed.config_hash = "another";
  EXPECT_EQ(baseline_file_name(changed), name);
  changed.build.libc = "glibc 2.41";
  EXPECT_NE(baseline_file_name(changed), name);
}

TEST(PerformanceGateReport, SaysWhichCellWhichTierHowMuchAndHowSure) {
  Counts after = with_more_lookups(0.03);
  PerformanceReport report = compare_counts(example(), after);
  report.rows[0].cell = "a<b|c";
  const std::string junit = performance_junit(report), markdown = performance_markdown(report), text = performance_text(report);
  EXPECT_NE(junit.find("<testcase classname=\"tier 1, exact counts\" name=\"a&lt;b|c: lookups\">"), std::string::npos) << junit;
  EXPECT_NE(junit.find("<failure message=\"REGRESSION: lookups +3 %, threshold 0 % (+2."), std::string::npos) << junit;
  EXPECT_NE(junit.find("0.0001 over all cells"), std::string::npos) << junit;
  EXPECT_NE(junit.find("failures=\"3\""), std::string::npos) << junit;
  EXPECT_NE(markdown.find("| a&lt;b\\|c | 1 exact counts | lookups | 10 | 10.3 | +3 % | 0 % |"), std::string::npos) << markdown;
  EXPECT_EQ(text.find(": 3 performance regressions proven"), text.find(':')) << "the first line says it\n" << text;
  EXPECT_NE(text.find("--update"), std::string::npos) << text;
}

}  // namespace
}  // namespace nullmark
