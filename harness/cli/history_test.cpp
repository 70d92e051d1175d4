// `nullmark history` as a command: exit codes, real results, a planted looser bound.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <sstream>

#include "harness/io/json_input.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

class HistoryCli : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c.json", config("c"));
    measure("c.json", "old.json", "2026-11-20", "");
  }

  static std::string config(const char* name) {
    return fmt::format(R"({{"nullmark":"config/2","name":"{}","timing":{{"enabled":false}},"experiments":[
      {{"name":"e","rays":{{"type":"orthographic","width":16,"height":16}},"samples_per_ray":64,"verdict":{{"enabled":false}},
       "matrix":{{"estimator":["ratio","delta"],"medium":[{{"type":"gaussian_bump","optical_depth":2}}]}}}}]}})",
                       name);
  }

  /// Results with a date of their own.
  void measure(const std::string& config, const std::string& to, const std::string& day, const std::string& options,
               const char* program = NULLMARK_PROGRAM) const {
    ASSERT_EQ(run(fmt::format("run {} -o {} --force {}", config, to, options), program), 0) << read("err");
    write(to, std::regex_replace(read(to), std::regex("\"start\": ?\"[0-9-]+T"), fmt::format("\"start\":\"{}T", day)));
  }

  /// " (commit 0123abc)" as the table of results has it.
  std::string commit_shown() const {
    std::smatch found;
    const std::string line = first_line();
    return std::regex_search(line, found, std::regex(R"( \(commit [^)]*\))")) ? found[0].str() : "";
  }

  std::string first_line() const { return read("out").substr(0, read("out").find('\n')); }
};

TEST_F(HistoryCli, SaysFirstWhatChanged) {
  measure("c.json", "same.json", "2026-11-22", "--threads 1");
  ASSERT_EQ(run("history same.json old.json"), 0) << read("err");  // in any order
  EXPECT_EQ(first_line().find("nothing changed since 2026-11-20"), 0u) << read("out");
  measure("c.json", "loose.json", "2026-11-26", "", NULLMARK_LOOSE_PROGRAM);
  ASSERT_EQ(run("history old.json loose.json same.json"), 0) << read("err");
  EXPECT_EQ(first_line().find("2 of 2 cells changed since 2026-11-22"), 0u) << read("out");
  EXPECT_NE(first_line().find("2 more lookups"), std::string::npos) << read("out");
  EXPECT_NE(read("out").find("2026-11-26  2026-11-22  2026-11-20"), std::string::npos) << read("out");
  ASSERT_EQ(run("history old.json loose.json --json"), 0);
  const Json json = parse_json(read("out"), "out");
  EXPECT_EQ(json["steps"][0]["changed"], 2);
  EXPECT_EQ(json["cells"][0]["lookups"].size(), 2u);
}

TEST_F(HistoryCli, NamesTheSettingThatIsNoChangeOfTheProgram) {
  const std::string judged = R"({{"nullmark":"config/2","name":"j","timing":{{"enabled":false}},"experiments":[
      {{"name":"e","rays":"single","samples_per_ray":{0},"verdict":{{"max_samples_per_ray":{0}}},"matrix":{{"estimator":"delta","medium":"cosine"}}}}]}})";
  for (const auto& [name, day, samples] : {std::tuple("many", "2026-11-20", 1000000), std::tuple("few", "2026-11-22", 64)}) {
    write(std::string(name) + ".config", fmt::format(fmt::runtime(judged), samples));
    measure(std::string(name) + ".config", std::string(name) + ".json", day, "");
  }
  ASSERT_EQ(run("history many.json few.json"), 0) << read("err");
  EXPECT_EQ(first_line(),
            "nothing changed since 2026-11-20" + commit_shown() +
                " but samples_per_ray (1000000 → 64), in 1 of 1 cells; 1 verdict differs, which chance or other samples can do");
  measure("few.config", "loose.json", "2026-11-26", "", NULLMARK_LOOSE_PROGRAM);
  ASSERT_EQ(run("history many.json loose.json"), 0) << read("err");
  EXPECT_NE(first_line().find("; other samples_per_ray (1000000 → 64) in 1"), std::string::npos) << read("out");
}

TEST_F(HistoryCli, RefusesWhatIsNoSeriesInOneLine) {
  write("d.json", config("d"));
  measure("d.json", "other.json", "2026-11-22", "");
  for (const char* files :
       {"old.json", "old.json other.json", "old.json none.json", "old.json c.json", "old.json old.json --blocks none"}) {
    EXPECT_EQ(run(fmt::format("history {}", files)), 2) << files;
    const std::string message = read("err");
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
  }
  EXPECT_EQ(run("history old.json old.json"), 5);
  EXPECT_NE(read("err").find("all files hold the same results"), std::string::npos) << read("err");
}

/// Of equal programs at most 2e-4 of comparisons show a change: one of 30 or more in 6e-3 of all seeds.
TEST_F(HistoryCli, ThirtySeedsOfOneProgramAreNoChange) {
  for (int seed = 201; seed <= 230; ++seed) {
    measure("c.json", "new.json", "2026-11-26", fmt::format("--seed {}", seed));
    ASSERT_EQ(run("history old.json new.json"), 0);
    EXPECT_EQ(first_line().find("nothing changed"), 0u) << seed << ": " << read("out");
  }
}

TEST_F(HistoryCli, TablesFitTheTerminal) {
  measure("c.json", "loose.json", "2026-11-26", "", NULLMARK_LOOSE_PROGRAM);
  for (const int width : {80, 120, 200}) {
    ASSERT_EQ(run(fmt::format("-c 'COLUMNS={} \"{}\" history old.json loose.json'", width, NULLMARK_PROGRAM), "/bin/sh"), 0);
    std::istringstream lines(read("out"));
    // Sentences have no two spaces in a row.
    for (std::string line; std::getline(lines, line);) {
      if (line.find("  ") == std::string::npos) continue;
      EXPECT_LE(line.size(), static_cast<std::size_t>(width)) << line;
    }
  }
}

}  // namespace
}  // namespace nullmark
