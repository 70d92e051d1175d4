#include "harness/io/claims_json.h"

#include <gtest/gtest.h>

#include "harness/io/results_json.h"
#include "harness/testing/record_examples.h"

namespace nullmark {
namespace {

std::string config(const std::string& claims) {
  return R"({"nullmark":"config/2","name":"t","experiments":[
    {"name":"e","rays":"single","samples_per_ray":10,
     "matrix":{"estimator":["ratio","delta",{"type":"residual_ratio","control":["minimum","average"],"rate_scale":[1,2]}],
               "medium":["linear","cosine"]}},
    {"name":"f","rays":"single","samples_per_ray":10,"matrix":{"estimator":["ratio","delta"],"medium":"linear"}},
    {"name":"unjudged","rays":"single","samples_per_ray":10,"verdict":{"enabled":false},"estimator":"ratio","include":[{"medium":"linear"}]}],
    "claims":[)" +
         claims + "]}";
}

std::string claim(const std::string& part) { return R"({"id":"C","source":"S","claim":"T","parts":[)" + part + "]}"; }

ClaimPart part_of(const std::string& part) { return read_config(config(claim(part)), "t.json").claims[0].parts[0]; }

std::string error_of(const std::string& claims) {
  try {
    read_config(config(claims), "t.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

using Names = std::vector<std::string>;

TEST(Claims, PatternsFindCellsAndTheirCounterparts) {
  const ClaimPart part =
      part_of(R"({"metric":"variance","cells":{"experiment":"e","estimator":"ratio"},"at_most":{"estimator":"delta"}})");
  EXPECT_EQ(part.cells, (Names{"e/ratio/linear/global", "e/ratio/cosine/global"}));
  EXPECT_EQ(part.others, (Names{"e/delta/linear/global", "e/delta/cosine/global"}));
  EXPECT_EQ(part.relation, Relation::at_most);
}

TEST(Claims, OfSeveralCounterpartsTheOneThatIsAlikeIsMeant) {
  const ClaimPart part = part_of(
      R"({"metric":"variance","cells":{"experiment":"e","medium":"linear","estimator":{"type":"residual_ratio","control":"minimum"}},)"
      R"("at_least":{"estimator":{"type":"residual_ratio","control":"average"}}})");
  ASSERT_EQ(part.cells.size(), 2u);
  EXPECT_EQ(part.others, (Names{"e/residual_ratio/control:average/linear/global",
                                "e/residual_ratio/control:average/rate_scale:2/linear/global"}));
}

TEST(Claims, OfAnotherExperimentByItsName) {
  const ClaimPart part = part_of(
      R"({"metric":"mean","cells":{"experiment":"f","estimator":"ratio"},"near":{"experiment":"e","estimator":"ratio"},"tolerance":0.1})");
  EXPECT_EQ(part.others, (Names{"e/ratio/linear/global"}));
  EXPECT_EQ(part.tolerance, 0.1);
}

TEST(Claims, WhatIsWrongIsNamedWithItsPlace) {
  const std::string cells = R"("cells":{"experiment":"e","estimator":"ratio"})";
  const auto error = [&](const std::string& rest) { return error_of(claim("{" + cells + rest + "}")); };
  const auto says = [&](const std::string& rest, const std::string& words) {
    EXPECT_NE(error(rest).find(words), std::string::npos) << error(rest);
    EXPECT_EQ(error(rest).find("t.json: /claims/0/parts/0"), 0u) << error(rest);
  };
  says(R"(,"metric":"variance")", "exactly one of \"near\", \"at_most\", \"at_least\" and \"unbiased\"");
  says(R"(,"metric":"variance","at_most":1,"at_least":1)", "exactly one of");
  says(R"(,"metric":"varience","at_most":1)", "did you mean \"variance\"?");
  says(R"(,"metric":"ns_per_sample","at_most":1)", "\"ns_per_sample\" has no standard error");
  says(R"(,"metric":"variance","at_most":"thoery")", "found \"thoery\"; expected a number, one for each cell, \"theory\" or");
  says(R"(,"metric":"variance","near":1)", "\"tolerance\" beside \"near\"");
  says(R"(,"metric":"variance","at_most":1,"tolerance":1)", "\"tolerance\" beside \"near\"");
  says(R"(,"metric":"variance","at_most":[1,2,3])", "found 3 to compare with; expected 2");
  says(R"(,"metric":"variance","at_most":{"estimator":["delta","residual_ratio"]})", "expected a pattern that tells them apart");
  says(R"(,"metric":"variance","at_most":{"estimator":"weighted_delta"})", "no cell has this \"estimator\"");
  says(R"(,"metric":"variance","at_most":{"estimator":"delta","precision":"float"})", "no cell has this \"precision\"");
  says(R"(,"metric":"variance","at_most":{"experiment":"unjudged"})", "finds no counterpart of");
  says(R"(,"metric":"variance","at_most":{"estimator":"ratio"})", "would be compared with itself");
  says(R"(,"unbiased":true,"metric":"mean")", "does not apply");
  // A slope has no theory and no counterpart; there would be no number to compare it with.
  const auto slope = [&](const std::string& experiment, const std::string& against) {
    return error_of(claim(R"({"metric":"mean","cells":{"experiment":")" + experiment +
                          R"("},"slope_against":"samples_per_ray","at_most":)" + against + "}"));
  };
  EXPECT_EQ(slope("e", "1"), "no error");
  EXPECT_NE(slope("e", "\"theory\"").find("expected a number"), std::string::npos);
  EXPECT_NE(slope("e", R"({"estimator":"delta"})").find("expected a number"), std::string::npos);
  EXPECT_NE(slope("f", "1").find("matches 2 cells; expected three or more"), std::string::npos);
  says(R"(,"unbiased":false)", "expected true");
  EXPECT_NE(
      error_of(claim(R"({"cells":{"experiment":"unjudged"},"unbiased":true})")).find("expected its \"verdict\" to be enabled"),
      std::string::npos);
  EXPECT_NE(error_of(claim(R"({"metric":"mean","cells":{"experiment":"f","medium":"cosine"},"at_most":1})"))
                .find("no cell has this \"medium\""),
            std::string::npos);
  EXPECT_NE(error_of(claim(R"({"metric":"mean","cells":{"experiment":"g"},"at_most":1})")).find("unknown experiment"),
            std::string::npos);
  EXPECT_NE(error_of(claim(R"({"metric":"mean","cells":{"estimator":"weighted_delta"},"at_most":1})")).find("matches no cell"),
            std::string::npos);
  const std::string good = claim("{" + cells + R"(,"metric":"mean","at_most":1})");
  EXPECT_NE(error_of(good + "," + good).find("is the id of an earlier claim"), std::string::npos);
  EXPECT_EQ(error_of(R"({"required":1,)" + good.substr(1)), "t.json: /claims/0/required: found 1; expected true or false");
}

TEST(Claims, OfTwoFilesMayNotShareAnId) {
  const std::string good = config(claim(R"({"cells":{"experiment":"e","estimator":"ratio"},"metric":"mean","at_most":1})"));
  std::string other = good;
  other.replace(other.find("\"name\":\"t\""), 10, "\"name\":\"u\"");
  EXPECT_THROW(read_configs({{good, "t.json"}, {other, "u.json"}}), InputError);
}

/// The applied configuration, and results, name every cell, and read back to the same claims.
TEST(Claims, ComeBackFromTheAppliedConfigurationAndFromResults) {
  const Plan plan = example_plan();
  ASSERT_EQ(plan.claims[0].parts.size(), 5u);
  EXPECT_FALSE(plan.claims[0].required);
  EXPECT_TRUE(plan.claims[1].required);
  const Json written = claims_json(plan.claims);
  EXPECT_EQ(claims_json(read_config(plan.config_text, "applied.json").claims), written);
  EXPECT_EQ(claims_json(read_results(results_text(example_results(plan)), "r.json").claims), written);
}

}  // namespace
}  // namespace nullmark
