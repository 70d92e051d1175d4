#include "harness/run/merge.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/io/json_input.h"
#include "harness/io/results_json.h"
#include "harness/testing/record_examples.h"

namespace nullmark {
namespace {

RunRecord part_of(const RunRecord& run, const std::vector<std::size_t>& places) {
  RunRecord part = run;
  part.cells.clear();
  for (const std::size_t place : places) part.cells.push_back(run.cells[place]);
  return part;
}

std::string error_of(const std::vector<RunRecord>& parts) {
  try {
    merge_results(parts, {"a.json", "b.json"});
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Merge, JoinsShardsInThePlansOrder) {
  const RunRecord run = example_results();
  const RunRecord merged = merge_results({part_of(run, {3, 1}), part_of(run, {2, 0})}, {"a.json", "b.json"});
  EXPECT_EQ(statistics_text(merged), statistics_text(run));
  EXPECT_EQ(merged.config_text, run.config_text);
  EXPECT_EQ(Json::parse(merged.provenance.at("parts")).size(), 2u);
  EXPECT_EQ(read_results(results_text(merged), "m.json").cells.size(), 4u);
}

TEST(Merge, SampledCellsTakeThePlaceOfOthers) {
  const RunRecord run = example_results();
  RunRecord stopped = run;
  stopped.cells[2] = unsampled(run.cells[2], Status::not_run, "interrupted");
  for (const auto& parts : {std::vector{stopped, part_of(run, {2})}, std::vector{part_of(run, {2}), stopped}})
    EXPECT_EQ(statistics_text(merge_results(parts, {"a.json", "b.json"})), statistics_text(run));
}

TEST(Merge, DuplicatesMustAgreeToTheLastBit) {
  const RunRecord run = example_results();
  RunRecord other = part_of(run, {1});
  other.cells[0].time->ns_per_sample += 1;
  EXPECT_EQ(error_of({run, other}), "no error");
  other.cells[0].channel[2].variance = std::nextafter(*other.cells[0].channel[2].variance, 10);
  EXPECT_EQ(error_of({run, other}), "b.json: cell \"" + run.cells[1].cell.name +
                                        "\" has other statistics than in a.json; expected the same to the last bit");
}

TEST(Merge, RefusesAnotherConfiguration) {
  const RunRecord run = example_results();
  RunRecord other = run;
  other.config_text = "{}";
  EXPECT_EQ(error_of({run, other}).find("b.json: /config/"), 0u) << error_of({run, other});
}

TEST(Merge, NamesWhatDiffersInAnotherConfiguration) {
  RunRecord run = example_results(), other = run;
  const auto refusal = [&](const char* mine, const char* others) {
    run.config_text = mine;
    other.config_text = others;
    return error_of({run, other});
  };
  const std::string expected = " in a.json; expected results of one configuration and seed";
  EXPECT_EQ(refusal(R"({"seed":1})", R"({"seed":2})"), "b.json: /config/seed: found 2, and 1" + expected);
  EXPECT_EQ(refusal(R"({"experiments":[{"include":[{"samples_per_ray":64}]}]})",
                    R"({"experiments":[{"include":[{"samples_per_ray":128}]}]})"),
            "b.json: /config/experiments/0/include/0/samples_per_ray: found 128, and 64" + expected);
  EXPECT_EQ(refusal(R"({"a":1,"b":"x"})", R"({"a":1})"), "b.json: /config/b: found nothing, and \"x\"" + expected);
}

TEST(Merge, KeepsTheProvenanceOfResultsThatWereMergedBefore) {
  const RunRecord run = example_results();
  std::vector<RunRecord> parts;
  for (std::size_t i = 0; i < 3; ++i) {
    parts.push_back(part_of(run, {i}));
    parts[i].provenance["command_line"] = fmt::format(R"(["nullmark","run","c.json","--shard","{}/3"])", i + 1);
  }
  const RunRecord two = merge_results({parts[0], parts[1]}, {"a.json", "b.json"});
  const Json told = Json::parse(merge_results({two, parts[2]}, {"ab.json", "c.json"}).provenance.at("parts"));
  ASSERT_EQ(told.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(told[i]["command_line"][4], fmt::format("{}/3", i + 1));
    EXPECT_FALSE(told[i].contains("parts"));
  }
}

}  // namespace
}  // namespace nullmark
