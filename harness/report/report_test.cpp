#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "harness/io/packing.h"
#include "harness/report/data.h"
#include "harness/report/page.h"
#include "harness/report/results_tables.h"
#include "harness/run/image.h"
#include "harness/testing/page_data.h"
#include "harness/testing/program.h"
#include "harness/testing/record_examples.h"
#include "harness/testing/verdict_examples.h"

namespace nullmark {
namespace {

Json data_of(const RunRecord& run) { return report_data({run}, {"example.json"}, "", "nullmark report example.json").json; }

TEST(Report, ShowsTheNumbersOfTheResults) {
  const RunRecord run = example_results();
  const Json data = data_of(run);
  ASSERT_EQ(data["cells"].size(), run.cells.size());
  for (std::size_t i = 0; i < run.cells.size(); ++i) {
    const CellRecord& record = run.cells[i];
    const Json& cell = data["cells"][i];
    EXPECT_EQ(cell["id"], record.cell.id);
    ASSERT_EQ(cell["mean"].size(), record.channel.size());
    ASSERT_EQ(cell["outputs"].size(), record.channel.size());
    for (std::size_t c = 0; c < record.channel.size(); ++c) {
      EXPECT_EQ(cell["mean"][c].get<Real>(), *record.channel[c].mean);
      EXPECT_EQ(cell["variance_theory"][c].get<Real>(), *record.channel[c].variance_theory);
    }
    EXPECT_EQ(cell["lookups"].get<Real>(), *record.lookups_per_sample);
    const Json& scene = data["scenes"][cell["scene"].get<std::size_t>()];
    EXPECT_EQ(scene["medium"], record.medium->label);
    const auto in_ranking = [&](const Json& row) { return row["cell"] == i; };
    EXPECT_EQ(std::count_if(scene["ranking"].begin(), scene["ranking"].end(), in_ranking), 1);
  }
  ASSERT_EQ(data["claims"].size(), 2u);
  EXPECT_EQ(data["claims"][0]["required"], false);
  EXPECT_EQ(data["claims"][1]["required"], true);
  ASSERT_EQ(data["tables"].size(), 1u);
  EXPECT_EQ(data["tables"][0]["columns"], (std::vector<std::string>{"paper", "here", "theory"}));
  EXPECT_EQ(data["tables"][0]["given"], 1);
  const Json& row = data["tables"][0]["rows"][0];
  EXPECT_EQ(row["values"][0], 0.1);
  EXPECT_EQ(row["values"][1].get<Real>(), *run.cells[0].channel[0].rmse);
  EXPECT_EQ(row["cells"][1], 0);
}

TEST(Report, TellsWhichErrorsAreProvenToBeReachable) {
  RunRecord run = example_results();
  run.cells = {passed()};
  run.cells[0].verdict->tests[0].epsilon = 0.005 * run.cells[0].verdict->tests[0].reference;
  const Json data = data_of(run);
  EXPECT_EQ(data["cells"][0]["cost"]["seconds"][0]["proven"], true);
  EXPECT_EQ(data["cells"][0]["cost"]["seconds"][1]["proven"], false);
  EXPECT_NEAR(data["cells"][0]["verdict"]["excludes"].get<Real>(), 0.005, 1e-12);
  EXPECT_NE(data["scenes"][0]["unproven"].get<std::string>().find("above 0.5 % of the mean"), std::string::npos);
}

TEST(Report, TellsHowMergedResultsAreMadeAgain) {
  RunRecord run = example_results();
  run.provenance["command_line"] = R"(["/opt/nullmark","run","c.json","--shard","1/2"])";
  run.provenance["parts"] = R"([{"command_line":["/opt/nullmark","run","c.json","--shard","1/2"]},
      {"command_line":["/opt/nullmark","run","c.json","--shard","2/2"]},
      {"command_line":["/opt/nullmark","run","c.json","--shard","1/2"]}])";
  const std::vector<std::string> expected = {"nullmark run c.json --shard 1/2", "nullmark run c.json --shard 2/2",
                                             "nullmark merge PART... -o example.json  # the results of the commands above",
                                             "nullmark check example.json", "nullmark compare example.json"};
  EXPECT_EQ(data_of(run)["runs"][0]["commands"], Json(expected));
}

TEST(Report, TablesSayThatMeasuredSamplesHaveNoTheory) {
  RunRecord run = example_results();
  EXPECT_EQ(results_tables(run).find("\n- theory: "), std::string::npos);
  run.cells[0].cell.measurement.clamp = true;
  EXPECT_NE(results_tables(run).find("\n- theory: none is known of clamped or quantised samples\n"), std::string::npos);
}

TEST(Report, TellsOfCellsThatDidNotRun) {
  RunRecord run = example_results();
  run.cells[1] = unsampled(run.cells[1], Status::skipped, "no data");
  const Json data = data_of(run);
  EXPECT_EQ(data["cells"][1]["status"], "skipped");
  EXPECT_EQ(data["cells"][1]["reason"], "no data");
  EXPECT_TRUE(data["cells"][1]["scene"].is_null());
  EXPECT_EQ(data["runs"][0]["verdicts"]["not_run"], 1);
}

TEST(Report, TellsWhichVersionMeasuredAndWhichShows) {
  RunRecord run = example_results();
  run.provenance["version"] = "\"0.0.1\"";
  const ReportData data = report_data({run}, {"example.json"}, "", "");
  EXPECT_EQ(data.json["runs"][0]["version"], "0.0.1");
  EXPECT_NE(data.json["version"], "0.0.1");
  ASSERT_EQ(data.warnings.size(), 1u);
  EXPECT_NE(data.warnings[0].find("measured by 0.0.1, read by"), std::string::npos);
}

TEST(Report, NothingIsNeverWrittenAsANumber) {
  RunRecord run = example_results();
  run.cells[0].channel[0].mean = std::numeric_limits<Real>::quiet_NaN();
  run.cells[0].time->repetition_ns.clear();
  const Json data = data_of(run);
  EXPECT_TRUE(data["cells"][0]["mean"][0].is_null());
  EXPECT_TRUE(data["cells"][0]["time"]["ns_per_sample"].is_null());
}

TEST(Report, ThePageNeedsNothingBesideItAndNoNameBreaksOut) {
  RunRecord run = example_results();
  run.name = "</title></script><script>alert(1)</script>";
  run.cells[0].reason = "</script><img src=x onerror=alert(1)>";
  const std::string page = report_page(data_of(run));
  EXPECT_EQ(page.find("alert(1)</script>"), std::string::npos);
  EXPECT_EQ(page.find("<img src=x"), std::string::npos);
  for (const char* place : {"{{title}}", "{{css}}", "{{plotly}}", "{{script}}", "{{boot}}", "{{data}}"})
    EXPECT_EQ(page.find(place), std::string::npos) << place;
  for (const char* outside : {"<script src", "<link", "@import", "<img src=\"http"})
    EXPECT_EQ(page.find(outside), std::string::npos);
  // The data come back as they went in.
  EXPECT_EQ(Json::parse(data_of_page(page))["runs"][0]["name"], run.name);
}

std::vector<std::uint16_t> numbers_of(const std::string& text) {
  const std::string bytes = from_base64(text);
  std::vector<std::uint16_t> numbers;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2)
    numbers.push_back(
        static_cast<std::uint16_t>(static_cast<std::uint8_t>(bytes[i]) + 256 * static_cast<std::uint8_t>(bytes[i + 1])));
  return numbers;
}

class ReportImage : public ProgramTest {};

TEST_F(ReportImage, PicturesAreThoseOfTheRun) {
  RunRecord run = example_results();
  const Layer mean{"mean.0", {0, 1, 2, 3, 4, std::numeric_limits<Real>::quiet_NaN()}};
  write_exr((folder_ / "a.exr").string(), 3, 2, {mean, {"lookups", {5, 5, 5, 5, 5, 5}}});
  const LayeredImage read = read_exr((folder_ / "a.exr").string());
  EXPECT_EQ(read.width, 3);
  ASSERT_EQ(read.layers.size(), 2u);
  EXPECT_EQ(read.layers[1].name, "mean.0");
  EXPECT_EQ(read.layers[1].values[4], 4);

  run.cells[0].cell.images = run.cells[1].cell.images = true;
  run.cells[0].images["layers"] = run.cells[1].images["layers"] = "a.exr";
  const std::string file = (folder_ / "r.json").string();
  ReportData data = report_data({run}, {file}, "", "");
  EXPECT_TRUE(data.warnings.empty());
  EXPECT_EQ(data.json["images"].size(), 2u);  // each once
  EXPECT_EQ(data.json["cells"][0]["images"], data.json["cells"][1]["images"]);
  const Json& picture = data.json["images"][data.json["cells"][0]["images"]["mean"].get<std::size_t>()];
  const std::vector<std::uint16_t> k = numbers_of(picture["data"]);
  ASSERT_EQ(k.size(), 6u);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(picture["low"].get<Real>() + (picture["high"].get<Real>() - picture["low"].get<Real>()) * k[i] / 65534,
                mean.values[i], 1e-4);
  EXPECT_EQ(k[5], 65535);

  for (const char* outside : {"../a.exr", "/a.exr", "x/../../a.exr"}) {
    run.cells[0].images["layers"] = outside;
    data = report_data({run}, {file}, "", "");
    ASSERT_EQ(data.warnings.size(), 1u);
    EXPECT_NE(data.warnings[0].find("leads out"), std::string::npos);
  }
  run.cells[0].images["layers"] = "gone.exr";
  data = report_data({run}, {file}, "", "");
  EXPECT_EQ(data.warnings.size(), 1u);
  EXPECT_TRUE(data.json["cells"][0]["images"].is_null());

  run.cells[0].images["layers"] = "r.images/a.exr";
  run.provenance["command_line"] = R"(["nullmark","run","c.json"])";
  data = report_data({run}, {file}, "", "");
  ASSERT_EQ(data.warnings.size(), 1u);
  const std::string remedy = "keep r.images beside r.json, or make both again: nullmark run c.json";
  EXPECT_NE(data.warnings[0].find(remedy), std::string::npos) << data.warnings[0];
  EXPECT_NE(data.json["runs"][0]["remarks"].dump().find(remedy), std::string::npos);
}

TEST_F(ReportImage, LargePicturesAreAveragedDown) {
  RunRecord run = example_results();
  std::vector<Real> values(512 * 512);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<Real>(i % 2);  // every pair of pixels averages to 1/2
  values[0] = 2;                                                                         // (2 + 1 + 0 + 1) / 4 = 1
  write_exr((folder_ / "a.exr").string(), 512, 512, {{"mean.0", values}});
  run.cells[0].images["layers"] = "a.exr";
  const Json data = report_data({run}, {(folder_ / "r.json").string()}, "", "").json;
  EXPECT_EQ(data["images"][0]["width"], 256);
  EXPECT_EQ(data["images"][0]["low"], 0.5);
  EXPECT_EQ(data["images"][0]["high"], 1);
}

class ReportCli : public ProgramTest {};

TEST_F(ReportCli, WritesThePageAndASummary) {
  write("c.json", R"({"nullmark":"config/2","timing":{"repetitions":2,"seconds":0.001},"experiments":[
      {"name":"e","rays":{"type":"orthographic","width":4,"height":4},"samples_per_ray":64,"images":true,
       "matrix":{"estimator":["ratio","delta"],"medium":["linear"]}}]})");
  ASSERT_EQ(run("run c.json -o r.json"), 0) << read("err");
  ASSERT_EQ(run("report r.json -o r.html --markdown r.md"), 0) << read("err");
  EXPECT_TRUE(read("out").empty());
  EXPECT_GT(read("r.html").size(), 1'500'000u);
  EXPECT_NE(read("r.md").find("| ratio |"), std::string::npos);
  EXPECT_EQ(run("report none.json -o n.html"), 2);
  EXPECT_EQ(run("report r.json -o none/n.html"), 2);
  EXPECT_EQ(run("report r.json -o n.html --baseline dleta"), 2);
  EXPECT_NE(read("err").find("did you mean \"delta\"?"), std::string::npos) << read("err");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "n.html"));
}

}  // namespace
}  // namespace nullmark
