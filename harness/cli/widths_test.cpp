// What commands print fits the terminal, begins with its meaning, and offers commands that run as they are printed.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "harness/io/fitted.h"
#include "harness/io/json_input.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

/// Of UTF-8: the bytes that begin a character.
std::size_t characters(const std::string& line) {
  return static_cast<std::size_t>(
      std::count_if(line.begin(), line.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

class Widths : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c d.json", R"({"nullmark":"config/2","name":"c","timing":{"repetitions":2,"seconds":0.0001},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":64,"matrix":{"estimator":["ratio",{"type":"ray_marching","steps":[3,4,5,6,7,8,9]}],
       "medium":[{"type":"linear","optical_depth":[0.5,1,1.5,2,2.5,3,3.5]}]}}]})");
  }

  int run_in(int width, const std::string& arguments) const {
    return run(fmt::format("COLUMNS={} '{}' {}", width, NULLMARK_PROGRAM, arguments), "/usr/bin/env");
  }

  std::size_t widest() const {
    std::istringstream lines(read("out"));
    std::size_t width = 0;
    for (std::string line; std::getline(lines, line);) width = std::max(width, characters(line));
    return width;
  }

  std::string first_line() const { return read("out").substr(0, read("out").find('\n')); }
};

TEST_F(Widths, TablesFitTheTerminal) {
  for (const int width : {80, 120, 200}) {
    const auto most = static_cast<std::size_t>(width);
    ASSERT_EQ(run_in(width, "run 'c d.json' -o 'c d r.json' --force"), 0) << read("err");
    EXPECT_NE(read("out").find("\nestimator "), std::string::npos);
    EXPECT_NE(read("out").find("no room for columns: "), std::string::npos);
    std::istringstream lines(read("out"));
    // Titles and sentences are broken by the terminal; they have no two spaces in a row.
    for (std::string line; std::getline(lines, line);)
      EXPECT_TRUE(characters(line) <= most || line.find("  ") == std::string::npos) << line;
    ASSERT_EQ(run_in(width, "compare 'c d r.json'"), 0) << read("err");
    lines = std::istringstream(read("out"));
    for (std::string line; std::getline(lines, line);)
      EXPECT_TRUE(characters(line) <= most || line.find("  ") == std::string::npos) << line;
    run_in(width, "check 'c d r.json' --all");
    EXPECT_LE(widest(), most);
    ASSERT_EQ(run_in(width, "list estimators"), 0);
    EXPECT_LE(widest(), most);
  }
}

TEST_F(Widths, FilesHaveAllColumnsUnlessSomeAreChosen) {
  ASSERT_EQ(run("run 'c d.json' -o 'c d r.json'"), 0);
  for (const char* column : {"verdict", "lookups theory", "floor ratio", "status"})
    EXPECT_NE(read("out").find(column), std::string::npos) << column;
  ASSERT_EQ(run("run 'c d.json' -o 'c d r.json' --force --columns 'rmse,ns/sample'"), 0);
  EXPECT_NE(read("out").find("rmse  ns/sample\n"), std::string::npos) << read("out");
  EXPECT_EQ(read("out").find("bias"), std::string::npos) << read("out");
  ASSERT_EQ(run("compare 'c d r.json' --columns 'variance,verdict'"), 0);
  EXPECT_NE(read("out").find("variance  verdict\n"), std::string::npos) << read("out");
  for (const char* command : {"run 'c d.json' -o 'new.json' --columns speed", "compare 'c d r.json' --columns speed"}) {
    EXPECT_EQ(run(command), 2);
    EXPECT_NE(read("err").find("--columns: unknown column \"speed\"; expected some of verdict,"), std::string::npos)
        << read("err");
  }
  EXPECT_EQ(run("compare 'c d r.json' --columns estimator,varianse"), 2);
  EXPECT_NE(read("err").find("unknown column \"varianse\"; did you mean \"variance\"?"), std::string::npos) << read("err");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "new.json"));
}

TEST_F(Widths, TheFirstLineIsTheMeaning) {
  ASSERT_EQ(run("run 'c d.json' -o 'c d r.json'"), 0);
  EXPECT_EQ(first_line().find("56 cells: "), 0u) << read("out");
  ASSERT_EQ(run("compare 'c d r.json'"), 0);
  EXPECT_EQ(first_line().find("Fastest to 1 % error, alone or tied, of 7 scenes: "), 0u) << read("out");
  run("check 'c d r.json'");
  EXPECT_NE(first_line().find(" PASS"), std::string::npos) << read("out");
}

TEST_F(Widths, OfferedCommandsRunAsPrinted) {
  ASSERT_EQ(run("run 'c d.json' -o 'c d r.json'"), 0);
  const int plain = run("check 'c d r.json'");
  const std::string text = read("out"), offer = "each of them: ";
  const std::size_t at = text.find(offer);
  ASSERT_NE(at, std::string::npos) << text;
  write("offered.sh", text.substr(at + offer.size(), text.find('\n', at) - at - offer.size()));
  EXPECT_EQ(run("offered.sh", "/bin/sh"), plain) << read("err");
  EXPECT_NE(read("out").find("ray_marching/steps:3/linear/optical_depth:0.5/global: "), std::string::npos) << read("out");
}

TEST(Wrapped, BreaksAtSpacesAndNoWords) {
  EXPECT_EQ(wrapped("one two three four five six\nseven", 20), "one two three four\n    five six\nseven");
  EXPECT_EQ(wrapped("averyveryverylongwordindeed", 20), "averyveryverylongwordindeed");
  EXPECT_EQ(wrapped("one two", 0), "one two");
}

}  // namespace
}  // namespace nullmark
