// Times to errors that a verdict does not prove to be reachable, as `compare` marks them.

#include <gtest/gtest.h>

#include <algorithm>

#include "harness/analysis/comparison_test.h"
#include "harness/report/comparison_text.h"

namespace nullmark {
namespace {

using namespace comparison_test;

/// A cell whose PASS excludes a bias of `epsilon` of the mean over all rays, and a larger one of a group of them.
CellRecord passing_to(Real epsilon) {
  CellRecord record = cell("ratio");
  record.verdict.emplace();
  record.verdict->against = "reference";
  record.verdict->unbiased = Outcome::pass;
  TestRecord test;
  test.basis = TestBasis::betting;
  test.reference = 0.5;
  test.epsilon = epsilon * test.reference;
  record.verdict->tests = {test, test};
  record.verdict->tests[1].group = 3;
  record.verdict->tests[1].epsilon *= 4;
  return record;
}

/// The terminal's table of these cells, the stars in it, and whether Markdown says the same.
struct Shown {
  explicit Shown(const std::vector<CellRecord>& cells) {
    std::vector<RunRecord> runs(1);
    runs[0].cells = cells;
    text = compare_text(runs, "", false);
    stars = std::count(text.begin(), text.end(), '*');
    const std::string markdown = compare_markdown(runs, "", false);
    EXPECT_EQ(std::count(markdown.begin(), markdown.end(), '*'), stars + 4) << markdown;  // the heading has four
    EXPECT_EQ(markdown.find("\n* "), std::string::npos) << "a list: " << markdown;
  }
  bool has(const std::string& words) const { return text.find(words) != std::string::npos; }

  std::string text;
  std::ptrdiff_t stars = 0;
};

TEST(Compare, AnErrorBelowWhatTheVerdictExcludesIsNotProvenToBeReachable) {
  // One mark, on .1 %, and the line that explains it.
  const Shown wide({passing_to(0.01)});
  EXPECT_EQ(wide.stars, 2) << wide.text;
  EXPECT_TRUE(wide.has("* this error may not be reached: a PASS rules out only a bias above 1 % of the mean\n")) << wide.text;
  EXPECT_EQ(Shown({passing_to(0.02)}).stars, 3);
  EXPECT_EQ(Shown({passing_to(0.001)}).stars, 0);
  const Shown both({passing_to(0.01), passing_to(0.05), cell("delta")});
  EXPECT_TRUE(both.has("above 1 to 5 % of the mean, and without a PASS none is ruled out\n")) << both.text;
}

TEST(Compare, WithoutAPassNoErrorIsProvenToBeReachable) {
  CellRecord open = passing_to(0.001), own = open, lawless = open;
  open.verdict->unbiased = Outcome::inconclusive;
  // That it has its own mean says nothing about T.
  own.verdict->against = "own mean";
  own.verdict->unbiased = Outcome::none;
  own.verdict->own_mean = Outcome::pass;
  lawless.verdict->lawful = Outcome::fail;
  for (const CellRecord& record : {cell("ratio"), open, own, lawless}) {
    const Shown shown({record});
    EXPECT_EQ(shown.stars, 3) << shown.text;
    EXPECT_TRUE(shown.has("* this error may not be reached: without a PASS no bias is ruled out\n")) << shown.text;
  }
}

TEST(Compare, ExactTrackersAndMeasuredFloorsNeedNoMark) {
  CellRecord exact = passing_to(0.01);
  exact.claims = "exact";
  exact.verdict->tests[0].basis = exact.verdict->tests[1].basis = TestBasis::deterministic;
  exact.verdict->tests[0].rounding = 1e-12;
  EXPECT_EQ(Shown({exact}).stars, 0);
  EXPECT_EQ(Shown({marching(0.0005), marching(0.002), disproven("wrong", Outcome::fail, 0.5)}).stars, 0);
}

/// The unbiased tracker is cheaper from there on only if it reaches the error of both.
TEST(Compare, ABreakEvenBelowWhatTheVerdictExcludesIsMarked) {
  const Shown wide({passing_to(0.01), marching(0.0005)}), narrow({passing_to(0.0001), marching(0.0005)});
  EXPECT_TRUE(wide.has(" s, at 0.05 %*")) << wide.text;
  EXPECT_TRUE(narrow.has(" s, at 0.05 %")) << narrow.text;
  EXPECT_EQ(narrow.stars, 0) << narrow.text;
}

}  // namespace
}  // namespace nullmark
