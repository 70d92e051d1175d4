// What `check` makes of the verdicts of a run: exit code, JUnit, Markdown.

#include <gtest/gtest.h>

#include "harness/analysis/check.h"
#include "harness/report/check_text.h"
#include "harness/report/junit.h"
#include "harness/testing/verdict_examples.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

CellRecord judged(VerdictRecord verdict) {
  CellRecord record = example_results().cells[0];
  decide(verdict);
  record.verdict = verdict;
  return record;
}

TEST(Summary, ExitCodes) {
  const CellRecord pass = judged(verdict_of({passing()})), fail = judged(verdict_of({failing()}));
  const CellRecord open = judged(verdict_of({open_one()}));
  VerdictRecord deep = verdict_of({open_one()});
  deep.planned_undecidable = true;
  const CellRecord expected = judged(deep);
  VerdictRecord lookups = verdict_of({passing(), failing(-1)});
  VerdictRecord without_bound = verdict_of({failing()});
  without_bound.violated = true;
  const CellRecord violated = judged(without_bound);
  const CellRecord error = unsampled(pass, Status::error, "crashed"), skipped = unsampled(pass, Status::skipped, "no data");
  CellRecord unclaimed = pass;
  unclaimed.verdict.reset();

  EXPECT_EQ(exit_of({pass}), ExitCode::ok);
  EXPECT_EQ(exit_of({pass, expected, violated, skipped, unclaimed}), ExitCode::ok);
  EXPECT_EQ(exit_of({pass, open}), ExitCode::inconclusive);
  EXPECT_EQ(exit_of({expected}), ExitCode::inconclusive);
  EXPECT_EQ(exit_of({pass, open, error}), ExitCode::internal_error);
  EXPECT_EQ(exit_of({pass, open, error, fail}), ExitCode::bias_proven);
  EXPECT_EQ(exit_of({pass, judged(lookups)}), ExitCode::bias_proven);
  EXPECT_EQ(exit_of({skipped, unclaimed}), ExitCode::nothing_ran);
  EXPECT_EQ(exit_of({}), ExitCode::nothing_ran);
}

TEST(Summary, NoticesVerdictsThatItsFiguresDoNotBearOut) {
  CellRecord record = judged(verdict_of({open_one()}));
  record.verdict->unbiased = Outcome::pass;
  RunRecord run = run_of({record});
  Summary summary = summarise(run);
  EXPECT_EQ(summary.altered, 1u);
  EXPECT_EQ(summary.exit, ExitCode::internal_error);
  EXPECT_EQ(run.cells[0].verdict->unbiased, Outcome::inconclusive);

  VerdictRecord own = verdict_of({passing()});
  own.against = "own mean";
  record = judged(own);
  record.verdict->unbiased = Outcome::pass;
  run = run_of({record});
  EXPECT_EQ(summarise(run).altered, 1u) << "no own mean makes an estimator unbiased";

  record = judged(verdict_of({failing()}));
  record.verdict->unbiased = Outcome::pass;
  EXPECT_EQ(exit_of({record}), ExitCode::bias_proven);
}

TEST(Summary, JunitAndMarkdownTellEveryEndOfACell) {
  VerdictRecord own = verdict_of({failing()});
  own.against = "own mean";
  own.violated = true;
  RunRecord run = run_of({judged(verdict_of({passing()})), judged(verdict_of({failing()})), judged(verdict_of({open_one()})),
                          judged(verdict_of({passing(), failing(-1)})), judged(own)});
  const char* names[] = {"good", "a<b & \"c\"", "open", "costly", "violating"};
  for (std::size_t i = 0; i < run.cells.size(); ++i) run.cells[i].cell.name = names[i];
  run.cells[1].time.emplace().ns_per_sample = 500;
  run.cells[1].samples = 1'000'000;
  const Summary summary = summarise(run);
  const std::string xml = junit(run, "it's.json");
  EXPECT_NE(xml.find(R"(tests="5" failures="2" errors="0" skipped="2")"), std::string::npos) << xml;
  EXPECT_NE(xml.find(R"(name="a&lt;b &amp; &quot;c&quot;" time="0.500">)"), std::string::npos) << xml;
  EXPECT_NE(xml.find("<failure message=\"FAIL: mean 0, expected 0: +0; biased, proven (log E 100.0 &gt; 9.2)"), std::string::npos)
      << xml;
  EXPECT_NE(xml.find("<failure message=\"FAIL: lookups"), std::string::npos) << xml;
  EXPECT_NE(xml.find("<skipped message=\"INCONCLUSIVE: undecided"), std::string::npos) << xml;
  EXPECT_NE(xml.find("<skipped message=\"VIOLATED"), std::string::npos) << xml;
  EXPECT_NE(xml.find(R"(jq .config 'it'\''s.json' | nullmark run - -o - --filter '^open$')"), std::string::npos) << xml;
  const std::string markdown = summary_markdown(run, summary, "r.json");
  for (const char* row :
       {"| FAIL | a&lt;b & \"c\" | mean 0, expected 0: +0; biased, proven (log E 100.0", "| FAIL | costly | lookups differ",
        "| INCONCLUSIVE | open | undecided", "| VIOLATED | violating |", "--filter '^costly$'"})
    EXPECT_NE(markdown.find(row), std::string::npos) << row << "\n" << markdown;
  EXPECT_EQ(markdown.find("good"), std::string::npos);
  EXPECT_NE(summary_text(run, summary).find("1 PASS, 2 FAIL, 0 INCONCLUSIVE as planned, 1 INCONCLUSIVE, 1 VIOLATED"),
            std::string::npos);
}

}  // namespace
}  // namespace nullmark
