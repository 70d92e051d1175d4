// What comparisons of wall time find in blocks of made-up times.

#include "harness/performance_gate/wall_time.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace nullmark {
namespace {

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

}  // namespace
}  // namespace nullmark
