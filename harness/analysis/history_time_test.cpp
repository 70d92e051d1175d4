// What a history says of times: nothing of single runs, and of runs that took turns what the performance gate says.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "harness/analysis/history.h"
#include "harness/io/json_input.h"
#include "harness/testing/verdict_examples.h"

namespace nullmark {
namespace {

RunRecord timed(const char* start, const char* commit, Real ns = 100) {
  RunRecord run = run_of({passed(), passed(), passed()});
  run.name = "c";
  run.provenance = {{"start", Json(start).dump()},
                    {"git", fmt::format(R"({{"commit":"{}","dirty":false,"changes":""}})", commit)},
                    {"compiler", R"({"name":"gcc 12.2.0","flags":"-O3"})"},
                    {"target", R"({"march":"x86-64-v3","simd":"AVX2"})"},
                    {"libc", R"("glibc 2.36")"},
                    {"cpu", R"({"model":"one"})"}};
  for (CellRecord& record : run.cells) {
    record.time->ns_per_sample = ns;
    record.time->ns_per_lookup = ns / 10;
    record.time->floor_ratio = ns / 40;
  }
  return run;
}

HistoryStep compared(RunRecord before, RunRecord after, const std::vector<TimedBlock>& blocks = {}) {
  return history_of({std::move(before), std::move(after)}, {"old.json", "new.json"}, blocks).steps.at(0);
}

RunRecord before() { return timed("2026-11-20T08:00:00Z", "aaaaaaaa"); }
RunRecord after() { return timed("2026-11-26T08:00:00Z", "bbbbbbbb"); }

/// Blocks of the two programs, whose second cell takes `factor` times the time in the new one; noise of 2 %.
std::vector<TimedBlock> blocks_of(Real factor, Real control = 1) {
  std::mt19937_64 random(3);
  const auto run = [&](const RunRecord& of, Real second) {
    RunRecord record = of;
    for (std::size_t i = 0; i < record.cells.size(); ++i)
      record.cells[i].time->ns_per_sample *= std::exp(std::normal_distribution<Real>(0, 0.02)(random)) * (i == 1 ? second : 1);
    // The step lower bound is that of the first cell.
    record.cells[0].time->ns_per_lookup = 10;
    record.cells[0].time->floor_ratio = 2.5;
    return record;
  };
  std::vector<TimedBlock> blocks;
  for (int b = 0; b < 12; ++b) {
    TimedBlock block;
    for (std::size_t i = 0; i < 2; ++i) {
      block.before[i] = run(before(), 1);
      block.control[i] = run(before(), control);
      block.after[i] = run(after(), factor);
    }
    blocks.push_back(block);
  }
  return blocks;
}

TEST(HistoryTime, SingleRunsHaveNoVerdict) {
  const HistoryStep step = compared(before(), timed("2026-11-26T08:00:00Z", "bbbbbbbb", 300));
  EXPECT_EQ(step.changed, 0u);
  EXPECT_NE(step.time.find("between single runs the machine changes as much"), std::string::npos) << step.time;
}

TEST(HistoryTime, SaysWhyThereIsNoVerdict) {
  RunRecord other = after();
  other.provenance["cpu"] = R"({"model":"two"})";
  EXPECT_EQ(compared(before(), other).time, "times have no verdict: measured on another CPU, one and then two");
  other = after();
  other.provenance["compiler"] = R"({"name":"clang 14.0.0","flags":"-O3"})";
  EXPECT_EQ(compared(before(), other).time.find("times have no verdict: another build, gcc 12"), 0u);
  other = after();
  for (CellRecord& record : other.cells) record.time.reset();
  EXPECT_EQ(compared(before(), other).time, "times have no verdict: not both results were timed");
}

TEST(HistoryTime, FindsAPlantedSlowdownInRunsThatTookTurns) {
  EXPECT_EQ(changes_counted(compared(before(), after(), blocks_of(1.2))), "1 slower");
  EXPECT_EQ(changes_counted(compared(before(), after(), blocks_of(0.8))), "1 faster");
  EXPECT_EQ(changes_counted(compared(before(), after(), blocks_of(1))), "");
}

TEST(HistoryTime, ANoisyMachineGivesNoVerdict) {
  const HistoryStep step = compared(before(), after(), blocks_of(1.2, 1.3));
  EXPECT_EQ(step.changed, 0u);
  EXPECT_EQ(step.time.find("times have no verdict: the control, a program against itself, shows"), 0u) << step.time;
}

TEST(HistoryTime, RefusesBlocksOfOtherProgramsOrOfSeveralMachines) {
  EXPECT_THROW(compared(timed("2026-11-20T08:00:00Z", "cccccccc"), after(), blocks_of(1)), InputError);
  std::vector<TimedBlock> blocks = blocks_of(1);
  blocks[3].after[0].provenance["cpu"] = R"({"model":"two"})";
  EXPECT_THROW(compared(before(), after(), blocks), InputError);
}

}  // namespace
}  // namespace nullmark
