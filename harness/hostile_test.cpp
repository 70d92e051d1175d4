// Small files that ask for much: refused in one line, before memory or the stack is gone.

#include <gtest/gtest.h>

#include "harness/config.h"
#include "harness/json_input.h"
#include "harness/program_test.h"

namespace nullmark {
namespace {

std::string error_of(const std::string& config) {
  try {
    read_config(config, "c.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int n = 0; n < times; ++n) all += text;
  return all;
}

/// A list of so many numbers, as a sweep.
std::string sweep(int numbers) {
  std::string list = "[";
  for (int n = 1; n <= numbers; ++n) list += std::to_string(n) + (n < numbers ? "," : "]");
  return list;
}

std::string config(const std::string& medium, const std::string& more) {
  return R"({"$schema":"nullmark/config/1","experiments":[{"name":"e","rays":"single","matrix":{"estimator":"ratio","medium":)" +
         medium + "," + more + "}}]}";
}

TEST(Hostile, DeepNestingIsRefusedWhereItBegins) {
  for (const char* bracket : {"[", "{\"a\":"}) {
    try {
      parse_json(repeated(bracket, 1'000'000), "deep.json");
      FAIL();
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("deep.json:1:", 0), 0u) << error.what();
      EXPECT_NE(std::string(error.what()).find("nested more than 100 deep"), std::string::npos) << error.what();
    }
  }
  EXPECT_NO_THROW(parse_json(repeated("[", 100) + repeated("]", 100), "deep.json"));
}

TEST(Hostile, SweepsThatMultiplyAreRefused) {
  const std::string thousand = sweep(1000);
  const std::string linear = R"({"type":"linear","begin":)" + thousand + R"(,"end":)" + thousand + "}";
  EXPECT_EQ(error_of(config(linear, R"("samples_per_ray":1)")),
            "c.json: /experiments/0/matrix/medium: its sweeps make more than 100000 cells; split them into several files");
  EXPECT_EQ(error_of(config(R"("linear")", R"("samples_per_ray":)" + thousand + R"(,"seed":)" + thousand)),
            "c.json: /experiments/0/matrix: its sweeps make more than 100000 cells; split them into several files");
}

/// Seconds, not hours, for as many as are allowed.
TEST(Hostile, ManyCellsAreExpandedInLinearTime) {
  const std::string text =
      config(R"({"type":"linear","begin":)" + sweep(200) + R"(,"end":)" + sweep(100) + "}", R"("samples_per_ray":1)");
  EXPECT_EQ(read_config(text, "c.json").cells.size(), 20000u);
}

class HostileFiles : public ProgramTest {};

TEST_F(HostileFiles, LinksToResultsStayLinks) {
  std::filesystem::create_directories(folder_ / "elsewhere");
  std::ofstream(folder_ / "elsewhere/r.json") << "old";
  std::filesystem::create_symlink("elsewhere/r.json", folder_ / "link.json");
  write_atomically((folder_ / "link.json").string(), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "link.json"));
  EXPECT_EQ(read("elsewhere/r.json"), "new");
}

TEST_F(HostileFiles, LeftoversOfTheDeadAreRemovedAndNoOthers) {
  const std::string live = "r.json." + std::to_string(::getpid()) + ".tmp";
  for (const std::string& name :
       {std::string("r.json.2147483646.tmp"), std::string("r.json.notes.tmp"), live, std::string("s.json.2147483646.tmp")})
    write(name, "half");
  remove_leftovers((folder_ / "r.json").string());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "r.json.2147483646.tmp"));
  for (const std::string& name : {std::string("r.json.notes.tmp"), live, std::string("s.json.2147483646.tmp")})
    EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
}

}  // namespace
}  // namespace nullmark
