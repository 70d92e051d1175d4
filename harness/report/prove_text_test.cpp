#include "harness/report/prove_text.h"

#include <gtest/gtest.h>

#include "harness/testing/verdict_examples.h"

namespace nullmark {
namespace {

CellRecord in(const char* experiment, CellRecord record) {
  record.cell.experiment = experiment;
  return record;
}

TEST(ProveText, WhatIsNotTestedHasAReason) {
  const CellRecord late = unsampled(passed(), Status::not_run, "time budget spent");
  const RunRecord run = run_of(
      {in("a", passed()), in("a", late), in("a", late), in("b", late), in("b", unjudged("no reference")), in("b", failed())});
  const std::string text = findings_text(run);
  EXPECT_NE(text.find("not tested: cell 1 and 2 more\n  time budget spent\n"), std::string::npos) << text;
  EXPECT_NE(text.find("not tested: cell 4\n  no reference\n"), std::string::npos) << text;
  EXPECT_EQ(text.rfind("FAIL: cell 5\n", 0), 0u) << "failures come first: " << text;
  EXPECT_EQ(text.find("cell 0"), std::string::npos) << text;
  EXPECT_EQ(text.find("no cell was done in time"), std::string::npos) << text;
}

TEST(ProveText, WhereNoCellEndsTheWalkIsInDoubt) {
  const CellRecord late = unsampled(passed(), Status::not_run, "time budget spent");
  EXPECT_NE(findings_text(run_of({late, late})).find("\nno cell was done in time: does `propose` return false"),
            std::string::npos);
}

}  // namespace
}  // namespace nullmark
