#include "harness/report/warnings.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/analysis/check.h"
#include "harness/io/json_input.h"
#include "harness/report/check_text.h"
#include "harness/testing/record_examples.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

TEST(Remarks, ResultsOfAnotherVersionSaySo) {
  RunRecord run = example_results();
  EXPECT_FALSE(version_remark(run));  // they name none
  run.provenance["version"] = "\"0.0.1\"";
  run.provenance["git"] = R"({"commit":"0123456789abcdef","dirty":false})";
  EXPECT_EQ(measured_by(run), "0.0.1 (0123456)");
  EXPECT_NE(version_remark(run)->find("measured by 0.0.1 (0123456), read by " + this_version()), std::string::npos);
}

TEST(Remarks, ATreeOfOneBoundSaysSo) {
  const auto remark = [](const std::string& medium, const std::string& majorant, std::size_t cells) {
    const Plan plan = read_config(fmt::format(R"({{"nullmark":"config/2","experiments":[{{"name":"e","rays":"single",
        "samples_per_ray":1,"matrix":{{"estimator":"ratio","medium":"{}","majorant":"{}"}}}}]}})",
                                              medium, majorant),
                                  "c.json");
    RunRecord run = example_results(plan);
    run.cells[0].structure = StructureSize{.cells = cells};
    return single_bound_remark(run);
  };
  EXPECT_NE(remark("linear", "octree", 1)->find("in 1 of 1 cells a tree of bounds has one bound"), std::string::npos);
  EXPECT_TRUE(remark("gaussian_bump", "kd_tree", 1));
  EXPECT_FALSE(remark("linear", "octree", 8));
  EXPECT_FALSE(remark("linear", "global", 1));
  EXPECT_FALSE(remark("homogeneous", "octree", 1));  // no split could lower it
}

TEST(Remarks, TimesOfABusyMachineSaySo) {
  RunRecord run = example_results();
  for (CellRecord& record : run.cells) record.time->waiting = kBusy;
  run.cells[0].time->waiting.reset();  // results that do not tell
  EXPECT_FALSE(busy_remark(run));
  run.cells[1].time->waiting = 0.4;
  EXPECT_EQ(busy_remark(run),
            "1 of 4 cells were timed on a busy machine, where the thread waited up to 40 % of the time; time them again on a "
            "quiet one");
}

TEST(Summary, SaysThatTheConfigurationDisabledTheVerdict) {
  const Plan plan = read_config(R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,
      "verdict":{"enabled":false},"matrix":{"estimator":["ratio","delta"],"medium":"linear"}}]})",
                                "c.json");
  RunRecord run = example_results(plan);
  const Summary summary = summarise(run);
  EXPECT_NE(summary_text(run, summary).find("no cell was judged: the configuration disables the verdict in all 2 cells"),
            std::string::npos)
      << summary_text(run, summary);
  for (const char* hostile : {"[]", R"({"experiments":3})", R"({"experiments":[{"include":[{"verdict":{"enabled":7}}, 1]}]})"}) {
    run.config_text = hostile;
    EXPECT_NE(summary_text(run, summarise(run)).find("no cell was judged\n"), std::string::npos) << hostile;
  }
}

TEST(Summary, AViolationIsTellingByCountAndSize) {
  RunRecord run = example_results();
  CellRecord& record = run.cells[0];
  record.verdict = VerdictRecord{};
  record.verdict->violated = true;
  record.verdict->reason = "needs a bound";
  record.majorant_violations = 12;
  record.lookups = 3456;
  record.largest_violation = 1.25;
  EXPECT_EQ(reason_of(record), "needs a bound: 12 of 3456 lookups above the bound, the largest 1.25 times it");
  record.majorant_violations = 0;
  record.largest_violation.reset();
  EXPECT_EQ(reason_of(record), "needs a bound: the extinction at a point on a ray is above the bound");
}

}  // namespace
}  // namespace nullmark
