// `nullmark gate` as a command: exit codes, baselines on the disk, bad input.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>

#include "harness/io/file_io.h"
#include "harness/io/results_json.h"
#include "harness/performance_gate/baseline.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

class GateCli : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c.json", config(64));
    ASSERT_EQ(run("run c.json -o old.json"), 0) << read("err");
  }

  static std::string config(int samples) {
    return fmt::format(R"({{"nullmark":"config/2","name":"c","timing":{{"enabled":false}},"experiments":[
      {{"name":"e","rays":{{"type":"orthographic","width":16,"height":16}},"samples_per_ray":{},"verdict":{{"enabled":false}},
       "matrix":{{"estimator":["ratio","delta"],"medium":[{{"type":"gaussian_bump","optical_depth":2}}]}}}}]}})",
                       samples);
  }

  int gate(const std::string& arguments) const { return run("gate --baseline " + arguments); }
};

TEST_F(GateCli, TheSameProgramIsNoRegression) {
  ASSERT_EQ(run("run c.json -o new.json --threads 1"), 0);
  EXPECT_EQ(gate("old.json new.json"), 0) << read("err");
  EXPECT_NE(read("out").find("tier 1, exact counts: 2 same"), std::string::npos) << read("out");
}

TEST_F(GateCli, ALooserMajorantOfTheSameNameIsARegression) {
  ASSERT_EQ(run("run c.json -o loose.json", NULLMARK_LOOSE_PROGRAM), 0);
  EXPECT_EQ(gate("old.json loose.json --junit gate.xml --markdown gate.md"), 4);
  const std::string text = read("out");
  EXPECT_NE(text.find("tier 1, exact counts: 4 REGRESSION"), std::string::npos) << text;
  EXPECT_NE(text.find("tier 2, expected counts: 4 REGRESSION"), std::string::npos) << text;
  EXPECT_NE(read("gate.xml").find("<failure"), std::string::npos);
  EXPECT_NE(read("gate.md").find("REGRESSION"), std::string::npos);
  EXPECT_EQ(gate("old.json loose.json --threshold 10"), 0);
  // Where the seed differs, expectations tell.
  ASSERT_EQ(run("run c.json -o seed.json --seed 9", NULLMARK_LOOSE_PROGRAM), 0);
  EXPECT_EQ(gate("old.json seed.json"), 4);
  EXPECT_NE(read("out").find("tier 2, expected counts: 4 REGRESSION"), std::string::npos) << read("out");
}

TEST_F(GateCli, FiftySeedsOfTheSameProgramAreNoRegression) {
  for (int seed = 101; seed <= 150; ++seed) {
    ASSERT_EQ(run(fmt::format("run c.json -o new.json --force --seed {}", seed)), 0);
    EXPECT_EQ(gate("old.json new.json"), 0) << seed << ": " << read("out");
    EXPECT_EQ(read("out").find("better"), std::string::npos) << seed << ": " << read("out");
    // All four are compared: the two expectations are the same, an interval may reach beyond 1 %.
    EXPECT_TRUE(
        std::regex_search(read("out"), std::regex("tier 2, expected counts: (4 same|1 undecided, 3 same|2 undecided, 2 same)\n")))
        << seed << ": " << read("out");
  }
}

/// Results as scripts/count-instructions leaves them, of made-up counts.
std::string counted(std::string text) {
  text = std::regex_replace(text, std::regex("\"rng_draws\":"), "\"instructions\":90000000,\"last_level_misses\":70000,$&");
  return std::regex_replace(text, std::regex("\n\"provenance\": \\{"), "$&\"start_up_instructions\":50000000,");
}

TEST_F(GateCli, WhatTheBaselineHoldsMustBeCompared) {
  write("counted.json", counted(read("old.json")));
  ASSERT_EQ(read_counts((folder_ / "counted.json").string()).start_up, 50'000'000u);
  std::filesystem::create_directory(folder_ / "baseline");
  ASSERT_EQ(gate("baseline counted.json --update"), 0) << read("err");
  EXPECT_EQ(gate("baseline counted.json"), 0) << read("out");
  EXPECT_NE(read("out").find("tier 5, cache misses: 2 same\ntier 6, start-up: 1 same\n"), std::string::npos) << read("out");

  EXPECT_EQ(gate("baseline old.json --junit gate.xml --markdown gate.md"), 5);
  EXPECT_EQ(read("out").find("no performance regression proven"), std::string::npos) << read("out");
  EXPECT_NE(read("gate.xml").find("errors=\"3\""), std::string::npos) << read("gate.xml");
  EXPECT_NE(read("gate.md").find("missing: instructions"), std::string::npos) << read("gate.md");
  EXPECT_EQ(gate("baseline old.json --require counts,expected"), 0) << read("out");
  EXPECT_EQ(gate("baseline counted.json --require counts,instructions,misses,start-up"), 0) << read("out");
  EXPECT_EQ(gate("baseline old.json --require counts,instructions"), 5);
  EXPECT_EQ(gate("old.json old.json --require instructions"), 5);
  ASSERT_EQ(run("run c.json -o part.json --filter ^ratio"), 0);
  EXPECT_EQ(gate("old.json part.json"), 0) << "cells that were not asked for are not missed: " << read("out");
}

TEST_F(GateCli, ABaselineIsThatOfEverySeed) {
  std::filesystem::create_directory(folder_ / "baseline");
  ASSERT_EQ(gate("baseline old.json --update"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o seed.json --seed 9"), 0);
  EXPECT_EQ(gate("baseline seed.json"), 0) << read("err");
  EXPECT_NE(read("out").find("other seed"), std::string::npos) << read("out");
  EXPECT_EQ(gate("baseline seed.json --require counts"), 5) << read("out");
}

TEST_F(GateCli, WithoutABaselineTheFilesSaySo) {
  std::filesystem::create_directory(folder_ / "baseline");
  EXPECT_EQ(gate("baseline old.json --junit gate.xml --markdown gate.md"), 5);
  EXPECT_NE(read("gate.xml").find("no baseline of configuration c"), std::string::npos) << read("gate.xml");
  EXPECT_NE(read("gate.md").find("nothing could be compared"), std::string::npos) << read("gate.md");
}

TEST_F(GateCli, BaselinesAreMadeFoundAndRefreshed) {
  std::filesystem::create_directory(folder_ / "baseline");
  EXPECT_EQ(gate("baseline old.json"), 5);
  EXPECT_NE(read("err").find("no baseline of configuration c"), std::string::npos) << read("err");
  EXPECT_NE(read("err").find("--update makes one"), std::string::npos) << read("err");
  ASSERT_EQ(gate("baseline old.json --update"), 0) << read("err");
  EXPECT_EQ(gate("baseline old.json"), 0) << read("err");
  const auto files = [&] { return std::distance(std::filesystem::directory_iterator(folder_ / "baseline"), {}); };
  EXPECT_EQ(files(), 1);
  const std::filesystem::path file = std::filesystem::directory_iterator(folder_ / "baseline")->path();
  const std::string first = read_file(file.string());
  EXPECT_EQ(std::count(first.begin(), first.end(), '\n'), 10) << "one cell a line:\n" << first;
  EXPECT_EQ(baseline_text(read_counts(file.string())), first);

  ASSERT_EQ(run("run c.json -o loose.json", NULLMARK_LOOSE_PROGRAM), 0);
  EXPECT_EQ(gate("baseline loose.json"), 4);
  EXPECT_EQ(read_file(file.string()), first);
  EXPECT_EQ(gate("baseline loose.json --update"), 0) << "an intended change edits the baseline";
  EXPECT_NE(read("out").find("REGRESSION"), std::string::npos) << "but is shown";
  EXPECT_EQ(gate("baseline loose.json"), 0);
  EXPECT_EQ(gate("baseline old.json"), 0) << "fewer lookups are no regression";
  EXPECT_NE(read("out").find("better"), std::string::npos) << read("out");

  write("c.json", config(128));
  ASSERT_EQ(run("run c.json -o new.json"), 0);
  EXPECT_EQ(gate("baseline new.json"), 5);
  EXPECT_NE(read("err").find("the configuration has changed since"), std::string::npos) << read("err");
  EXPECT_EQ(gate("baseline new.json --update"), 0);
  EXPECT_EQ(files(), 1) << "a changed configuration keeps its file";
  ASSERT_EQ(run("run c.json -o part.json --filter ^ratio"), 0);
  EXPECT_EQ(gate("baseline part.json --update"), 2);
  EXPECT_NE(read("err").find("run the whole configuration"), std::string::npos) << read("err");
}

TEST_F(GateCli, BadInputIsOneLineAndCodeTwo) {
  const std::string whole = read("old.json");
  write("truncated.json", whole.substr(0, whole.size() / 2));
  write("foreign.json", R"({"benchmarks": []})");
  write("future.json", R"({"nullmark_baseline": 99})");
  write("baseline.json", R"({"nullmark_baseline": 1, "name": "c", "config_hash": "", "build": {}, "cells": []})");
  std::filesystem::create_directory(folder_ / "blocks");
  std::filesystem::create_directory(folder_ / "bad");
  write("bad/broken.json", "{");
  for (const char* arguments :
       {"old.json", "nowhere.json old.json", "old.json nowhere.json", "old.json truncated.json", "truncated.json old.json",
        "foreign.json old.json", "old.json foreign.json", "future.json old.json", "baseline.json old.json", "bad old.json",
        "old.json old.json --threshold -1", "old.json old.json --threshold much", "old.json old.json --blocks blocks",
        "old.json old.json --blocks nowhere", "old.json old.json --quiet-machine", "old.json old.json --update",
        "old.json old.json --junit nowhere/gate.xml", "old.json old.json --require time"}) {
    EXPECT_EQ(gate(arguments), 2) << arguments;
    const std::string error = read("err");
    EXPECT_EQ(error.rfind("nullmark: ", 0), 0u) << arguments << ": " << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << arguments << ": " << error;
    EXPECT_EQ(read("out"), "") << arguments;
  }
  EXPECT_EQ(read("old.json"), whole);
}

TEST_F(GateCli, BlocksThatAreIncompleteAreRefusedAndWallTimeIsAdvisory) {
  std::filesystem::create_directory(folder_ / "blocks");
  write("timed.json", R"({"nullmark":"config/2","timing":{"repetitions":1,"seconds":1e-6},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":1000,"matrix":{"estimator":["ratio"],"medium":["linear"]}}]})");
  ASSERT_EQ(run("run timed.json -o timed.results.json"), 0);
  RunRecord timed = read_results(read("timed.results.json"), "timed");
  TimeRecord& time = *timed.cells.at(0).time;
  for (int block = 1; block <= 10; ++block)
    for (const char* side : {"old", "new", "control"})
      for (int turn : {1, 2}) {
        const Real jitter = 1 + 0.001 * ((block + turn) % 3);
        time.ns_per_sample = 100 * jitter * (std::string(side) == "new" ? 1.2 : 1);
        time.ns_per_lookup = time.floor_ratio = 1;
        write(fmt::format("blocks/{:02}.{}.{}.json", block, side, turn), results_text(timed));
      }
  const std::string sides = "blocks/01.old.1.json blocks/01.new.1.json --blocks blocks";
  EXPECT_EQ(gate(sides), 0) << read("err");
  EXPECT_NE(read("out").find("slower (advisory)"), std::string::npos) << read("out");
  EXPECT_EQ(gate(sides + " --quiet-machine"), 4) << read("out");
  std::filesystem::remove(folder_ / "blocks/07.control.2.json");
  EXPECT_EQ(gate(sides), 2);
  EXPECT_NE(read("err").find("block 07 has no 07.control.2.json"), std::string::npos) << read("err");
}

}  // namespace
}  // namespace nullmark
