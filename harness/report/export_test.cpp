#include "harness/report/export.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "harness/io/json_input.h"
#include "harness/io/results_json.h"
#include "harness/testing/record_examples.h"

namespace nullmark {
namespace {

TEST(Export, GoogleBenchmarkHasARowPerTimedRepetition) {
  RunRecord run = example_results();
  run.cells[1].time.reset();
  const Json json = Json::parse(export_results(run, "google-benchmark", "r.json"));
  for (const char* key : {"date", "host_name", "executable", "num_cpus", "mhz_per_cpu", "caches", "load_avg",
                          "library_build_type", "json_schema_version"})
    EXPECT_TRUE(json["context"].contains(key)) << key;
  EXPECT_EQ(json["context"]["num_cpus"], 8);
  ASSERT_EQ(json["benchmarks"].size(), 6u);
  const Json& row = json["benchmarks"][1];
  EXPECT_EQ(row["name"], "ratio/linear/global");
  EXPECT_EQ(row["run_name"], row["name"]);
  EXPECT_EQ(row["run_type"], "iteration");
  EXPECT_EQ(row["repetitions"], 2);
  EXPECT_EQ(row["repetition_index"], 1);
  EXPECT_EQ(row["time_unit"], "ns");
  EXPECT_EQ(row["real_time"].get<Real>(), run.cells[0].time->repetition_ns[1]);
  EXPECT_EQ(row["rmse"].get<Real>(), *run.cells[0].channel[0].rmse);
}

TEST(Export, GoogleBenchmarkNamesBeginWithTheEstimator) {
  RunRecord run = example_results();
  run.cells[0].cell.name = "e/ratio/linear/global";
  const Json json = Json::parse(export_results(run, "google-benchmark", "r.json"));
  EXPECT_EQ(json["benchmarks"][0]["name"], "ratio/linear/global/experiment:e");
}

TEST(Export, CsvHasARowPerCellAndChannelAndQuotesWhatNeedsIt) {
  RunRecord run = example_results();
  run.cells[3] = unsampled(run.cells[3], Status::skipped, "no \"data\", none");
  const std::string text = export_results(run, "csv", "r.json");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 1 + 3 + 1 + 3);
  EXPECT_NE(text.find(",\"no \"\"data\"\", none\","), std::string::npos);
  EXPECT_NE(text.find("\"layers/values:1,2,3/lo:-1,0,0/spectrum:1,2,4\""), std::string::npos) << text;
}

TEST(Export, CsvHasAColumnForEveryParameter) {
  RunRecord run = example_results();
  run.cells.resize(2);
  run.cells[0].cell.estimator.edit([](Component& one) {
    one.values = {{"control", std::string("average")}, {"factor", Real{0.5}}};
  });
  run.cells[1].cell.estimator.edit([](Component& one) { one.values = {{"steps", 8}}; });
  run.cells[1].medium.edit([](MediumSpec& medium) { medium.field.values = {{"lo", std::array<Real, 3>{-1, 0, 0}}}; });
  std::istringstream lines(export_results(run, "csv", "r.json"));
  std::string heading, row;
  std::getline(lines, heading);
  for (const char* name :
       {",estimator.control,estimator.factor,estimator.steps,", ",medium.lo", ",seconds_to_1_percent_low,", ",claims,"})
    EXPECT_NE(heading.find(name), std::string::npos) << name << " in " << heading;
  std::getline(lines, row);
  EXPECT_NE(row.find(",average,0.5,,"), std::string::npos) << row;
}

TEST(Export, JsonLinesAreTheCells) {
  const RunRecord run = example_results();
  std::istringstream lines(export_results(run, "jsonl", "r.json"));
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    Json expected = cell_json(run.cells[count]);
    expected.update({{"word", "not tested"}, {"marks", Json::array()}, {"finding", "no verdict"}});
    EXPECT_EQ(Json::parse(line), expected);
  }
  EXPECT_EQ(count, 4u);
}

TEST(Export, JunitTellsErrorsAndSkippedCellsAndHowToRepeatThem) {
  RunRecord run = example_results();
  run.cells[1] = unsampled(run.cells[1], Status::skipped, "a < b & \"c\"");
  run.cells[2].status = Status::error;
  run.cells[2].reason = "3 samples are not finite";
  const std::string text = export_results(run, "junit", "r's.json");
  EXPECT_NE(text.find("tests=\"5\" failures=\"0\" errors=\"1\" skipped=\"3\""), std::string::npos);
  EXPECT_NE(text.find("<skipped message=\"not tested (claims unbiased): no verdict\">"), std::string::npos) << text;
  EXPECT_NE(text.find("<testcase classname=\"required claim\" name=\"D: so it must be\"/>"), std::string::npos) << text;
  EXPECT_EQ(text.find("so it is"), std::string::npos) << "a claim that is not required is no test";
  EXPECT_NE(text.find("<skipped message=\"a &lt; b &amp; &quot;c&quot;\">"), std::string::npos);
  EXPECT_NE(text.find("<error message=\"3 samples are not finite\">jq .config 'r'\\''s.json' | nullmark run - -o - --filter "
                      "'^residual_ratio/control:average/linear/global$'</error>"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace nullmark
