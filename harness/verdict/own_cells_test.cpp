// Verdicts of the program's own cells, none of which is biased.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "harness/config/config.h"
#include "harness/testing/run_untimed.h"
#include "harness/verdict/false_alarms_test.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

using namespace false_alarms_test;

constexpr std::uint64_t kSeeds = 250 / kThin;

/// Trackers, media and majorants under many seeds.
Plan unbiased_plan() {
  std::string list;
  for (std::uint64_t i = 1; i <= kSeeds; ++i) list += fmt::format("{}{}", i == 1 ? "" : ",", fresh_seed() * 1'000'000 + i);
  const auto experiment = [&](const char* name, const char* estimators, const char* media, const char* majorants) {
    return fmt::format(R"({{"name":"{}","rays":"single","samples_per_ray":2048,"own_streams":true,
        "verdict":{{"epsilon":0.1,"max_samples_per_ray":8192}},
        "matrix":{{"estimator":[{}],"medium":[{}],"majorant":[{}],"seed":[{}]}},"zip":[["medium","majorant"]]}})",
                       name, estimators, media, majorants, list);
  };
  const std::string bounded = experiment(
      "bounded",
      R"("delta","ratio","residual_delta","next_flight_ratio",{"type":"next_flight_delta","variant":["a","b"]},{"type":"residual_ratio","control":"average"})",
      R"({"type":"homogeneous","extinction":1},{"type":"linear","optical_depth":2},{"type":"exponential","optical_depth":5},
         {"type":"layers","optical_depth":1},{"type":"gaussian_bump","optical_depth":0.5})",
      R"({"type":"global","looseness":1.25},{"type":"global","looseness":1.5},{"type":"global","looseness":1.1},
         {"type":"grid","resolution":4},{"type":"global","looseness":3})");
  // Weights of any sign and heavy tails.
  const std::string unbounded =
      experiment("unbounded", R"("ratio","next_flight_ratio",{"type":"residual_ratio","control":"average"})",
                 R"({"type":"homogeneous","extinction":2},{"type":"cosine","optical_depth":1})",
                 R"({"type":"global","looseness":0.4},{"type":"global","looseness":0.5})");
  return read_config(
      fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"error_rates":{{"alpha":0.1}},"experiments":[{},{}]}})",
                  bounded, unbounded),
      "false_alarms.json");
}

/// Ten thousand cells of the program itself: no bias, so hardly a FAIL.  Streams are each cell's own, so that cells are
/// independent.
TEST(FalseAlarms, TheProgramsOwnCells) {
  const std::vector<CellRecord> records = run_untimed(unbiased_plan());

  constexpr Real kAlone = 1e-2;  // the level of a cell judged alone, at which alarms are frequent enough to be counted
  std::uint64_t cells = 0, fails = 0, passes = 0, means = 0, mean_alarms = 0, lookups = 0, lookup_alarms = 0;
  std::uint64_t lawful = 0, law_alarms = 0;  // cells whose walks were tested as well
  for (const CellRecord& record : records) {
    ASSERT_EQ(record.status, Status::ok) << record.cell.name << ": " << record.reason;
    if (!record.verdict) continue;
    const VerdictRecord& verdict = *record.verdict;
    ++cells;
    if (verdict.unbiased == Outcome::fail || verdict.lookups == Outcome::fail || verdict.lawful == Outcome::fail) {
      ++fails;
      std::printf("FAIL %s: %s\n", record.cell.name.c_str(), verdict.reason.c_str());
    }
    passes += verdict.unbiased == Outcome::pass;
    if (tests_walks(verdict)) {
      const Real needed = std::log(static_cast<Real>(verdict.laws.size()) / kAlone);
      ++lawful;
      law_alarms +=
          std::any_of(verdict.laws.begin(), verdict.laws.end(), [&](const LawRecord& law) { return law.log_e >= needed; });
    }
    for (const TestRecord& test : verdict.tests) {
      if (test.deterministic()) continue;
      const bool alarm = test.log_e_fail >= -std::log(kAlone);
      ++(test.channel < 0 ? lookups : means);
      (test.channel < 0 ? lookup_alarms : mean_alarms) += alarm;
    }
  }
  std::printf("%llu cells, %llu PASS\n", static_cast<unsigned long long>(cells), static_cast<unsigned long long>(passes));
  EXPECT_GE(cells, 40 * kSeeds);
  EXPECT_GT(passes, cells / 4);
  // Means, lookups and laws are a family each, at .1.
  expect_not_above("cells with a false FAIL", cells, fails, 0.3 / static_cast<Real>(cells));
  expect_not_above("means judged alone, level 1e-2", means, mean_alarms, kAlone);
  expect_not_above("lookups judged alone, level 1e-2", lookups, lookup_alarms, kAlone);
  expect_not_above("cells' laws judged alone, level 1e-2", lawful, law_alarms, kAlone);
  RecordProperty("cells", static_cast<int>(cells));
  RecordProperty("false_fail", static_cast<int>(fails));
  RecordProperty("mean_alarms_alone", static_cast<int>(mean_alarms));
}

}  // namespace
}  // namespace nullmark
