// The word for a cell, its marks and what stands beside them, in every output.

#include "harness/verdict/cell_word.h"

#include <gtest/gtest.h>

#include "harness/analysis/check.h"
#include "harness/analysis/claim_findings.h"
#include "harness/analysis/hard_case_table.h"
#include "harness/io/json_input.h"
#include "harness/io/text.h"
#include "harness/report/check_text.h"
#include "harness/report/data.h"
#include "harness/report/export.h"
#include "harness/report/junit.h"
#include "harness/report/results_tables.h"
#include "harness/testing/verdict_examples.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

TEST(Words, NoMarkChangesNoWord) {
  EXPECT_EQ(marked_word(passed()), "PASS");
  EXPECT_EQ(marked_word(failed()), "FAIL");
  EXPECT_EQ(marked_word(open()), "INCONCLUSIVE");
  EXPECT_EQ(marked_word(open_as_planned()), "INCONCLUSIVE (as planned)");
  EXPECT_EQ(marked_word(violated()), "VIOLATED");
  EXPECT_EQ(marked_word(unjudged("no reference")), "not tested (claims unbiased)");
  CellRecord modest = unjudged("");
  modest.claims = "biased";
  EXPECT_EQ(marked_word(modest), "not tested (claims nothing)");
  EXPECT_EQ(marked_word(unsampled(passed(), Status::skipped, "no data")), "not run");
  EXPECT_EQ(marked_word(unsampled(passed(), Status::error, "not finite")), "ERROR");
}

TEST(Words, APilotMarksOnlyWhatTakesAVariance) {
  CellRecord record = passed();
  record.verdict->variance_basis = "pilot";
  EXPECT_EQ(marked_word(record), "PASS") << "bets on bounded samples take no variance";
  for (const TestBasis basis : {TestBasis::catoni, TestBasis::both}) {
    record.verdict->tests[0].basis = basis;
    EXPECT_EQ(marked_word(record), "PASS (by pilot)");
  }
  record.verdict->variance_basis = "analytic";
  EXPECT_EQ(marked_word(record), "PASS");
  // The lookups' variance says nothing of the mean's proof.
  record.verdict->variance_basis = "pilot";
  record.verdict->tests[0].basis = TestBasis::deterministic;
  record.verdict->tests.push_back(record.verdict->tests[0]);
  record.verdict->tests.back().channel = -1;
  record.verdict->tests.back().basis = TestBasis::catoni;
  EXPECT_EQ(marked_word(record), "PASS");
}

TEST(Words, LawsMarkAMeanThatIsUndecided) {
  for (CellRecord record : {open_as_planned(), open(), passed()}) {
    record.verdict->laws = {{"independence", 0, 100, Outcome::none}};
    decide(*record.verdict);
    const std::vector<Mark> expected = kind_of(record) == Kind::pass ? std::vector<Mark>{} : std::vector{Mark::laws};
    EXPECT_EQ(marks_of(record), expected);
    record.verdict->laws[0].log_e = 1000;
    decide(*record.verdict);
    EXPECT_EQ(marked_word(record), "FAIL") << "a law that is broken proves a fault";
  }
}

TEST(Words, MarksShareOnePairOfParentheses) {
  CellRecord record = open_as_planned();
  record.verdict->laws = {{"independence", 0, 100, Outcome::none}};
  record.verdict->bound_unproven = true;
  record.verdict->untested = {"variance: no bound"};
  decide(*record.verdict);
  EXPECT_EQ(marked_word(record), "INCONCLUSIVE (as planned, by laws, bound not proven)");
  record = passed_by_own_mean();
  record.verdict->bound_unproven = true;
  record.verdict->untested = {"variance: no bound"};
  EXPECT_EQ(marked_word(record), "PASS (own mean, bound not proven, variance not tested)");
}

TEST(Words, TheExactDepthIsAMarkOfThoseThatLeanOnIt) {
  CellRecord record = passed();
  record.given_depth = true;
  EXPECT_EQ(marked_word(record), "PASS (given the exact depth)");
  record.reliance = 0.25;
  EXPECT_EQ(marked_word(record), "PASS (leans on the exact depth (0.25 of its answer))");
  EXPECT_STREQ(mark_name(marks_of(record).at(0)), "leans on the exact depth");
  record.reliance = 0.01;
  EXPECT_EQ(marked_word(record), "PASS") << "it was handed the depth and does not follow it";
}

TEST(Words, WhatHasNoVerdictOnTheMeanHasNoMarks) {
  for (CellRecord record : {violated(), unjudged("no reference")}) {
    record.given_depth = true;
    if (record.verdict) record.verdict->bound_unproven = true;
    EXPECT_TRUE(marks_of(record).empty());
  }
}

TEST(Words, AFindingIsWhatAPassProvesAndWhyOthersAreNone) {
  EXPECT_EQ(finding_of(passed()), "|bias| < 2 % of the mean");
  EXPECT_EQ(finding_of(passed_by_own_mean()), "|mean - own mean| < 2 % of the mean");
  EXPECT_EQ(finding_of(failed()), "mean 0.49, expected 0.5: -2 %; biased, proven (log E 100.0 > 9.2)");
  EXPECT_EQ(finding_of(open()), "undecided after 1000 samples a ray; 800 were planned");
  EXPECT_EQ(finding_of(unjudged("no reference")), "no reference");
  EXPECT_EQ(finding_of(unsampled(passed(), Status::skipped, "no data")), "no data");
  // What fails comes before what is open.
  CellRecord record = open();
  record.verdict->laws = {{"independence", 100, 100, Outcome::none}};
  decide(*record.verdict);
  EXPECT_EQ(finding_of(record),
            "law \"independence\" is broken (log E = 100.0): flights, samples or rays depend on each other; a tracker that takes "
            "several flights a sample, or collides without a lookup, states flies_once() false; undecided after 1000 samples a "
            "ray; 800 were planned");
}

/// Catoni's bets take the variance as given, and bets against a bias are his only where samples have no bound above: there the
/// law is "variance from below".  A pilot's variance is not stated.
TEST(Words, NoBiasIsProvenByAStatedVarianceThatIsRefuted) {
  for (const char* law : {"variance", "variance from below", "independence"})
    for (const TestBasis basis : {TestBasis::catoni, TestBasis::both, TestBasis::betting})
      for (const char* from : {"analytic", "pilot"}) {
        CellRecord record = failed();
        record.verdict->variance_basis = from;
        record.verdict->tests[0].basis = basis;
        record.verdict->laws = {{law, 50, 100, Outcome::none}};
        decide(*record.verdict);
        EXPECT_EQ(kind_of(record), Kind::fail);
        const std::string broken =
            fmt::format("law \"{}\" is broken (log E = 50.0)", law) +
            (std::string(law) != "independence"
                 ? ""
                 : ": flights, samples or rays depend on each other; a tracker that takes several flights a sample, or collides "
                   "without a lookup, states flies_once() false");
        const bool rests =
            std::string(law) == "variance from below" && basis != TestBasis::betting && std::string(from) == "analytic";
        EXPECT_EQ(finding_of(record),
                  "mean 0.49, expected 0.5: -2 %" +
                      std::string(
                          rests ? ", but no bias is proven: the evidence (log E 100.0 > 9.2) rests on the stated variance, which "
                                  "is too small; "
                                : "; biased, proven (log E 100.0 > 9.2); ") +
                      broken);
        record.verdict->laws[0].log_e = 0;
        decide(*record.verdict);
        EXPECT_EQ(finding_of(record), "mean 0.49, expected 0.5: -2 %; biased, proven (log E 100.0 > 9.2)");
      }
}

TEST(Words, AreTheSameInEveryOutput) {
  CellRecord pass = passed(), fail = failed();
  pass.verdict->bound_unproven = true;
  fail.verdict->variance_basis = "pilot";
  fail.verdict->tests[0].basis = TestBasis::catoni;
  RunRecord run = run_of({pass, fail, unjudged("no reference"), passed()});
  const Summary summary = summarise(run);
  const std::string passes = "PASS (bound not proven)", proves = "|bias| < 2 % of the mean";
  const std::string fails = "FAIL (by pilot)", why = "mean 0.49, expected 0.5: -2 %; biased, proven (log E 100.0 > 9.2)";
  const auto says = [](const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << words << "\n" << text;
  };
  const std::string text = summary_text(run, summary);
  says(text, passes + ": cell 0: " + proves + "\n");
  says(text, fails + ": cell 1: " + why + "\n");
  says(text,
       "2 PASS (of them 1 bound not proven), 1 FAIL (of them 1 by pilot), 0 INCONCLUSIVE as planned, 0 INCONCLUSIVE, 0 VIOLATED, "
       "0 errors, "
       "0 not run, 1 not tested\n");
  EXPECT_EQ(text.find("cell 3"), std::string::npos) << "a PASS without a mark needs no line";
  const std::string markdown = summary_markdown(run, summary, "r.json");
  says(markdown, "| " + passes + " | cell 0 | \\|bias\\| < 2 % of the mean |");
  says(markdown, "| " + fails + " | cell 1 | " + why + " |");
  says(markdown, "2 PASS (of them 1 bound not proven), 1 FAIL (of them 1 by pilot)");
  const std::string junit_text = junit(run, "r.json");
  says(junit_text, "<system-out>" + passes + ": |bias| &lt; 2 % of the mean</system-out>");
  says(junit_text, "<failure message=\"" + xml(fails + ": " + why) + "\">");
  const std::string table = results_tables(run);
  says(table, passes);
  says(table, "  " + proves);
  says(table, fails);
  says(table, "  " + why);
  says(results_tables(run_of({violated()})), "  " + finding_of(violated()));
  says(results_tables(run_of({open()})), "  " + finding_of(open()));
  says(stability_text(run), "1 PASS (bound not proven), 1 FAIL (by pilot), 1 not tested (claims unbiased), 1 PASS ");
  const std::string csv = export_results(run, "csv", "r.json");
  says(csv, ",verdict,marks,finding\r\n");
  says(csv, ",PASS,bound not proven,|bias| < 2 % of the mean\r\n");
  says(csv, ",FAIL,by pilot,\"" + why + "\"\r\n");
  says(csv, ",not tested,,no reference\r\n");
  const std::string lines = export_results(run, "jsonl", "r.json");
  const Json first = Json::parse(lines.substr(0, lines.find('\n')));
  EXPECT_EQ(first["word"], "PASS");
  EXPECT_EQ(first["marks"], Json::array({"bound not proven"}));
  EXPECT_EQ(first["finding"], proves);
  const Json page = report_data({run}, {"r.json"}, "", "").json;
  EXPECT_EQ(page["cells"][0]["word"], "PASS");
  EXPECT_EQ(page["cells"][0]["marked_word"], passes);
  EXPECT_EQ(page["cells"][0]["marks"], Json::array({"bound not proven"}));
  EXPECT_EQ(page["cells"][0]["finding"], proves);
  EXPECT_EQ(page["cells"][1]["marked_word"], fails);
  EXPECT_EQ(page["cells"][1]["finding"], why);
}

TEST(Words, AnOwnMeanReproducesNoPublishedClaim) {
  PublishedClaim claim;
  claim.id = "C";
  claim.parts.resize(1);
  claim.parts[0].relation = Relation::unbiased;
  claim.parts[0].cells = {"cell 0"};
  RunRecord run = run_of({passed()});
  run.claims = {claim};
  EXPECT_EQ(findings(run).at(0).outcome, ClaimOutcome::reproduced);
  run.cells = run_of({passed_by_own_mean()}).cells;
  EXPECT_EQ(findings(run).at(0).outcome, ClaimOutcome::cannot_tell);
}

}  // namespace
}  // namespace nullmark
