#include "harness/io/results_json.h"

#include <gtest/gtest.h>

#include "harness/io/file_io.h"
#include "harness/report/results_tables.h"
#include "harness/testing/record_examples.h"

namespace nullmark {
namespace {

std::string error_in(const std::string& text) {
  try {
    read_results(text, "r.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(ResultsJson, EveryFieldComesBackBitForBit) {
  const RunRecord run = example_results();
  const RunRecord again = read_results(results_text(run), "r.json");
  EXPECT_EQ(results_text(again), results_text(run));
  EXPECT_EQ(again.config_text, run.config_text);
  EXPECT_EQ(again.provenance, run.provenance);
  ASSERT_EQ(again.cells.size(), run.cells.size());
  for (std::size_t i = 0; i < run.cells.size(); ++i) {
    const CellRecord &a = run.cells[i], &b = again.cells[i];
    EXPECT_EQ(a.cell.id, b.cell.id);
    EXPECT_EQ(a.cell.name, b.cell.name);
    EXPECT_EQ(a.cell.estimator, b.cell.estimator);
    EXPECT_EQ(a.medium, b.medium);
    EXPECT_EQ(a.medium->label, b.medium->label);
    EXPECT_EQ(a.majorant, b.majorant);
    EXPECT_EQ(a.ray_set, b.ray_set);
    ASSERT_EQ(a.channel.size(), b.channel.size());
    for (std::size_t c = 0; c < a.channel.size(); ++c) {
      const auto fields = [](const ChannelRecord& r) {
        return std::vector{r.mean,     r.reference,       r.reference_error,   r.bias,     r.rmse,          r.rmse_theory,
                           r.variance, r.variance_theory, r.relative_variance, r.kurtosis, r.reference_rms, r.bias_theory};
      };
      EXPECT_EQ(fields(a.channel[c]), fields(b.channel[c]));
    }
    EXPECT_EQ(a.lookups, b.lookups);
    EXPECT_EQ(a.draws, b.draws);
    EXPECT_EQ(a.lookups_theory, b.lookups_theory);
    EXPECT_EQ(a.null_collisions_per_sample, b.null_collisions_per_sample);
    EXPECT_EQ(a.largest_violation, b.largest_violation);
    EXPECT_EQ(a.time->repetition_ns, b.time->repetition_ns);
    EXPECT_EQ(a.time->loop_ratio, b.time->loop_ratio);
    EXPECT_EQ(a.time->waiting, b.time->waiting);
    EXPECT_EQ(a.time->majorant_build_seconds, b.time->majorant_build_seconds);
    EXPECT_EQ(a.squared_error_blocks, b.squared_error_blocks);
    ASSERT_EQ(b.time->batches.size(), 2u);
    EXPECT_EQ(b.time->batches[0].samples_per_traversal, 1u);
    EXPECT_EQ(b.time->batches[0].ns_per_sample, a.time->batches[0].ns_per_sample);
    EXPECT_EQ(b.time->batches[0].mad, a.time->batches[0].mad);
    EXPECT_EQ(a.structure, b.structure);
    ASSERT_EQ(a.convergence.size(), b.convergence.size());
    ASSERT_EQ(a.convergence[1].channel.size(), b.convergence[1].channel.size());
    for (std::size_t c = 0; c < a.convergence[1].channel.size(); ++c)
      EXPECT_EQ(a.convergence[1].channel[c].variance, b.convergence[1].channel[c].variance);
  }
  EXPECT_EQ(again.tables[0].rows[0].cells, run.tables[0].rows[0].cells);
  EXPECT_EQ(again.tables[0].rows[0].theory_of, run.tables[0].rows[0].theory_of);
}

TEST(ResultsJson, OneChannelIsNumbersMoreAreLists) {
  const RunRecord run = example_results();
  const Json grey = cell_json(run.cells[0]), chromatic = cell_json(run.cells[1]);
  EXPECT_TRUE(grey["mean"].is_number());
  EXPECT_TRUE(grey["kurtosis"].is_null());
  EXPECT_TRUE(grey["reference"]["value"].is_number());
  EXPECT_EQ(chromatic["mean"].size(), 3u);
  EXPECT_TRUE(chromatic["kurtosis"][0].is_null());
  EXPECT_EQ(chromatic["convergence"][0]["rmse"].size(), 3u);
  EXPECT_EQ(grey["efficiency"]["variance_x_lookups"].get<Real>(),
            *run.cells[0].channel[0].variance_theory * *run.cells[0].lookups_per_sample);
}

TEST(ResultsJson, NothingButFiniteNumbersIsWritten) {
  RunRecord run = example_results();
  run.cells[0].channel[0].mean = std::numeric_limits<Real>::quiet_NaN();
  run.cells[0].channel[0].variance_theory = kInfinity;
  run.cells[0].channel[0].relative_variance.reset();
  run.cells[0].time->floor_ratio = -kInfinity;
  run.cells[1].convergence[0].channel[2].rmse = kInfinity;
  const std::string text = results_text(run);
  const Json json = Json::parse(text);
  EXPECT_TRUE(json["cells"][0]["mean"].is_null());
  EXPECT_TRUE(json["cells"][0]["efficiency"]["variance_x_lookups"].is_null());
  EXPECT_TRUE(json["cells"][0]["time"]["floor_ratio"].is_null());
  EXPECT_TRUE(json["cells"][1]["convergence"][0]["rmse"][2].is_null());
  const RunRecord again = read_results(text, "r.json");
  EXPECT_FALSE(again.cells[0].channel[0].mean);
  EXPECT_EQ(again.cells[0].channel[0].variance, run.cells[0].channel[0].variance);
}

TEST(ResultsJson, UnsampledCellsKeepTheirReason) {
  RunRecord run = example_results();
  run.cells[1] = unsampled(run.cells[1], Status::skipped, "no \"data\"");
  const RunRecord again = read_results(results_text(run), "r.json");
  EXPECT_EQ(again.cells[1].status, Status::skipped);
  EXPECT_EQ(again.cells[1].reason, "no \"data\"");
  EXPECT_TRUE(again.cells[1].channel.empty());
  EXPECT_EQ(results_text(again), results_text(run));
}

TEST(ResultsJson, StatisticsLeaveOutTimeProvenanceAndPaths) {
  const RunRecord run = example_results();
  RunRecord other = run;
  other.provenance["start"] = "\"later\"";
  other.cells[0].time.reset();
  other.cells[1].time->ns_per_sample += 1;
  other.cells[1].time->majorant_build_seconds += 1;
  EXPECT_EQ(statistics_text(other), statistics_text(run));
  other.cells[0].channel[0].mean = std::nextafter(*other.cells[0].channel[0].mean, 1);
  EXPECT_NE(statistics_text(other), statistics_text(run));
}

TEST(ResultsJson, ErrorsAreOneLine) {
  const std::string text = results_text(example_results());
  EXPECT_EQ(error_in(text), "no error");
  EXPECT_EQ(error_in(replaced(text, "results/2", "results/3")),
            "r.json: /nullmark: found \"results/3\"; expected \"results/2\", the version this program reads");
  EXPECT_EQ(error_in(R"({"nullmark_schema": 1, "name": "old"})"),
            "r.json: are results of version 1; this program reads \"nullmark\": \"results/2\": run their configuration again");
  EXPECT_EQ(error_in("{}"), "r.json: is not a results file of nullmark; `nullmark run` writes them");
  EXPECT_EQ(error_in(replaced(text, "\"status\":\"ok\"", "\"status\":\"okay\"")),
            "r.json: /cells/0/status: unknown status \"okay\"; expected one of \"ok\", \"skipped\", \"not_run\", \"error\"");
  EXPECT_EQ(error_in(replaced(text, "\"rays\":1,\"samples_per_ray\"", "\"rays\":-1,\"samples_per_ray\"")),
            "r.json: /cells/0/rays: found -1; expected a whole number >= 0");
  EXPECT_EQ(error_in(replaced(text, "\"channels\":3", "\"channels\":2")).substr(0, 29), "r.json: /cells/1/mean: found ");
  EXPECT_NE(error_in(text.substr(0, text.size() / 2)).find("r.json:"), std::string::npos);
  // Later versions of the same major number may add keys.
  EXPECT_EQ(error_in(replaced(text, "\"status\":\"ok\"", "\"new\":1,\"status\":\"ok\"")), "no error");
}

/// Numbers of a cell that contradict each other.
TEST(ResultsJson, EditedFilesDoNotFitThemselves) {
  RunRecord run = example_results();
  TestRecord test;
  test.samples = 10;
  test.basis = TestBasis::betting;
  VerdictRecord& verdict = run.cells[0].verdict.emplace();
  verdict.against = "reference";
  verdict.variance_basis = "analytic";
  verdict.samples_per_ray = 10;
  verdict.tests = {test};
  ASSERT_EQ(error_in(results_text(run)), "no error");
  const auto error_with = [&](const auto& edit) {
    RunRecord edited = run;
    edit(edited.cells[0]);
    const std::string error = error_in(results_text(edited));
    return error.substr(0, error.find("; the file was changed"));
  };
  EXPECT_EQ(error_with([](CellRecord& cell) { *cell.channel[0].bias += 1e-3; }).rfind("r.json: /cells/0/bias: found bias ", 0),
            0u);
  EXPECT_EQ(error_with([](CellRecord& cell) { *cell.channel[0].mean += 1e-3; }).rfind("r.json: /cells/0/bias: found bias ", 0),
            0u);
  EXPECT_EQ(
      error_with([](CellRecord& cell) { *cell.channel[0].mean *= 1 + 1e-7; }).rfind("r.json: /cells/0/bias: found bias ", 0), 0u);
  const auto place_of = [&](const auto& edit) {
    const std::string error = error_with(edit);
    return error.substr(0, error.find(": found "));
  };
  EXPECT_EQ(place_of([](CellRecord& cell) { cell.samples = 1'000'000'000'000'000; }), "r.json: /cells/0/samples");
  EXPECT_EQ(place_of([](CellRecord& cell) { cell.lookups *= 2; }), "r.json: /cells/0/lookups_per_sample");
  EXPECT_EQ(place_of([](CellRecord& cell) { cell.draws /= 2; }), "r.json: /cells/0/rng_draws_per_sample");
  EXPECT_EQ(place_of([](CellRecord& cell) { *cell.channel[0].rmse *= 0.9; }), "r.json: /cells/0/rmse");
  EXPECT_EQ(place_of([](CellRecord& cell) { cell.channel[0].rmse = *cell.channel[0].bias / 2; }), "r.json: /cells/0/rmse");
  EXPECT_EQ(place_of([](CellRecord& cell) { *cell.channel[0].variance *= 0.9; }), "r.json: /cells/0/variance");
  EXPECT_EQ(place_of([](CellRecord& cell) { cell.channel[0].kurtosis = 0.5; }), "r.json: /cells/0/kurtosis");
  EXPECT_EQ(place_of([](CellRecord& cell) { *cell.channel[0].relative_variance *= 0.9; }), "r.json: /cells/0/relative_variance");
  EXPECT_EQ(place_of([](CellRecord& cell) { cell.verdict->samples_per_ray *= 2; }), "r.json: /cells/0/verdict");
  RunRecord twice = run;
  twice.cells.push_back(twice.cells[0]);
  EXPECT_NE(error_in(results_text(twice)).find("a second time; expected each cell once"), std::string::npos);
}

TEST(ResultsJson, FilesAreReplacedAtOnce) {
  const std::string path = ::testing::TempDir() + "nullmark_atomic.json";
  write_atomically(path, "old");
  write_atomically(path, "new");
  EXPECT_EQ(read_file(path), "new");
  EXPECT_THROW(write_atomically("/nowhere/at/all.json", "x"), InputError);
  EXPECT_THROW(read_file("/nowhere/at/all.json"), InputError);
}

TEST(Table, ShowsGroupsTheoryForHeavyTailsAndTheSourceBeside) {
  RunRecord run = example_results();
  run.cells[0].channel[0].relative_variance = 1e6;
  run.cells[0].channel[0].rmse = 0.125;
  run.cells[0].channel[0].rmse_theory = 0.25;
  const std::string text = results_tables(run);
  EXPECT_NE(text.find("e: linear, global, transmittance, single, 10 samples per ray, seed 1\n"), std::string::npos) << text;
  EXPECT_NE(text.find("0.25*"), std::string::npos) << text;
  EXPECT_NE(text.find("  channel 2"), std::string::npos);
  EXPECT_NE(text.find("T (rmse)\n   paper   here  theory  note\nR    0.1  0.125    0.25  not reproduced\n"), std::string::npos)
      << text;
}

}  // namespace
}  // namespace nullmark
