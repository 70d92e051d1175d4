#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "harness/analysis/check.h"
#include "harness/testing/record_examples.h"
#include "harness/verdict/verdict.h"

namespace nullmark {

/// Levels of the verdicts here, and the evidence that a PASS needs.
inline constexpr Real kAlpha = 1e-4, kAlphaPass = 1e-3;
inline const Real kNeeded = -std::log(kAlphaPass);

/// A test that proves its mean within epsilon and no bias; channel -1 is lookups.
inline TestRecord passing(int channel = 0) {
  TestRecord test;
  test.channel = channel;
  test.samples = 1000;
  test.epsilon = 0.01;
  test.reference_error = 1e-9;
  test.variance = 0.25;
  test.basis = TestBasis::betting;
  test.log_e_fail = -3;
  test.log_e_low = kNeeded + 1;
  test.log_e_high = kNeeded + 2;
  test.planned = 800;
  test.rates = {0.1, 0.2};
  return test;
}

/// One that proves nothing.
inline TestRecord open_one(int channel = 0) {
  TestRecord test = passing(channel);
  test.log_e_low = 0;
  return test;
}

/// One that proves a bias.
inline TestRecord failing(int channel = 0) {
  TestRecord test = passing(channel);
  test.log_e_fail = 100;
  return test;
}

/// One of samples without variance.
inline TestRecord deterministic(Real largest_error, int channel = 0) {
  TestRecord test = passing(channel);
  test.basis = TestBasis::deterministic;
  test.log_e_fail = test.log_e_low = test.log_e_high = 0;
  test.rates.clear();
  test.planned = 0;
  test.largest_error = largest_error;
  test.rounding = 1e-13;
  test.reference_error = 1e-12;
  if (!test.right()) test.log_e_fail = kCertain;
  return test;
}

/// Not yet decided.
inline VerdictRecord verdict_of(std::vector<TestRecord> tests) {
  VerdictRecord verdict;
  verdict.against = "reference";
  verdict.variance_basis = "analytic";
  verdict.samples_per_ray = 1000;
  verdict.planned = 800;
  verdict.affordable = 4000;
  verdict.alpha = kAlpha;
  verdict.alpha_pass = kAlphaPass;
  verdict.tests = std::move(tests);
  return verdict;
}

/// A cell of one grey ray with one test of its mean, whose reference is 1/2 and whose samples lie between 0 and 1.
inline CellRecord judged_cell(Real log_e_fail, Real log_e_within, const std::string& against = "reference") {
  static const CellRecord kCell = example_results().cells[0];
  CellRecord record = kCell;
  TestRecord test;
  test.samples = 1000;
  test.epsilon = 0.01;
  test.reference = 0.5;
  test.mean_error = log_e_fail > 0 ? -0.01 : 0;
  test.variance = 0.25;
  test.basis = TestBasis::betting;
  test.log_e_fail = log_e_fail;
  test.log_e_low = test.log_e_high = log_e_within;
  test.planned = 800;
  VerdictRecord verdict = verdict_of({test});
  verdict.against = against;
  decide(verdict);
  record.verdict = verdict;
  record.reason.clear();
  return record;
}

inline CellRecord passed() { return judged_cell(-3, 10); }
inline CellRecord passed_by_own_mean() { return judged_cell(-3, 10, "own mean"); }
inline CellRecord failed() { return judged_cell(100, 0); }
inline CellRecord open() { return judged_cell(-3, 0); }

inline CellRecord open_as_planned() {
  CellRecord record = judged_cell(-3, 0);
  record.verdict->planned_undecidable = true;
  record.verdict->reason = "too deep";
  return record;
}

inline CellRecord violated() {
  CellRecord record = judged_cell(-3, 10);
  record.verdict->violated = true;
  decide(*record.verdict);
  return record;
}

inline CellRecord unjudged(const std::string& reason) {
  CellRecord record = passed();
  record.verdict.reset();
  record.reason = reason;
  return record;
}

/// Named "cell 0", "cell 1", ...; without a configuration.
inline RunRecord run_of(std::vector<CellRecord> cells) {
  RunRecord run;
  run.cells = std::move(cells);
  for (std::size_t i = 0; i < run.cells.size(); ++i) run.cells[i].cell.name = fmt::format("cell {}", i);
  return run;
}

inline ExitCode exit_of(std::vector<CellRecord> cells) {
  RunRecord run = run_of(std::move(cells));
  return summarise(run).exit;
}

}  // namespace nullmark
