// The sweep sees who takes every ray for one of length 1.

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "harness/config/config.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

bool fails(const VerdictRecord& verdict) {
  return verdict.unbiased == Outcome::fail || verdict.lookups == Outcome::fail || verdict.lawful == Outcome::fail;
}

/// Wherever the sweep crosses a procedural medium by ratio tracking, a ratio tracker that forgets the length fails.
TEST(Lengths, TheSweepFailsWhoForgetsThem) {
  Plan plan = read_configs(load_configs({NULLMARK_SOURCE_DIR "/configs/unbiasedness.json"}));
  std::set<std::pair<std::size_t, std::size_t>> taken;  // medium and rays, each with its tightest majorant
  std::vector<bool> wanted;
  for (Cell& cell : plan.cells) {
    const bool ratio = cell.estimator->type == "ratio" && plan.media[cell.medium]->field.type != "vdb";
    wanted.push_back(ratio && taken.insert({cell.medium, cell.rays}).second);
    if (wanted.back()) cell.estimator = Component{"planted_unit_length", {}, "planted_unit_length", ""};
  }
  std::size_t judged = 0;
  for (const CellRecord& record : run_untimed(plan, wanted)) {
    ASSERT_EQ(record.status, Status::ok) << record.reason;
    ASSERT_TRUE(record.verdict) << record.cell.name;
    EXPECT_TRUE(fails(*record.verdict)) << record.cell.name << ": " << record.verdict->reason;
    ++judged;
  }
  EXPECT_GE(judged, 80u);
}

}  // namespace
}  // namespace nullmark
