#include "harness/run/merge.h"

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
  EXPECT_EQ(error_of({run, other}).substr(0, 42), "b.json: /config: found the configuration 0");
}

}  // namespace
}  // namespace nullmark
