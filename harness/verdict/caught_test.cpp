// Every planted bug is caught by the check it names, at a family-wise error of 1e-4, and no biased one ever passes.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "estimators/planted/scenes.h"
#include "harness/config/config.h"
#include "harness/io/verdict_json.h"
#include "harness/model/names.h"
#include "harness/registry/estimator_entry.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

/// All planted bugs, each on its scene, as one configuration: they share one family.
std::vector<CellRecord> run_all(std::uint64_t seed, const std::string& gate) {
  std::string cells;
  for (const PlantedScene& scene : kPlantedScenes)
    cells += fmt::format(
        R"({}{{"quantity":"{}","estimator":{},"medium":{},"majorant":{},"rays":{},"samples_per_ray":{},"verdict":{}}})",
        cells.empty() ? "" : ",", scene.quantity, scene.estimator, scene.medium, scene.majorant, scene.rays,
        scene.samples_per_ray, gate);
  const Plan plan =
      read_config(fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"error_rates":{{"alpha":1e-4}},
      "experiments":[{{"name":"planted","include":[{}]}}]}})",
                              cells),
                  "planted.json", seed);
  return run_untimed(plan);
}

/// Ten standard errors of a reliance.
constexpr Real kLeans = 0.05;

bool breaks(const VerdictRecord& verdict, std::string_view law) {
  return std::any_of(verdict.laws.begin(), verdict.laws.end(),
                     [&](const LawRecord& record) { return record.name == law && record.outcome == Outcome::fail; });
}

bool caught(const CellRecord& record, const std::string& by) {
  if (by == "nonfinite") return record.status == Status::error && record.nonfinite > 0;
  if (!record.verdict) return false;
  const VerdictRecord& verdict = *record.verdict;
  if (by == "mean") return verdict.unbiased == Outcome::fail;
  if (by == "open") return verdict.unbiased == Outcome::inconclusive && !verdict.planned_undecidable;
  if (by == "reliance") return record.given_depth && std::abs(record.reliance.value_or(0)) > kLeans;
  if (by == "lookups") return verdict.lookups == Outcome::fail;
  if (by == "count_law") return breaks(verdict, "count");
  if (by == "position_law") return breaks(verdict, "conditional") || breaks(verdict, "positions") || breaks(verdict, "first");
  if (by == "audit") return record.majorant_violations > 0 && verdict.unbiased == Outcome::fail;
  if (by == "groups")
    return std::any_of(verdict.tests.begin(), verdict.tests.end(),
                       [](const TestRecord& test) { return test.group >= 0 && test.outcome == Outcome::fail; }) &&
           std::none_of(verdict.tests.begin(), verdict.tests.end(), [](const TestRecord& test) {
             return test.channel == 0 && test.group < 0 && test.outcome == Outcome::fail;
           });
  return breaks(verdict, by);
}

std::string told(const CellRecord& record) {
  if (!record.verdict) return record.reason;
  std::string text = fmt::format("{} {}, lookups {}", to_string(record.verdict->unbiased), record.verdict->reason,
                                 to_string(record.verdict->lookups));
  for (const LawRecord& law : record.verdict->laws) text += fmt::format(", {} {:.1f}", law.name, law.log_e);
  return text;
}

TEST(Caught, EveryPlantedBugByTheCheckItNames) {
  const auto records = run_all(1, R"({"max_samples_per_ray":10000000,"laws":"always"})");
  for (const CellRecord& record : records) {
    const EstimatorEntry& bug = *Registry<EstimatorEntry>::instance().find(record.cell.estimator->type);
    EXPECT_TRUE(caught(record, bug.caught_by)) << bug.name << " by " << bug.caught_by << ": " << told(record);
    const std::uint64_t samples = record.verdict ? record.verdict->samples_per_ray * record.rays : record.samples;
    std::printf("%-30s caught by %-13s %llu samples\n", bug.name.c_str(), bug.caught_by.c_str(),
                static_cast<unsigned long long>(samples));
  }
  EXPECT_EQ(records.size(), std::size(kPlantedScenes));
}

/// At its default the bug shows once in a million samples: so many are drawn.
TEST(Caught, NanOnceInAMillion) {
  const Plan plan = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"nan",
      "rays":"single","samples_per_ray":30000000,"verdict":{"enabled":false},
      "matrix":{"estimator":"planted_nan","medium":{"type":"homogeneous","extinction":1}}}]})",
                                "nan.json");
  const CellRecord record = run_untimed(plan).at(0);
  EXPECT_EQ(record.status, Status::error);
  EXPECT_GT(record.nonfinite, 0u);
}

TEST(Caught, NoBiasedBugPassesAtAnyOfAHundredSeeds) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed)
    for (const CellRecord& record : run_all(seed, R"({"max_samples_per_ray":200000,"laws":"never"})")) {
      const auto scene = std::find_if(std::begin(kPlantedScenes), std::end(kPlantedScenes),
                                      [&](const PlantedScene& one) { return one.name == record.cell.estimator->type; });
      if (scene->relative_bias != 0) {
        EXPECT_TRUE(!record.verdict || record.verdict->unbiased != Outcome::pass) << record.cell.name << ", seed " << seed;
      }
    }
}

}  // namespace
}  // namespace nullmark
