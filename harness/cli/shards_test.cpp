// Shards of the program that share a cell: files, resumption, what is said of cells that stay open.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>

#include "harness/io/json_input.h"
#include "harness/model/exit_code.h"
#include "harness/run/build.h"
#include "harness/run/journal.h"
#include "harness/testing/ended_run.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

class Shards : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c.json", R"({"nullmark":"config/2","timing":{"repetitions":2,"seconds":0.0005},"experiments":[
      {"name":"large","rays":{"type":"orthographic","width":64,"height":64},"samples_per_ray":512,"images":true,
       "matrix":{"estimator":["ratio","next_flight_ratio"],"medium":{"type":"cosine","optical_depth":3}}},
      {"name":"small","rays":{"type":"chords","count":4},"samples_per_ray":64,
       "matrix":{"estimator":["ratio","delta"],"medium":"linear"}}]})");
    ASSERT_EQ(run("run c.json -o whole.json --no-timing"), 0) << read("err");
  }

  /// Runs all shards of three.
  void run_shards() const {
    for (int k = 1; k <= 3; ++k) ASSERT_EQ(run(fmt::format("run c.json --shard {}/3", k)), 0) << read("err");
  }
  std::string statistics(const std::string& file) const { return statistics_text(results(file)); }

  static const CellRecord& part_of(const RunRecord& run) {
    return *std::find_if(run.cells.begin(), run.cells.end(), [](const CellRecord& cell) { return !cell.part.empty(); });
  }
};

TEST_F(Shards, ShareLargeCellsAndMergeToTheWholeRun) {
  run_shards();
  const RunRecord first = results("c.1-of-3.results.json");
  EXPECT_EQ(std::count_if(first.cells.begin(), first.cells.end(), [](const CellRecord& cell) { return !cell.part.empty(); }), 2);
  EXPECT_NE(run("check c.1-of-3.results.json"), 0);
  EXPECT_NE(read("out").find("2 cells are drawn in part: `merge`"), std::string::npos) << read("out");
  ASSERT_EQ(run("merge c.1-of-3.results.json c.3-of-3.results.json -o two.json"), 0) << read("err");
  EXPECT_NE(read("err").find("shard 2/3 is missing; run it and merge all again"), std::string::npos) << read("err");
  ASSERT_EQ(run("merge c.1-of-3.results.json c.2-of-3.results.json c.3-of-3.results.json -o m.json"), 0) << read("err");
  EXPECT_EQ(read("err"), "");
  EXPECT_EQ(statistics("m.json"), statistics("whole.json"));
  for (const CellRecord& cell : results("m.json").cells) {
    EXPECT_TRUE(cell.time) << cell.cell.name;
    EXPECT_TRUE(cell.drawn_parts.empty());
    for (const auto& [kind, path] : cell.images) EXPECT_TRUE(std::filesystem::exists(folder_ / path)) << path;
  }
  EXPECT_EQ(results("m.json").cells[0].images.size(), results("whole.json").cells[0].images.size());
  EXPECT_EQ(run("check m.json"), run("check whole.json"));
}

TEST_F(Shards, CountTheCellsThatTheyTime) {
  std::size_t untimed = 0;
  for (int k = 1; k <= 3; ++k) {
    ASSERT_EQ(run(fmt::format("run c.json --shard {}/3", k)), 0) << read("err");
    const RunRecord part = results(fmt::format("c.{}-of-3.results.json", k));
    const auto timed =
        std::count_if(part.cells.begin(), part.cells.end(), [](const CellRecord& cell) { return cell.time.has_value(); });
    untimed += part.cells.size() - static_cast<std::size_t>(timed);
    if (timed == 0) continue;
    EXPECT_NE(read("err").find(fmt::format("timing {}/{}\n", timed, timed)), std::string::npos) << read("err");
  }
  EXPECT_GT(untimed, 0u) << "no shard draws a part of a cell that another one times";
}

TEST_F(Shards, AKilledShardKeepsItsParts) {
  run_shards();
  const RunRecord first = results("c.1-of-3.results.json");
  std::filesystem::remove(folder_ / "c.1-of-3.results.json");
  {
    Journal journal((folder_ / "c.1-of-3.results.json").string(), Json::parse(read("whole.json"))["config_hash"],
                    Journal::Mode::fresh, build_of(first.provenance));
    journal.append(part_of(first));
  }
  ASSERT_EQ(run("run c.json --shard 1/3 --resume"), 0) << read("err");
  EXPECT_EQ(read("err").find("] " + part_of(first).cell.name + ": part"), std::string::npos) << "drawn again";
  EXPECT_EQ(part_of(results("c.1-of-3.results.json")).drawn_parts, part_of(first).drawn_parts);
  ASSERT_EQ(run("merge c.1-of-3.results.json c.2-of-3.results.json c.3-of-3.results.json -o m.json"), 0) << read("err");
  EXPECT_EQ(statistics("m.json"), statistics("whole.json"));
}

TEST_F(Shards, AShardThatIsKilledGoesOnAfterItsParts) {
  write("k.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"k","rays":{"type":"orthographic","width":64,"height":64},"verdict":{"enabled":false},
       "matrix":{"samples_per_ray":[256,4096],"estimator":"ratio","medium":{"type":"cosine","optical_depth":3}}}]})");
  const auto results_file = folder_ / "k.1-of-2.results.json", journal_file = folder_ / "k.1-of-2.results.json.journal";
  // A whole line after the head: one that is cut is dropped.
  const auto holds_a_part = [&] {
    if (!std::filesystem::exists(journal_file)) return false;
    const std::string text = read(journal_file.filename());
    return text.find("\"drawn_parts\":") != std::string::npos && std::count(text.begin(), text.end(), '\n') >= 2;
  };
  {
    Process first(folder_, {"run", "k.json", "--shard", "1/2", "--threads", "1"});
    while (!holds_a_part() && !std::filesystem::exists(results_file)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    first.signal(SIGKILL);
    first.wait();
  }
  ASSERT_FALSE(std::filesystem::exists(results_file)) << "it had ended before its journal held a part";
  ASSERT_EQ(run("run k.json --shard 1/2 --resume"), 0) << read("err");
  EXPECT_NE(read("err").find("[1/1]"), std::string::npos) << read("err");
  ASSERT_EQ(run("run k.json --shard 2/2"), 0) << read("err");
  ASSERT_EQ(run("merge k.1-of-2.results.json k.2-of-2.results.json -o m.json"), 0) << read("err");
  ASSERT_EQ(run("run k.json -o all.json"), 0) << read("err");
  EXPECT_EQ(statistics("m.json"), statistics("all.json"));
}

TEST_F(Shards, AMissingShardLeavesCellsThatResumeDraws) {
  run_shards();
  ASSERT_EQ(run("merge c.1-of-3.results.json c.3-of-3.results.json -o m.json"), 0) << read("err");
  EXPECT_NE(read("err").find("`nullmark run CONFIG --resume -o m.json` draws them"), std::string::npos) << read("err");
  EXPECT_NE(run("check m.json"), 0);
  ASSERT_EQ(run("run c.json --resume -o m.json --no-timing"), 0) << read("err");
  EXPECT_EQ(statistics("m.json"), statistics("whole.json"));
}

TEST_F(Shards, DamagedPartsAreRefusedInOneLine) {
  run_shards();
  std::string text = read("c.2-of-3.results.json");
  const std::size_t at = text.find("\"drawn_parts\":[\"") + 100;
  text[at] = text[at] == 'A' ? 'B' : 'A';
  write("bad.json", text);
  EXPECT_EQ(run("merge c.1-of-3.results.json bad.json c.3-of-3.results.json -o m.json"), static_cast<int>(ExitCode::input_error));
  const std::string error = read("err");
  EXPECT_EQ(error.find("nullmark: bad.json: cell \""), 0u) << error;
  EXPECT_NE(error.find("run the shard again"), std::string::npos) << error;
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "m.json"));
}

TEST_F(Shards, ADryRunTellsTheLoad) {
  ASSERT_EQ(run("run c.json --shard 2/3 --dry-run"), 0) << read("err");
  EXPECT_NE(read("out").find("shard 2/3: "), std::string::npos) << read("out");
  EXPECT_NE(read("out").find("2 cells are split"), std::string::npos) << read("out");
}

}  // namespace
}  // namespace nullmark
