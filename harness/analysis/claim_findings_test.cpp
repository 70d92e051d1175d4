#include "harness/analysis/claim_findings.h"

#include <gtest/gtest.h>

#include "harness/model/metrics.h"
#include "harness/report/claims_text.h"
#include "harness/testing/record_examples.h"

namespace nullmark {
namespace {

/// Cells "a", "b", ... with the given variances, each of 1e6 samples of a normal law.
RunRecord run_with(const std::vector<Real>& variances) {
  RunRecord run;
  for (std::size_t i = 0; i < variances.size(); ++i) {
    CellRecord record;
    record.cell.name = std::string(1, static_cast<char>('a' + i));
    record.cell.samples_per_ray = 1'000'000;
    record.status = Status::ok;
    record.rays = 1;
    record.samples = 1'000'000;
    record.channel.emplace_back();
    record.channel[0].mean = record.channel[0].reference = record.channel[0].reference_rms = 1;
    record.channel[0].variance = variances[i];
    record.channel[0].variance_theory = 1;
    record.channel[0].kurtosis = 3;
    record.lookups_per_sample = std::exp2(static_cast<Real>(i));
    record.lookups_variance = 0;
    run.cells.push_back(record);
  }
  return run;
}

ClaimPart variance_of(const std::vector<std::string>& cells, Relation relation) {
  ClaimPart part;
  part.metric = "variance";
  part.cells = cells;
  part.relation = relation;
  return part;
}

PartFinding found(RunRecord run, const ClaimPart& part) {
  run.claims = {{"C", "a paper", "a claim", "", {part}}};
  PartFinding finding = findings(run)[0].parts[0];
  finding.part = nullptr;
  return finding;
}

ClaimOutcome outcome(const RunRecord& run, const ClaimPart& part) { return found(run, part).outcome; }

TEST(Findings, AtMostAndAtLeastAreProvenBrokenOrLeftOpen) {
  ClaimPart part = variance_of({"a"}, Relation::at_most);
  part.numbers = {1};
  EXPECT_EQ(outcome(run_with({0.9}), part), ClaimOutcome::reproduced);
  EXPECT_EQ(outcome(run_with({1.1}), part), ClaimOutcome::refuted);
  // Two standard errors, sqrt(2/1e6) each, are no proof among several comparisons.
  EXPECT_EQ(outcome(run_with({1 + 2 * std::sqrt(2e-6)}), part), ClaimOutcome::cannot_tell);
  EXPECT_EQ(outcome(run_with({1 - 2 * std::sqrt(2e-6)}), part), ClaimOutcome::cannot_tell);
  part.relation = Relation::at_least;
  EXPECT_EQ(outcome(run_with({0.9}), part), ClaimOutcome::refuted);
  EXPECT_EQ(outcome(run_with({1.1}), part), ClaimOutcome::reproduced);
}

TEST(Findings, NearIsProvenOnlyInsideItsTolerance) {
  ClaimPart part = variance_of({"a"}, Relation::near);
  part.numbers = {1};
  part.tolerance = 0.05;
  EXPECT_EQ(outcome(run_with({1.02}), part), ClaimOutcome::reproduced);
  EXPECT_EQ(outcome(run_with({0.98}), part), ClaimOutcome::reproduced);
  EXPECT_EQ(outcome(run_with({1.05}), part), ClaimOutcome::cannot_tell);
  EXPECT_EQ(outcome(run_with({1.07}), part), ClaimOutcome::refuted);
  EXPECT_EQ(outcome(run_with({0.93}), part), ClaimOutcome::refuted);
  part.numbers.clear();
  part.theory = true;
  EXPECT_EQ(outcome(run_with({1.02}), part), ClaimOutcome::reproduced);
  EXPECT_EQ(outcome(run_with({1.07}), part), ClaimOutcome::refuted);
}

TEST(Findings, CounterpartsBringTheirOwnErrorAndTheFactor) {
  ClaimPart part = variance_of({"a"}, Relation::at_most);
  part.others = {"b"};
  EXPECT_EQ(outcome(run_with({0.99, 1}), part), ClaimOutcome::cannot_tell) << "both are known to .6 %";
  EXPECT_EQ(outcome(run_with({0.98, 1}), part), ClaimOutcome::reproduced);
  EXPECT_EQ(outcome(run_with({1.02, 1}), part), ClaimOutcome::refuted);
  part.factor = 0.1;
  EXPECT_EQ(outcome(run_with({0.98, 1}), part), ClaimOutcome::refuted);
  EXPECT_EQ(outcome(run_with({0.09, 1}), part), ClaimOutcome::reproduced);
  // As a lower bound of opposite sign.
  part.relation = Relation::at_least;
  part.factor = -1;
  EXPECT_EQ(outcome(run_with({0.98, 1}), part), ClaimOutcome::reproduced);
}

TEST(Findings, APartIsRefutedByOneOfItsCellsAndOpenForOne) {
  ClaimPart part = variance_of({"a", "b"}, Relation::at_most);
  part.numbers = {1};
  EXPECT_EQ(outcome(run_with({0.5, 0.5}), part), ClaimOutcome::reproduced);
  EXPECT_EQ(outcome(run_with({0.5, 1.5}), part), ClaimOutcome::refuted);
  EXPECT_EQ(outcome(run_with({0.5, 1}), part), ClaimOutcome::cannot_tell);
  part.numbers = {1, 2};
  EXPECT_EQ(outcome(run_with({0.5, 1.5}), part), ClaimOutcome::reproduced) << "one number each";
}

TEST(Findings, WhatWasNotMeasuredOrIsNotKnownProvesNothing) {
  ClaimPart part = variance_of({"a"}, Relation::at_most);
  part.numbers = {1};
  RunRecord run = run_with({0.5});
  run.cells[0].status = Status::skipped;
  run.cells[0].reason = "no such file";
  EXPECT_EQ(found(run, part).outcome, ClaimOutcome::cannot_tell);
  EXPECT_EQ(found(run, part).compared[0].reason, "no such file");
  run = run_with({0.5});
  run.cells[0].channel[0].kurtosis = 1e6;
  EXPECT_EQ(found(run, part).outcome, ClaimOutcome::cannot_tell) << "one sample makes the variance";
  run.cells[0].channel[0].kurtosis.reset();
  EXPECT_EQ(found(run, part).outcome, ClaimOutcome::cannot_tell);
  part.cells = {"z"};
  EXPECT_EQ(found(run, part).outcome, ClaimOutcome::cannot_tell);
}

/// N E[w^2] of two lookups and a weight of mean 1.
TEST(Findings, TheWeightedCostHasTheErrorsOfItsFactors) {
  RunRecord run = run_with({1});
  CellRecord& record = run.cells[0];
  record.outputs = {"weight"};
  record.lookups_per_sample = 2;
  record.lookups_variance = 1;
  record.channel[0].variance = 0.5;
  EXPECT_NEAR(*standard_error(record, "weighted_cost"), 1.5 * 1e-3 + 2 * 0.5 * std::sqrt(2e-6), 1e-15);
  ClaimPart part = variance_of({"a"}, Relation::near);
  part.metric = "weighted_cost";
  part.numbers = {3};
  part.tolerance = 0.01;
  EXPECT_EQ(outcome(run, part), ClaimOutcome::reproduced);
  part.numbers = {3.1};
  EXPECT_EQ(outcome(run, part), ClaimOutcome::refuted);
  // One sample makes the variance of the weight, however little it adds to the cost.
  record.channel[0].variance = 1e-3;
  record.channel[0].kurtosis = 1e6;
  part.numbers = {2};
  EXPECT_EQ(outcome(run, part), ClaimOutcome::cannot_tell);
  // Unless it is nothing at all.
  record.channel[0].variance = 1e-30;
  EXPECT_EQ(outcome(run, part), ClaimOutcome::reproduced);
}

TEST(Findings, RoundingIsNoVariance) {
  ClaimPart part = variance_of({"a"}, Relation::at_most);
  part.numbers = {1e-24};
  RunRecord run = run_with({1e-33});
  run.cells[0].channel[0].kurtosis = 1e6;
  EXPECT_EQ(outcome(run, part), ClaimOutcome::reproduced);
}

TEST(Findings, SlopesAreThoseOfLogarithms) {
  ClaimPart part = variance_of({"a", "b", "c", "d"}, Relation::near);
  part.slope_against = "lookups_per_sample";
  part.numbers = {-2};
  part.tolerance = 0.05;
  EXPECT_EQ(outcome(run_with({1, 1. / 4, 1. / 16, 1. / 64}), part), ClaimOutcome::reproduced);
  EXPECT_EQ(outcome(run_with({1, 1. / 8, 1. / 64, 1. / 512}), part), ClaimOutcome::refuted);
  EXPECT_EQ(outcome(run_with({1, 1. / 2, 1. / 16, 1. / 32}), part), ClaimOutcome::cannot_tell) << "no straight line";
  EXPECT_EQ(outcome(run_with({1, 1. / 4, 0, 1. / 64}), part), ClaimOutcome::cannot_tell) << "0 has no logarithm";
}

/// More comparisons, wider intervals: all of them must hold together.
TEST(Findings, IntervalsWidenWithTheNumberOfComparisons) {
  ClaimPart one = variance_of({"a"}, Relation::at_most), many = one;
  one.numbers = many.numbers = {1};
  many.cells.assign(1000, "a");
  const Real at = 1 - 4 * std::sqrt(2e-6);
  EXPECT_EQ(outcome(run_with({at}), one), ClaimOutcome::reproduced);
  EXPECT_EQ(outcome(run_with({at}), many), ClaimOutcome::cannot_tell);
}

TEST(Findings, VerdictsDecideWhatIsUnbiased) {
  ClaimPart part;
  part.relation = Relation::unbiased;
  part.cells = {"a"};
  RunRecord run = run_with({1});
  const auto with = [&](Outcome word) {
    run.cells[0].verdict.emplace();
    run.cells[0].verdict->against = "reference";
    run.cells[0].verdict->unbiased = word;
    return outcome(run, part);
  };
  EXPECT_EQ(with(Outcome::pass), ClaimOutcome::reproduced);
  EXPECT_EQ(with(Outcome::fail), ClaimOutcome::refuted);
  EXPECT_EQ(with(Outcome::inconclusive), ClaimOutcome::cannot_tell);
}

TEST(Findings, TheTextHasTheWordTheWorstCellAndByHowMuch) {
  RunRecord run = run_with({0.5, 3, 2});
  ClaimPart part = variance_of({"a", "b", "c"}, Relation::at_most);
  part.numbers = {1};
  run.claims = {{"C1", "a paper", "Nothing varies by more than 1.", "", {part}}};
  const std::string text = findings_text(findings(run));
  EXPECT_NE(text.find("C1: refuted: Nothing varies by more than 1."), std::string::npos) << text;
  EXPECT_NE(text.find("1 of 3 cells bear it out, 2 do not; the worst: b: variance 3"), std::string::npos) << text;
  EXPECT_NE(text.find("(3 times it)"), std::string::npos) << text;
  EXPECT_NE(text.find("1 claim: 0 reproduced, 1 refuted"), std::string::npos) << text;
  EXPECT_NE(findings_markdown(findings(run)).find("| C1 | **refuted** |"), std::string::npos);
  run.claims[0].parts[0].numbers.clear();
  run.claims[0].parts[0].others = {"b", "a", "a"};
  const std::string with = findings_text(findings(run));
  EXPECT_NE(with.find("variance 3 +- "), std::string::npos) << with;
  EXPECT_NE(with.find(" of a (6 times it)"), std::string::npos) << with;
}

}  // namespace
}  // namespace nullmark
