// What the surroundings of the program may do to it: closed and full streams.

#include <algorithm>
#include <sstream>

#include "harness/model/exit_code.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

class ProcessTest : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":{"type":"orthographic","width":4,"height":4},"samples_per_ray":50,"verdict":{"laws":"never"},
       "matrix":{"estimator":["ratio","delta"],"medium":["linear",{"type":"linear","end":2}]}}]})");
  }

  /// Exit code of a command with the shell's own redirections, or 128 and the signal that ended it.
  int shell(const std::string& arguments, const char* before = "", const char* program = NULLMARK_PROGRAM) const {
    const int status =
        std::system(fmt::format("cd '{}' && {}exec '{}' {}", folder_.string(), before, program, arguments).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  bool exists(const std::string& name) const { return std::filesystem::exists(folder_ / name); }
};

TEST_F(ProcessTest, NobodyNeedsToListenToProgress) {
  for (const char* stream : {"2>&-", "2>/dev/full"}) {
    SCOPED_TRACE(stream);
    EXPECT_EQ(shell(fmt::format("run c.json -o r.json --force >out {}", stream)), 0);
    EXPECT_EQ(results("r.json").cells.size(), 4u);
    EXPECT_FALSE(exists("r.json.journal"));
    EXPECT_EQ(shell(fmt::format("run nowhere.json >out {}", stream)), static_cast<int>(ExitCode::input_error));
  }
}

/// The journal of a run without a standard error holds its cells, and nothing else.  A limit on the size of files ends the run.
TEST_F(ProcessTest, ProgressIsNotWrittenIntoTheJournal) {
  ASSERT_EQ(shell("run c.json -o whole.json >out 2>err"), 0) << read("err");
  for (const char* streams : {"0<&- 1>&- 2>&-", "2>&-"}) {
    SCOPED_TRACE(streams);
    std::filesystem::remove(folder_ / "r.json");
    EXPECT_NE(shell(fmt::format("run c.json -o r.json --threads 1 {}", streams), "ulimit -f 16 && "), 0);
    std::istringstream lines(read("r.json.journal"));
    int number = 0;
    for (std::string line; std::getline(lines, line); ++number) EXPECT_EQ(line.substr(0, 2), "{\"") << line.substr(0, 100);
    EXPECT_GT(number, 1);
    EXPECT_EQ(shell("run c.json -o r.json --resume >out 2>err"), 0) << read("err");
    EXPECT_EQ(read("err").find("skipped"), std::string::npos) << read("err");
    EXPECT_EQ(statistics_text(results("r.json")), statistics_text(results("whole.json")));
  }
}

TEST_F(ProcessTest, AClosedStandardOutputIsAnError) {
  EXPECT_EQ(shell("list media 1>&- 2>err"), static_cast<int>(ExitCode::internal_error));
  EXPECT_EQ(shell("list media >/dev/full 2>err"), static_cast<int>(ExitCode::internal_error));
  const std::string error = read("err");
  EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
}

}  // namespace
}  // namespace nullmark
