// Programs built outside the tree against the installed package: the example in estimators/plugin_example and a tracker that lies
// (harness/testing/plugin_test).  ctest builds them first, as Plugin.Build.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>

#include "harness/io/file_io.h"
#include "harness/io/results_json.h"
#include "harness/model/exit_code.h"

namespace nullmark {
namespace {

const std::filesystem::path kPlugins = NULLMARK_PLUGINS;

class Plugin : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kPlugins / "build")) GTEST_SKIP() << "the plug-ins are built by ctest";
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("nullmark_plugin_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  std::string read(const std::string& name) const { return read_file((folder_ / name).string()); }
  RunRecord results(const std::string& name) const { return read_results(read(name), name); }

  /// Exit code; output goes to the files "out" and "err".
  int run(const std::string& command) const {
    const int status = std::system(("cd '" + folder_.string() + "' && " + command + " >out 2>err </dev/null").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  static std::string example() { return quoted("build/example/nullmark_example"); }
  static std::string liar() { return quoted("build/nullmark_liar"); }
  static std::string config() { return quoted("plugin_example/example.json"); }
  static std::string quoted(const char* path) { return fmt::format("'{}' ", (kPlugins / path).string()); }

  bool has_check() const { return run(example() + "--help") == 0 && std::regex_search(read("out"), std::regex("\\n +check ")); }

  std::filesystem::path folder_;
};

TEST_F(Plugin, NewcomersStandBesideTheTrackersAndMediaOfTheTree) {
  const auto expect_both = [&](const std::string& command, const char* newcomer, const char* resident) {
    ASSERT_EQ(run(example() + command), 0) << read("err");
    for (const char* name : {newcomer, resident})
      EXPECT_NE(read("out").find(fmt::format("\"{}\"", name)), std::string::npos) << command << ": " << name;
  };
  expect_both("list estimators --json", "roulette_ratio", "ratio");
  expect_both("list media --json", "ripples", "linear");
  expect_both("schema config", "roulette_ratio", "ratio");
  expect_both("schema config", "ripples", "linear");
}

/// Means within 5.5 standard errors by theory, variances by the measured kurtosis (4e-8 a test); 2 % of lookups is more than
/// that.
TEST_F(Plugin, ExampleKeepsItsClaimsAndServesEveryCommand) {
  ASSERT_EQ(run(example() + "run " + config() + "-o r.json"), 0) << read("err");
  int newcomers = 0;
  for (const CellRecord& record : results("r.json").cells) {
    SCOPED_TRACE(record.cell.name);
    ASSERT_EQ(record.status, Status::ok) << record.reason;
    EXPECT_EQ(record.majorant_violations, 0u);
    const auto samples = static_cast<Real>(record.samples);
    newcomers += record.cell.estimator->type == "roulette_ratio";
    for (const ChannelRecord& channel : record.channel) {
      ASSERT_TRUE(channel.bias && channel.variance && channel.variance_theory);
      EXPECT_LT(std::abs(*channel.bias), 5.5 * std::sqrt(*channel.variance_theory / samples));
      if (record.rays == 1 && *channel.relative_variance < 10) {
        ASSERT_TRUE(channel.kurtosis);
        EXPECT_NEAR(*channel.variance / *channel.variance_theory, 1, 5.5 * std::sqrt((*channel.kurtosis - 1) / samples));
      }
    }
    ASSERT_TRUE(record.lookups_per_sample && record.lookups_theory);
    EXPECT_NEAR(*record.lookups_per_sample / *record.lookups_theory, 1, 0.02);
  }
  EXPECT_EQ(newcomers, 19);

  EXPECT_EQ(run(example() + "compare r.json --baseline ratio"), 0) << read("err");
  EXPECT_NE(read("out").find("roulette_ratio"), std::string::npos) << read("out");
  EXPECT_EQ(run(example() + "export r.json --format csv"), 0) << read("err");
  EXPECT_NE(read("out").find("roulette_ratio"), std::string::npos);
  // Results are the same data for the program without the plug-in.
  EXPECT_EQ(run("'" NULLMARK_PROGRAM "' compare r.json"), 0) << read("err");
  if (has_check()) {
    EXPECT_NE(run(example() + "check r.json"), static_cast<int>(ExitCode::bias_proven)) << read("out") << read("err");
  }
}

/// A volume is read by the plug-in's own executable over again.
TEST_F(Plugin, ExampleReadsVolumes) {
  ASSERT_EQ(run(example() + "make-volume v.vdb --resolution 16"), 0) << read("err");
  write("v.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"v","rays":"single",
      "samples_per_ray":100,"matrix":{"estimator":["ratio","roulette_ratio"],"medium":{"type":"vdb","file":"v.vdb"}}}]})");
  ASSERT_EQ(run(example() + "run v.json -o r.json"), 0) << read("err");
  for (const CellRecord& record : results("r.json").cells) EXPECT_EQ(record.status, Status::ok) << record.reason;
}

/// A bias of 2 % is 25 standard errors here, so another seed every time misses nothing.
TEST_F(Plugin, LiesAreBiasedAndFoundOut) {
  const bool check = has_check();
  for (const char* lie : {"rate", "dropped", "clamp", "roulette"}) {
    write("liar.json", fmt::format(
                           R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[
                               {{"name":"liar","rays":"single","samples_per_ray":1000000,"matrix":{{
                                 "estimator":{{"type":"lying","lie":"{}"}},"medium":{{"type":"homogeneous","extinction":1}},
                                 "majorant":{{"type":"global","looseness":2}}}}}}]}})",
                           lie));
    ASSERT_EQ(run(liar() + "run liar.json -o r.json --force --seed random"), 0) << read("err");
    const RunRecord found = results("r.json");
    ASSERT_EQ(found.cells.size(), 1u);
    const CellRecord& record = found.cells[0];
    SCOPED_TRACE(record.cell.name + ", seed " + std::to_string(record.cell.seed));
    ASSERT_EQ(record.status, Status::ok) << record.reason;
    EXPECT_EQ(record.claims, "unbiased");
    const ChannelRecord& channel = record.channel[0];
    EXPECT_NEAR(std::abs(*channel.bias / *channel.reference), 0.02, 0.005);
    EXPECT_GT(std::abs(*channel.bias), 15 * std::sqrt(*channel.variance / static_cast<Real>(record.samples)));
    if (!check) continue;
    EXPECT_EQ(run(liar() + "check r.json"), static_cast<int>(ExitCode::bias_proven)) << read("out") << read("err");
    EXPECT_NE((read("out") + read("err")).find(record.cell.name), std::string::npos) << read("out") << read("err");
  }
}

TEST_F(Plugin, AnotherVersionIsRefusedByNameAndVersion) {
  const std::string text = read_file((kPlugins / "plugin_example/CMakeLists.txt").string());
  write("CMakeLists.txt", std::regex_replace(text, std::regex("find_package\\(nullmark [0-9.]+"), "find_package(nullmark 9.9"));
  ASSERT_NE(read("CMakeLists.txt"), text);
  const std::string command = fmt::format("'{}' -S . -B build -G '{}' -DCMAKE_CXX_COMPILER='{}' -DCMAKE_PREFIX_PATH={}",
                                          NULLMARK_CMAKE, NULLMARK_GENERATOR, NULLMARK_COMPILER, quoted("prefix"));
  EXPECT_NE(run(command), 0);
  const std::string error = std::regex_replace(read("err"), std::regex("\\s+"), " ");
  EXPECT_NE(error.find("package \"nullmark\" that is compatible with requested version \"9.9\""), std::string::npos) << error;
  EXPECT_NE(error.find("nullmarkConfig.cmake, version: " NULLMARK_VERSION), std::string::npos) << error;
}

}  // namespace
}  // namespace nullmark
