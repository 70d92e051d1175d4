// `nullmark check` as a command, on results that the program has just made, some of them altered.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>

#include "estimators/planted/scenes.h"
#include "harness/io/text.h"
#include "harness/io/verdict_json.h"
#include "harness/report/junit.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

class Check : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    // All kinds of tests: channels, groups of rays, lookups, cells without variance.
    write("c.json", config(R"("rays":{"type":"orthographic","width":4,"height":4},"samples_per_ray":2000,
        "verdict":{"epsilon":0.1,"max_samples_per_ray":16000},
        "matrix":{"estimator":["ratio","delta","next_flight_ratio","regular"],
                  "medium":["linear",{"type":"homogeneous","extinction":0.5,"spectrum":[1,2,4]}],
                  "majorant":[{"type":"global","looseness":1.5}]})"));
  }

  static std::string config(const std::string& experiment) {
    return fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e",{}}}]}})", experiment);
  }
};

TEST_F(Check, PassesWhatPassed) {
  ASSERT_EQ(run("run c.json -o r.json"), 0) << read("err");
  EXPECT_EQ(run("check r.json --junit j.xml --markdown m.md"), 0) << read("out");
  EXPECT_NE(read("out").find("8 PASS, 0 FAIL"), std::string::npos) << read("out");
  EXPECT_NE(read("j.xml").find(R"(tests="8" failures="0" errors="0" skipped="0")"), std::string::npos);
  EXPECT_EQ(run("check nowhere.json"), 2);
}

TEST_F(Check, BelievesFiguresNotVerdicts) {
  ASSERT_EQ(run("run c.json -o r.json"), 0) << read("err");
  const Json whole = Json::parse(read("r.json"));
  const auto altered = [&](auto change) {
    Json json = whole;
    change(json["cells"][0]["verdict"]);
    write("t.json", json.dump());
    return run("check t.json");
  };
  EXPECT_EQ(altered([](Json&) {}), 0) << read("out");
  EXPECT_EQ(altered([](Json& verdict) { verdict["tests"][0]["log_e"]["low"] = 1; }), 1);
  EXPECT_NE(read("out").find("1 verdicts in the file are not what its figures say"), std::string::npos) << read("out");
  EXPECT_EQ(altered([](Json& verdict) { verdict["tests"][0]["groups"]["log_e_high"][5] = nullptr; }), 1);
  EXPECT_EQ(altered([](Json& verdict) { verdict["tests"][0]["log_e"]["fail"] = 1000; }), 3);
  EXPECT_EQ(altered([](Json& verdict) { verdict["tests"][0]["groups"]["log_e_fail"][15] = 1000; }), 3);
  EXPECT_EQ(altered([](Json& verdict) { verdict["unbiased"] = "INCONCLUSIVE"; }), 1);
  EXPECT_EQ(altered([](Json& verdict) { verdict["unbiased"] = "GREEN"; }), 2);
  EXPECT_EQ(altered([](Json& verdict) { verdict["out_of_range"] = 1; }), 3);
}

TEST_F(Check, FailsABiasedEstimatorWithWhatRepeatsIt) {
  for (const std::string_view name : {"planted_terminal_term", "planted_channel_swap"}) {
    const PlantedScene& scene = *std::find_if(std::begin(kPlantedScenes), std::end(kPlantedScenes),
                                              [&](const PlantedScene& planted) { return planted.name == name; });
    write("p.json",
          config(fmt::format(
              R"("samples_per_ray":4000,"matrix":{{"estimator":[{},"ratio"],"medium":[{}],"majorant":[{}],"rays":[{}]}})",
              scene.estimator, scene.medium, scene.majorant, scene.rays)));
    ASSERT_EQ(run("run p.json -o r.json --force", NULLMARK_PLANTED_PROGRAM), 0) << read("err");
    EXPECT_EQ(run("check r.json --junit j.xml --markdown m.md"), 3) << read("out");
    const std::string cell = results("r.json").cells.at(0).cell.name;
    EXPECT_NE(read("out").find("FAIL: " + cell), std::string::npos) << read("out");
    EXPECT_NE(read("j.xml").find("; biased beyond epsilon, proven (log E "), std::string::npos) << read("j.xml");
    EXPECT_NE(read("m.md").find("| FAIL | " + cell), std::string::npos) << read("m.md");
    const std::string command = reproduction(results("r.json").cells[0], "r.json");
    EXPECT_NE(read("m.md").find(markdown_code(command)), std::string::npos) << command << read("m.md");
    // The command's second half, on the configuration that the file holds.
    write("again.json", Json::parse(read("r.json"))["config"].dump());
    const std::string filter = command.substr(command.find("--filter"));
    ASSERT_EQ(run("run again.json -o again.results.json --force " + filter, NULLMARK_PLANTED_PROGRAM), 0) << read("err");
    const RunRecord again = results("again.results.json");
    ASSERT_EQ(again.cells.size(), 1u);
    EXPECT_EQ(verdict_json(*again.cells[0].verdict), verdict_json(*results("r.json").cells[0].verdict));
  }
}

TEST_F(Check, OnlyOpenVerdictsAreNoSuccess) {
  write(
      "o.json",
      config(
          R"("rays":"single","samples_per_ray":100,"matrix":{"estimator":["delta"],"medium":["linear"]},"verdict":{"epsilon":0.001})"));
  ASSERT_EQ(run("run o.json -o r.json"), 0) << read("err");
  EXPECT_EQ(run("check r.json --junit j.xml"), 77) << read("out");
  EXPECT_NE(read("j.xml").find("<skipped message=\"INCONCLUSIVE (as planned, by laws): not decidable at 100 samples a ray; a "
                               "PASS at epsilon 0.001 needs"),
            std::string::npos)
      << read("j.xml");
  EXPECT_NE(read("out").find("INCONCLUSIVE (as planned, by laws)"), std::string::npos) << read("out");
  EXPECT_NE(read("out").find(" samples a ray: raise \"max_samples_per_ray\""), std::string::npos) << read("out");
}

/// A larger pilot decides what no number of samples after it does.
TEST_F(Check, APilotThatIsNotTrustedIsNoHighVariance) {
  write("p.json", config(R"("rays":"single","quantity":"radiance","samples_per_ray":64,
      "transport":{"environment":1,"roulette_from":1},"verdict":{"epsilon":0.02},"matrix":{"estimator":["hero_wavelength"],
      "medium":[{"type":"linear","spectrum":[0.5,1,2],"albedo":1}]})"));
  ASSERT_EQ(run("run p.json -o r.json"), 0) << read("err");
  EXPECT_EQ(run("check r.json --all"), 77) << read("out");
  EXPECT_NE(read("out").find("a pilot's is not to be trusted"), std::string::npos) << read("out");
  EXPECT_NE(read("out").find("INCONCLUSIVE as planned whatever \"max_samples_per_ray\" is"), std::string::npos) << read("out");
  EXPECT_EQ(read("out").find("the variance is too high"), std::string::npos) << read("out");
}

TEST_F(Check, NoOneIsToldToDrawMoreThanAnyRunCan) {
  write("d.json", config(R"("rays":"single","samples_per_ray":100,"matrix":{"estimator":["delta"],
      "medium":[{"type":"homogeneous","extinction":[2,40]}]})"));
  ASSERT_EQ(run("run d.json -o r.json"), 0) << read("err");
  EXPECT_EQ(run("check r.json"), 77) << read("out");
  EXPECT_NE(
      read("out").find("1 cell that is INCONCLUSIVE as planned needs more than 1e+09 samples a ray: the variance is too high "
                       "for this epsilon"),
      std::string::npos)
      << read("out");
  const std::string wanted = "cells that are INCONCLUSIVE as planned need up to ";
  const std::size_t at = read("out").find(wanted);
  ASSERT_NE(at, std::string::npos) << read("out");
  EXPECT_LT(std::stoull(read("out").substr(at + wanted.size())), 1'000'000'000u) << read("out");
}

TEST_F(Check, NothingJudgedIsNoSuccess) {
  write(
      "n.json",
      config(
          R"("rays":"single","samples_per_ray":100,"matrix":{"estimator":["ratio"],"medium":["linear"]},"verdict":{"enabled":false})"));
  ASSERT_EQ(run("run n.json -o r.json"), 0) << read("err");
  EXPECT_EQ(run("check r.json"), 5) << read("out");
}

TEST_F(Check, AMarchIsJudgedByItsOwnMeanAlone) {
  write("m.json", config(R"("rays":"single","samples_per_ray":4000,
      "matrix":{"estimator":[{"type":"ray_marching","offset":["left","midpoint","uniform"],"steps":[16,32,64,128]}],
                "medium":[{"type":"exponential","optical_depth":0.5}]})"));
  ASSERT_EQ(run("run m.json -o r.json"), 0) << read("err");
  const Json results = Json::parse(read("r.json"));
  for (const Json& cell : results["cells"]) {
    EXPECT_TRUE(cell["verdict"]["unbiased"].is_null()) << cell;
    EXPECT_EQ(cell["verdict"]["own_mean"], "PASS") << cell["verdict"];
  }
  EXPECT_EQ(run("check r.json"), 0) << read("out");
  for (const char* order : {"offset:left/exponential/optical_depth:0.5/transmittance/single: claimed order 1, measured 1.0",
                            "offset:midpoint/exponential/optical_depth:0.5/transmittance/single: claimed order 2, measured 2.0"})
    EXPECT_NE(read("out").find(order), std::string::npos) << read("out");
  Json json = Json::parse(read("r.json"));
  json["cells"][0]["verdict"]["unbiased"] = "PASS";
  write("t.json", json.dump());
  EXPECT_EQ(run("check t.json"), 1) << read("out");
}

TEST_F(Check, ShardsHaveTheVerdictsOfTheWhole) {
  ASSERT_EQ(run("run c.json -o whole.json --threads 1"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o a.json --shard 1/2 --threads 2"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o b.json --shard 2/2"), 0) << read("err");
  ASSERT_EQ(run("merge a.json b.json -o merged.json"), 0) << read("err");
  const Json whole = Json::parse(read("whole.json")), merged = Json::parse(read("merged.json"));
  ASSERT_EQ(merged["cells"].size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(merged["cells"][i]["verdict"], whole["cells"][i]["verdict"]);
  ASSERT_EQ(run("check whole.json"), 0);
  const std::string expected = read("out");
  EXPECT_EQ(run("check merged.json"), 0);
  EXPECT_EQ(read("out"), expected);
}

}  // namespace
}  // namespace nullmark
