// From verdicts to the results file and back.

#include "harness/io/verdict_json.h"

#include <gtest/gtest.h>

#include "harness/testing/verdict_examples.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

VerdictRecord read_back(const VerdictRecord& verdict) {
  const Json json = parse_json(verdict_json(verdict).dump(), "v.json");
  return read_verdict(JsonNode(json, "v.json"));
}

TEST(VerdictJson, ComesBackAndIsDecidedTheSame) {
  std::vector<TestRecord> grouped = {passing()};
  for (int g = 0; g < 16; ++g) {
    TestRecord group = g == 3 ? open_one() : passing();
    group.group = g;
    group.epsilon = 0.04;
    group.log_e_fail = -1.25 * g;
    group.reference_error = 1e-10 * (g + 1);
    grouped.push_back(group);
  }
  std::vector<TestRecord> mixed = grouped;
  mixed[5] = deterministic(2e-13);
  mixed[5].group = 4;
  mixed[5].epsilon = 0.04;
  mixed.push_back(passing(1));
  mixed.push_back(failing(-1));
  TestRecord off_a_bit = deterministic(2e-7);
  off_a_bit.log_e_fail = 3.5;
  TestRecord no_evidence = passing();
  no_evidence.log_e_low = -kInfinity;
  VerdictRecord violated = verdict_of({failing()});
  violated.violated = true;
  VerdictRecord own = verdict_of({passing()});
  own.against = "own mean";
  VerdictRecord broken = verdict_of({passing()});
  broken.nonfinite = 3;
  broken.out_of_range = 5;
  broken.family = 9007199254740993;
  for (VerdictRecord verdict :
       {verdict_of({passing()}), verdict_of({open_one(), passing(-1)}), verdict_of({failing()}), verdict_of({deterministic(0)}),
        verdict_of({off_a_bit}), verdict_of({deterministic(kInfinity)}), verdict_of(grouped), verdict_of(mixed),
        verdict_of({no_evidence}), violated, own, broken, verdict_of({})}) {
    decide(verdict);
    VerdictRecord back = read_back(verdict);
    EXPECT_EQ(verdict_json(back), verdict_json(verdict));
    ASSERT_EQ(back.tests.size(), verdict.tests.size());
    decide(back);
    EXPECT_EQ(verdict_json(back), verdict_json(verdict));
    for (std::size_t i = 0; i < back.tests.size(); ++i) {
      EXPECT_EQ(back.tests[i].outcome, verdict.tests[i].outcome) << i;
      EXPECT_EQ(back.tests[i].group, verdict.tests[i].group);
      EXPECT_EQ(back.tests[i].channel, verdict.tests[i].channel);
      EXPECT_EQ(back.tests[i].log_e_fail, verdict.tests[i].log_e_fail);
      EXPECT_EQ(back.tests[i].log_e_low, verdict.tests[i].log_e_low);
      EXPECT_EQ(back.tests[i].reference_error, verdict.tests[i].reference_error);
    }
  }
}

TEST(VerdictJson, RefusesWhatIsNoVerdict) {
  VerdictRecord verdict = verdict_of({passing(), passing()});
  verdict.tests[1].group = 0;
  const Json good = verdict_json(verdict);
  const auto refused = [](const Json& json) {
    try {
      read_verdict(JsonNode(json, "v.json"));
      return std::string();
    } catch (const InputError& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(refused(good), "");
  for (const auto& [key, value] : {std::pair<std::string, Json>{"unbiased", "FINE"},
                                   {"alpha", 0},
                                   {"alpha_pass", 1},
                                   {"family", 0},
                                   {"against", "nothing"},
                                   {"violated", 1}}) {
    Json bad = good;
    bad[key] = value;
    EXPECT_NE(refused(bad).find(key), std::string::npos) << key << ": " << refused(bad);
  }
  Json short_list = good;
  short_list["tests"][0]["groups"]["log_e_low"] = Json::array();
  EXPECT_NE(refused(short_list).find("log_e_low"), std::string::npos);
}

}  // namespace
}  // namespace nullmark
