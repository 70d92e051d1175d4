#include "harness/performance_gate/performance_gate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <regex>

#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/results_json.h"
#include "harness/performance_gate/baseline.h"
#include "harness/performance_gate/report.h"
#include "harness/performance_gate/wall_time.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

/// 10 lookups a sample, as a Poisson number of them: 100 000 samples tell the mean to .1 %.
Counts example() {
  Counts counts;
  counts.source = "example.json";
  counts.name = "example";
  counts.config_hash = "0123456789abcdef";
  counts.build = {"gcc 12", "-O3", "x86-64-v3", "AVX2", "glibc 2.36", ""};
  CellCounts cell;
  cell.name = "ratio/linear/global";
  cell.id = "1111";
  cell.setting = "2222";
  cell.samples = 100'000;
  cell.lookups = 1'000'000;
  cell.draws = 1'100'000;
  cell.null_collisions = 1'000'000;
  cell.lookups_variance = 10;
  cell.lookups_theory = 10;
  cell.instructions = 400'000'000;
  counts.cells = {cell};
  return counts;
}

CellCounts& only(Counts& counts) { return counts.cells.at(0); }

/// The example with its lookups, draws and null collisions made more by a share.
Counts with_more_lookups(Real share) {
  Counts counts = example();
  CellCounts& cell = only(counts);
  const auto more = static_cast<std::uint64_t>(std::llround(share * 1e6));
  cell.lookups += more;
  cell.draws += more;
  cell.null_collisions += more;
  return counts;
}

GateResult finding(const PerformanceReport& report, Tier tier, const std::string& metric) {
  for (const GateRow& row : report.rows)
    if (row.tier == tier && row.metric == metric) return row.finding;
  ADD_FAILURE() << "no row for " << metric;
  return GateResult::not_compared;
}

TEST(PerformanceGate, EqualCountsAreTheSame) {
  const PerformanceReport report = compare_counts(example(), example());
  EXPECT_EQ(report.rows.size(), 3u);
  EXPECT_EQ(report.count(GateResult::same), 3u);
  EXPECT_EQ(report.exit(), ExitCode::ok);
}

TEST(PerformanceGate, MoreDrawsOnTheSameWalksAreARegressionHoweverFew) {
  Counts after = example();
  ++only(after).draws;
  PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::counts, "draws"), GateResult::regression);
  EXPECT_EQ(report.rows.at(0).confidence, "exact");
  EXPECT_EQ(report.exit(), ExitCode::regression);
  EXPECT_EQ(compare_counts(example(), after, 0.001).exit(), ExitCode::ok);
  only(after).draws -= 2;
  report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::counts, "draws"), GateResult::better);
  EXPECT_EQ(report.exit(), ExitCode::ok);
}

TEST(PerformanceGate, OtherWalksAreChangedUnlessChanceCannotDoIt) {
  // Standard error of the ratio .14 %.
  for (const Real share : {0.0001, 0.001, -0.001, -0.0001}) {
    const PerformanceReport report = compare_counts(example(), with_more_lookups(share));
    EXPECT_EQ(finding(report, Tier::counts, "lookups"), GateResult::changed) << share;
    EXPECT_EQ(finding(report, Tier::counts, "draws"), GateResult::changed) << share;
    EXPECT_EQ(report.exit(), ExitCode::ok) << share;
  }
  const PerformanceReport report = compare_counts(example(), with_more_lookups(0.03));
  EXPECT_EQ(finding(report, Tier::counts, "lookups"), GateResult::regression);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::regression);
  EXPECT_EQ(report.exit(), ExitCode::regression);
  EXPECT_EQ(compare_counts(example(), with_more_lookups(0.03), 0.05).exit(), ExitCode::ok);
  EXPECT_EQ(finding(compare_counts(example(), with_more_lookups(-0.03)), Tier::counts, "lookups"), GateResult::better);
}

TEST(PerformanceGate, ViolationsAndUnknownVariancesAreToldButProveNothing) {
  Counts after = example();
  only(after).majorant_violations = 5;
  EXPECT_EQ(finding(compare_counts(example(), after), Tier::counts, "majorant violations"), GateResult::changed);
  after = with_more_lookups(0.03);
  only(after).lookups_variance.reset();
  only(after).lookups_theory.reset();
  const PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::counts, "lookups"), GateResult::changed);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::not_compared);
  EXPECT_EQ(report.exit(), ExitCode::ok);
}

TEST(PerformanceGate, ALooserMajorantIsFoundWhereExactCountsCannotBeCompared) {
  Counts after = with_more_lookups(0.03);
  only(after).id = "another seed";
  const PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::counts, "counts"), GateResult::not_compared);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::regression);
  EXPECT_EQ(finding(report, Tier::expected, "expected lookups"), GateResult::same);
  // Without samples enough for an interval, theory alone still tells.
  after = example();
  only(after).id = "another seed";
  only(after).samples = 100, only(after).lookups = 1030;
  only(after).lookups_theory = 10.3;
  const PerformanceReport few = compare_counts(example(), after);
  EXPECT_EQ(finding(few, Tier::expected, "mean lookups"), GateResult::not_compared);
  EXPECT_EQ(finding(few, Tier::expected, "expected lookups"), GateResult::regression);
}

TEST(PerformanceGate, AnotherSeedOfTheSameExpectationIsNoRegression) {
  Counts after = with_more_lookups(0.002);
  only(after).id = "another seed";
  const PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::same);
  EXPECT_EQ(report.exit(), ExitCode::ok);
  only(after).setting = "another medium";
  EXPECT_EQ(compare_counts(example(), after).exit(), ExitCode::nothing_ran);
}

TEST(PerformanceGate, TheMeanIsHeldAgainstItselfWhereTheoryDidNotHold) {
  Counts before = example(), after = example();
  only(before).lookups_theory = only(after).lookups_theory = 9;
  only(after).id = "another seed";
  const PerformanceReport report = compare_counts(before, after);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::same);
}

TEST(PerformanceGate, InstructionsBeyondTheirThresholdAreARegression) {
  const auto compared = [](Real share, std::vector<Real> history = {}) {
    Counts before = example(), after = example();
    only(before).instruction_history = std::move(history);
    only(after).instructions = static_cast<std::uint64_t>(std::llround(4e8 * (1 + share)));
    return finding(compare_counts(before, after), Tier::instructions, "instructions");
  };
  EXPECT_EQ(compared(0.03), GateResult::regression);
  EXPECT_EQ(compared(0.0021), GateResult::regression);
  EXPECT_EQ(compared(0.0019), GateResult::same);
  EXPECT_EQ(compared(-0.0019), GateResult::same);
  EXPECT_EQ(compared(-0.03), GateResult::better);
  EXPECT_EQ(compared(0.003, {0.0005, 0.001, 0.0015, 0.002}), GateResult::same);
  EXPECT_EQ(compared(0.03, {0, 0.1, 0.2, 0.3}), GateResult::regression) << "no history hides 3 %";
}

TEST(PerformanceGate, ThresholdIsTheUpperFenceOfTheHistory) {
  EXPECT_EQ(instruction_threshold({}), 0.002);
  EXPECT_EQ(instruction_threshold({0.009, 0.009, 0.009}), 0.002);
  // Quartiles of 0 to .004 in five steps: .001 and .003.
  EXPECT_NEAR(instruction_threshold({0.004, 0, 0.002, 0.001, 0.003}), 0.009, 1e-15);
  EXPECT_EQ(instruction_threshold({0.1, 0.2, 0.3, 0.4}), 0.01);
}

TEST(PerformanceGate, ExactCountsOfAnotherBuildAreNotCompared) {
  Counts after = example();
  after.build.compiler = "gcc 13";
  ++only(after).draws;
  only(after).instructions = 500'000'000;
  PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(report.count(GateResult::regression), 0u);
  ASSERT_EQ(report.notes.size(), 1u);
  EXPECT_NE(report.notes[0].find("gcc 13"), std::string::npos);
  EXPECT_NE(performance_text(report).find("not compared (tier 1"), std::string::npos);
  EXPECT_EQ(finding(report, Tier::expected, "mean lookups"), GateResult::same);
  // Old results do not say what they were built for; two such are not equal builds.
  Counts before = example();
  before.build = after.build = {};
  EXPECT_EQ(compare_counts(before, after).count(GateResult::regression), 0u);
}

TEST(PerformanceGate, CellsOfOneSideAloneAreNotCompared) {
  Counts after = example();
  only(after).name = "renamed";
  const PerformanceReport report = compare_counts(example(), after);
  EXPECT_EQ(report.count(GateResult::not_compared), 2u);
  EXPECT_EQ(report.exit(), ExitCode::nothing_ran);
  for (const std::string& text : {performance_text(report), performance_markdown(report)}) {
    EXPECT_NE(text.find("only on the new side; cells are matched by name): 1 cell, for example renamed"), std::string::npos);
    EXPECT_NE(text.find("only on the old side; cells are matched by name): 1 cell"), std::string::npos);
  }
}

TEST(PerformanceGateBaseline, HistoryGoesOnWhereTheCodeDidNotChange) {
  Counts before = example(), after = example();
  only(before).instruction_history = {0.001};
  only(after).instructions = 400'400'000;
  const Counts carried = refreshed(before, after);
  ASSERT_EQ(carried.cells[0].instruction_history.size(), 2u);
  EXPECT_NEAR(carried.cells[0].instruction_history[1], 0.001, 1e-12);
  only(after).instructions = 440'000'000;
  EXPECT_TRUE(refreshed(before, after).cells[0].instruction_history.empty());
}

TEST(PerformanceGateBaseline, RefreshingLosesNoCellAndNoCount) {
  Counts after = example();
  only(after).instructions.reset();
  EXPECT_THROW(refreshed(example(), after), InputError);
  after.cells.clear();
  EXPECT_THROW(refreshed(example(), after), InputError);
  after.config_hash = "another configuration";
  EXPECT_NO_THROW(refreshed(example(), after));
}

TEST(PerformanceGateBaseline, FilesAreNamedByConfigurationAndBuildButNotByItsHash) {
  const std::string name = baseline_file_name(example());
  EXPECT_EQ(name.rfind("example.gcc-12.x86-64-v3.", 0), 0u) << name;
  Counts changed = example();
  changed.config_hash = "another";
  EXPECT_EQ(baseline_file_name(changed), name);
  changed.build.libc = "glibc 2.41";
  EXPECT_NE(baseline_file_name(changed), name);
}

TEST(PerformanceGateReport, SaysWhichCellWhichTierHowMuchAndHowSure) {
  Counts after = with_more_lookups(0.03);
  PerformanceReport report = compare_counts(example(), after);
  report.rows[0].cell = "a<b|c";
  const std::string junit = performance_junit(report), markdown = performance_markdown(report), text = performance_text(report);
  EXPECT_NE(junit.find("<testcase classname=\"tier 1, exact counts\" name=\"a&lt;b|c: lookups\">"), std::string::npos) << junit;
  EXPECT_NE(junit.find("<failure message=\"REGRESSION: lookups +3 %, threshold 0 % (+2."), std::string::npos) << junit;
  EXPECT_NE(junit.find("0.0001 over all cells"), std::string::npos) << junit;
  EXPECT_NE(junit.find("failures=\"3\""), std::string::npos) << junit;
  EXPECT_NE(markdown.find("| a<b\\|c | 1 exact counts | lookups | 10 | 10.3 | +3 % | 0 % |"), std::string::npos) << markdown;
  EXPECT_NE(text.find("3 performance regressions proven"), std::string::npos) << text;
  EXPECT_NE(text.find("--update"), std::string::npos) << text;
}

/// Blocks of one or more cells whose times are given by a function of side (0 old, 1 new, 2 control), cell and place in time.
template <class Time>
std::vector<TimedBlock> blocks(int count, int cells, Time time) {
  std::vector<TimedBlock> all;
  for (int b = 0; b < count; ++b) {
    int at = 6 * b;
    const auto run = [&](int side) {
      RunRecord record;
      for (int c = 0; c < cells; ++c) {
        CellRecord cell;
        cell.cell.name = fmt::format("cell {}", c);
        cell.status = Status::ok;
        TimeRecord timing;
        timing.ns_per_sample = time(side, c, at);
        timing.ns_per_lookup = timing.ns_per_sample / 10;
        timing.floor_ratio = timing.ns_per_lookup / 4;
        cell.time = timing;
        record.cells.push_back(cell);
      }
      ++at;
      return record;
    };
    TimedBlock block;
    block.before[0] = run(0), block.after[0] = run(1), block.control[0] = run(2);
    block.control[1] = run(2), block.after[1] = run(1), block.before[1] = run(0);
    all.push_back(std::move(block));
  }
  return all;
}

/// Noise of 3 % that a fixed seed decides.
struct Noise {
  std::mt19937_64 engine{7};
  Real operator()() { return std::exp(std::normal_distribution<Real>(0, 0.03)(engine)); }
};

std::size_t count(const std::vector<GateRow>& rows, GateResult finding) {
  return static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [&](const GateRow& row) { return row.finding == finding; }));
}

TEST(PerformanceGateWallTime, OnlyWhatIsSurelyBeyondTheThresholdIsSlower) {
  Noise noise;
  const auto timed = blocks(12, 3, [&](int side, int cell, int) {
    return 100 * noise() * (side == 1 && cell == 1 ? 1.15 : side == 1 && cell == 2 ? 1.03 : 1.0);
  });
  const std::vector<GateRow> rows = compare_wall_time(timed, {}, false);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].finding, GateResult::same);
  EXPECT_EQ(rows[1].finding, GateResult::slower);
  EXPECT_NEAR(*rows[1].change, 0.15, 0.05);
  EXPECT_NE(rows[2].finding, GateResult::slower);
  EXPECT_EQ(compare_wall_time(timed, {}, true)[1].finding, GateResult::regression);
  EXPECT_EQ(count(compare_wall_time(timed, 0.3, true), GateResult::regression), 0u);
}

TEST(PerformanceGateWallTime, DriftWithinABlockCancels) {
  const auto timed = blocks(10, 1, [](int, int, int at) { return 100 * std::exp(0.05 * at); });
  const GateRow row = compare_wall_time(timed, {}, false).at(0);
  EXPECT_EQ(row.finding, GateResult::same);
  EXPECT_NEAR(*row.change, 0, 1e-12);
}

TEST(PerformanceGateWallTime, AMachineThatTellsAProgramFromItselfIsNoisy) {
  Noise noise;
  const auto timed = blocks(10, 2, [&](int side, int cell, int) {
    return 100 * noise() * (side == 2 && cell == 0 ? 1.2 : 1.0) * (side == 1 && cell == 1 ? 1.3 : 1.0);
  });
  const std::vector<GateRow> rows = compare_wall_time(timed, {}, true);
  EXPECT_EQ(count(rows, GateResult::noisy), 2u);
  EXPECT_NE(rows[0].note.find("in cell 0"), std::string::npos) << rows[0].note;
}

TEST(PerformanceGateWallTime, EqualProgramsAreNotTold) {
  Noise noise;
  std::size_t told = 0;
  for (int run = 0; run < 50; ++run) {
    const auto rows = compare_wall_time(blocks(10, 16, [&](int, int, int) { return 100 * noise(); }), {}, true);
    told += count(rows, GateResult::regression) + count(rows, GateResult::better) + count(rows, GateResult::noisy);
  }
  EXPECT_EQ(told, 0u);
}

TEST(PerformanceGateWallTime, CellsWithoutLookupsAreTimedAgainstTheFloorOfOthers) {
  auto timed = blocks(10, 2, [](int, int, int) { return 100; });
  for (TimedBlock& block : timed)
    for (RunRecord& run : block.after) run.cells[0].time->ns_per_lookup = run.cells[0].time->floor_ratio = 0;
  EXPECT_NEAR(*compare_wall_time(timed, {}, false).at(0).change, 0, 1e-12);
}

class GateCli : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c.json", config(64));
    ASSERT_EQ(run("run c.json -o old.json"), 0) << read("err");
  }

  static std::string config(int samples) {
    return fmt::format(R"({{"nullmark":"config/2","name":"c","timing":{{"enabled":false}},"experiments":[
      {{"name":"e","rays":{{"type":"orthographic","width":16,"height":16}},"samples_per_ray":{},"verdict":{{"enabled":false}},
       "matrix":{{"estimator":["ratio","delta"],"medium":[{{"type":"gaussian_bump","optical_depth":2}}]}}}}]}})",
                       samples);
  }

  int gate(const std::string& arguments) const { return run("gate --baseline " + arguments); }
};

TEST_F(GateCli, TheSameProgramIsNoRegression) {
  ASSERT_EQ(run("run c.json -o new.json --threads 1"), 0);
  EXPECT_EQ(gate("old.json new.json"), 0) << read("err");
  EXPECT_NE(read("out").find("tier 1, exact counts: 2 same"), std::string::npos) << read("out");
}

TEST_F(GateCli, ALooserMajorantOfTheSameNameIsARegression) {
  ASSERT_EQ(run("run c.json -o loose.json", NULLMARK_LOOSE_PROGRAM), 0);
  EXPECT_EQ(gate("old.json loose.json --junit gate.xml --markdown gate.md"), 4);
  const std::string text = read("out");
  EXPECT_NE(text.find("tier 1, exact counts: 4 REGRESSION"), std::string::npos) << text;
  EXPECT_NE(text.find("tier 2, expected counts: 4 REGRESSION"), std::string::npos) << text;
  EXPECT_NE(read("gate.xml").find("<failure"), std::string::npos);
  EXPECT_NE(read("gate.md").find("REGRESSION"), std::string::npos);
  EXPECT_EQ(gate("old.json loose.json --threshold 10"), 0);
  // Where the seed differs, expectations tell.
  ASSERT_EQ(run("run c.json -o seed.json --seed 9", NULLMARK_LOOSE_PROGRAM), 0);
  EXPECT_EQ(gate("old.json seed.json"), 4);
  EXPECT_NE(read("out").find("tier 2, expected counts: 4 REGRESSION"), std::string::npos) << read("out");
}

TEST_F(GateCli, FiftySeedsOfTheSameProgramAreNoRegression) {
  for (int seed = 101; seed <= 150; ++seed) {
    ASSERT_EQ(run(fmt::format("run c.json -o new.json --force --seed {}", seed)), 0);
    EXPECT_EQ(gate("old.json new.json"), 0) << seed << ": " << read("out");
    EXPECT_EQ(read("out").find("better"), std::string::npos) << seed << ": " << read("out");
    // All four are compared: the two expectations are the same, an interval may reach beyond 1 %.
    EXPECT_TRUE(
        std::regex_search(read("out"), std::regex("tier 2, expected counts: (4 same|1 undecided, 3 same|2 undecided, 2 same)\n")))
        << seed << ": " << read("out");
  }
}

TEST_F(GateCli, BaselinesAreMadeFoundAndRefreshed) {
  std::filesystem::create_directory(folder_ / "baseline");
  EXPECT_EQ(gate("baseline old.json"), 5);
  EXPECT_NE(read("err").find("no baseline of configuration c"), std::string::npos) << read("err");
  EXPECT_NE(read("err").find("--update makes one"), std::string::npos) << read("err");
  ASSERT_EQ(gate("baseline old.json --update"), 0) << read("err");
  EXPECT_EQ(gate("baseline old.json"), 0) << read("err");
  const auto files = [&] { return std::distance(std::filesystem::directory_iterator(folder_ / "baseline"), {}); };
  EXPECT_EQ(files(), 1);
  const std::filesystem::path file = std::filesystem::directory_iterator(folder_ / "baseline")->path();
  const std::string first = read_file(file.string());
  EXPECT_EQ(std::count(first.begin(), first.end(), '\n'), 10) << "one cell a line:\n" << first;
  EXPECT_EQ(baseline_text(read_counts(file.string())), first);

  ASSERT_EQ(run("run c.json -o loose.json", NULLMARK_LOOSE_PROGRAM), 0);
  EXPECT_EQ(gate("baseline loose.json"), 4);
  EXPECT_EQ(read_file(file.string()), first);
  EXPECT_EQ(gate("baseline loose.json --update"), 0) << "an intended change edits the baseline";
  EXPECT_NE(read("out").find("REGRESSION"), std::string::npos) << "but is shown";
  EXPECT_EQ(gate("baseline loose.json"), 0);
  EXPECT_EQ(gate("baseline old.json"), 0) << "fewer lookups are no regression";
  EXPECT_NE(read("out").find("better"), std::string::npos) << read("out");

  write("c.json", config(128));
  ASSERT_EQ(run("run c.json -o new.json"), 0);
  EXPECT_EQ(gate("baseline new.json"), 5);
  EXPECT_NE(read("err").find("the configuration has changed since"), std::string::npos) << read("err");
  EXPECT_EQ(gate("baseline new.json --update"), 0);
  EXPECT_EQ(files(), 1) << "a changed configuration keeps its file";
  ASSERT_EQ(run("run c.json -o part.json --filter ^ratio"), 0);
  EXPECT_EQ(gate("baseline part.json --update"), 2);
  EXPECT_NE(read("err").find("run the whole configuration"), std::string::npos) << read("err");
}

TEST_F(GateCli, BadInputIsOneLineAndCodeTwo) {
  const std::string whole = read("old.json");
  write("truncated.json", whole.substr(0, whole.size() / 2));
  write("foreign.json", R"({"benchmarks": []})");
  write("future.json", R"({"nullmark_baseline": 99})");
  write("baseline.json", R"({"nullmark_baseline": 1, "name": "c", "config_hash": "", "build": {}, "cells": []})");
  std::filesystem::create_directory(folder_ / "blocks");
  std::filesystem::create_directory(folder_ / "bad");
  write("bad/broken.json", "{");
  for (const char* arguments :
       {"old.json", "nowhere.json old.json", "old.json nowhere.json", "old.json truncated.json", "truncated.json old.json",
        "foreign.json old.json", "old.json foreign.json", "future.json old.json", "baseline.json old.json", "bad old.json",
        "old.json old.json --threshold -1", "old.json old.json --threshold much", "old.json old.json --blocks blocks",
        "old.json old.json --blocks nowhere", "old.json old.json --quiet-machine", "old.json old.json --update",
        "old.json old.json --junit nowhere/gate.xml"}) {
    EXPECT_EQ(gate(arguments), 2) << arguments;
    const std::string error = read("err");
    EXPECT_EQ(error.rfind("nullmark: ", 0), 0u) << arguments << ": " << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << arguments << ": " << error;
    EXPECT_EQ(read("out"), "") << arguments;
  }
  EXPECT_EQ(read("old.json"), whole);
}

TEST_F(GateCli, BlocksThatAreIncompleteAreRefusedAndWallTimeIsAdvisory) {
  std::filesystem::create_directory(folder_ / "blocks");
  write("timed.json", R"({"nullmark":"config/2","timing":{"repetitions":1,"seconds":1e-6},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":1000,"matrix":{"estimator":["ratio"],"medium":["linear"]}}]})");
  ASSERT_EQ(run("run timed.json -o timed.results.json"), 0);
  RunRecord timed = read_results(read("timed.results.json"), "timed");
  TimeRecord& time = *timed.cells.at(0).time;
  for (int block = 1; block <= 10; ++block)
    for (const char* side : {"old", "new", "control"})
      for (int turn : {1, 2}) {
        const Real jitter = 1 + 0.001 * ((block + turn) % 3);
        time.ns_per_sample = 100 * jitter * (std::string(side) == "new" ? 1.2 : 1);
        time.ns_per_lookup = time.floor_ratio = 1;
        write(fmt::format("blocks/{:02}.{}.{}.json", block, side, turn), results_text(timed));
      }
  const std::string sides = "blocks/01.old.1.json blocks/01.new.1.json --blocks blocks";
  EXPECT_EQ(gate(sides), 0) << read("err");
  EXPECT_NE(read("out").find("slower (advisory)"), std::string::npos) << read("out");
  EXPECT_EQ(gate(sides + " --quiet-machine"), 4) << read("out");
  std::filesystem::remove(folder_ / "blocks/07.control.2.json");
  EXPECT_EQ(gate(sides), 2);
  EXPECT_NE(read("err").find("block 07 has no 07.control.2.json"), std::string::npos) << read("err");
}

}  // namespace
}  // namespace nullmark
