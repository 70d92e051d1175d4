// What must be compared: nothing that was not measured is called unregressed.

#include "harness/performance_gate/required.h"

#include <gtest/gtest.h>

#include "harness/io/json_input.h"
#include "harness/performance_gate/report.h"

namespace nullmark {
namespace {

/// Two cells with everything that a baseline can hold.
Counts whole() {
  Counts counts;
  counts.source = "whole.json";
  counts.name = "example";
  counts.config_hash = "0123456789abcdef";
  counts.build = {"gcc 12", "-O3", "x86-64-v3", "AVX2", "glibc 2.36", ""};
  counts.start_up = 1'000'000;
  for (const char* name : {"a", "b"}) {
    CellCounts cell;
    cell.name = cell.id = cell.setting = name;
    cell.samples = 100'000;
    cell.lookups = cell.draws = cell.null_collisions = 1'000'000;
    cell.lookups_variance = cell.lookups_theory = 10;
    cell.instructions = 400'000'000;
    cell.misses = 1'000'000;
    counts.cells.push_back(cell);
  }
  return counts;
}

/// What `nullmark run` alone tells.
Counts without_instructions() {
  Counts counts = whole();
  counts.source = "run.json";
  counts.start_up.reset();
  for (CellCounts& cell : counts.cells) {
    cell.instructions.reset();
    cell.misses.reset();
  }
  return counts;
}

PerformanceReport compared(const Counts& before, const Counts& after, const std::optional<std::vector<Tier>>& required = {}) {
  PerformanceReport report = compare_counts(before, after);
  report.missing = missing_tiers(report, before, after, required);
  return report;
}

TEST(PerformanceGateRequired, AWholeComparisonMissesNothing) {
  EXPECT_TRUE(compared(whole(), whole()).missing.empty());
  EXPECT_TRUE(compared(without_instructions(), whole()).missing.empty()) << "more than the baseline holds is not missed";
  EXPECT_EQ(compared(whole(), whole()).exit(), ExitCode::ok);
}

TEST(PerformanceGateRequired, ATierThatTheBaselineHoldsAndTheResultsLackIsMissing) {
  const PerformanceReport report = compared(whole(), without_instructions());
  ASSERT_EQ(report.missing.size(), 3u);
  EXPECT_EQ(report.missing[0], "instructions: whole.json has them, run.json does not: 2 of 2 cells, for example a");
  EXPECT_EQ(report.exit(), ExitCode::nothing_ran);
  const std::string text = performance_text(report), markdown = performance_markdown(report), junit = performance_junit(report);
  EXPECT_EQ(text.find("no performance regression proven"), std::string::npos) << text;
  EXPECT_NE(text.find("missing: cache misses"), std::string::npos) << text;
  EXPECT_NE(markdown.find("- missing: start-up"), std::string::npos) << markdown;
  EXPECT_NE(junit.find("<error message=\"missing: instructions"), std::string::npos) << junit;
  EXPECT_NE(junit.find("errors=\"3\""), std::string::npos) << junit;
}

TEST(PerformanceGateRequired, OneCellWithoutInstructionsIsMissing) {
  Counts after = whole();
  after.cells[1].instructions.reset();
  const PerformanceReport report = compared(whole(), after);
  ASSERT_EQ(report.missing.size(), 1u);
  EXPECT_NE(report.missing[0].find("1 of 2 cells, for example b"), std::string::npos) << report.missing[0];
}

TEST(PerformanceGateRequired, ACellThatVanishedIsMissingUnlessItWasNotAskedFor) {
  Counts after = whole();
  after.cells.pop_back();
  EXPECT_EQ(compared(whole(), after).exit(), ExitCode::nothing_ran);
  after.partial = true;
  EXPECT_EQ(compared(whole(), after).exit(), ExitCode::ok);
}

TEST(PerformanceGateRequired, ARegressionIsProvenWhateverElseIsMissing) {
  Counts after = without_instructions();
  ++after.cells[0].draws;
  const PerformanceReport report = compared(whole(), after);
  EXPECT_FALSE(report.missing.empty());
  EXPECT_EQ(report.exit(), ExitCode::regression);
}

TEST(PerformanceGateRequired, NamedTiersMustBeComparedAndOthersNeedNot) {
  EXPECT_EQ(compared(whole(), without_instructions(), {{Tier::counts, Tier::expected}}).exit(), ExitCode::ok);
  EXPECT_EQ(compared(whole(), without_instructions(), {{Tier::counts, Tier::instructions}}).exit(), ExitCode::nothing_ran);
  EXPECT_EQ(compared(whole(), whole(), {{Tier::counts, Tier::instructions, Tier::misses, Tier::start_up}}).exit(), ExitCode::ok);
  EXPECT_EQ(compared(whole(), whole(), {{Tier::wall_time}}).exit(), ExitCode::nothing_ran);
  EXPECT_EQ(compared(without_instructions(), without_instructions(), {{Tier::instructions}}).exit(), ExitCode::nothing_ran);
  Counts seed = whole();
  seed.cells[0].id = "another seed";
  EXPECT_EQ(compared(whole(), seed).exit(), ExitCode::ok);
  const PerformanceReport report = compared(whole(), seed, {{Tier::instructions}});
  ASSERT_EQ(report.missing.size(), 1u);
  EXPECT_EQ(report.missing[0], "instructions: required, and not compared in 1 of 2 cells, for example a");
}

TEST(PerformanceGateRequired, TheConclusionNamesWhatWasComparedAndWhatWasNot) {
  const std::string text = performance_text(compared(without_instructions(), without_instructions()));
  EXPECT_NE(text.find("no performance regression proven by exact counts, expected counts; not compared: instructions, wall time, "
                      "cache misses, start-up\n"),
            std::string::npos)
      << text;
}

TEST(PerformanceGateRequired, WordsAreThoseOfTheTiers) {
  for (const std::string& word : required_words()) EXPECT_NO_THROW(required_tier(word)) << word;
  EXPECT_EQ(required_tier("start-up"), Tier::start_up);
  EXPECT_THROW(required_tier("instruction"), InputError);
}

}  // namespace
}  // namespace nullmark
