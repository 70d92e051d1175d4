// What the surroundings of the program may do to it, and the trackers of plug-ins: closed and full streams, limits, exceptions,
// crashes.

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

  /// A configuration of two honest cells and one with this fault, in the middle.
  std::string with_fault(const std::string& fault,
                         const std::string& rays = R"({"type":"orthographic","width":4,"height":4})") const {
    return fmt::format(
        R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[
          {{"name":"e","rays":{},"samples_per_ray":50,"verdict":{{"laws":"never"}},
           "matrix":{{"estimator":["ratio",{{"type":"faulty","fault":"{}"}},"delta"],"medium":"linear"}}}}]}})",
        rays, fault);
  }

  /// The error that the last command told, if it was one line.
  std::string only_line() const {
    const std::string error = read("err");
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
    return error;
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
  EXPECT_EQ(only_line().rfind("nullmark: ", 0), 0u);
}

TEST_F(ProcessTest, AFileThatMayNotGrowIsAnErrorThatNamesIt) {
  EXPECT_EQ(shell("run c.json -o r.json >out 2>err", "ulimit -f 16 && "), static_cast<int>(ExitCode::input_error));
  EXPECT_NE(read("err").find("cannot be written: File too large"), std::string::npos) << read("err");
}

TEST_F(ProcessTest, ALongFilterIsRefused) {
  for (const std::size_t length : {1001, 100000}) {
    EXPECT_EQ(run("run c.json --filter " + std::string(length, 'a')), static_cast<int>(ExitCode::input_error));
    EXPECT_EQ(only_line(), fmt::format("nullmark: --filter: found {} characters; expected at most 1000\n", length));
  }
  EXPECT_EQ(run("run c.json --filter " + std::string(1000, 'a')), static_cast<int>(ExitCode::nothing_ran));
}

TEST_F(ProcessTest, ThreadsThatAreRefusedAreOneLine) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers want to be preloaded first";
#endif
  // A library of OpenVDB's starts four before the program begins, and ends it where it cannot.
  for (const int first : {5, 8, 13}) {
    const std::string refused = fmt::format("FAULTY_THREADS={} LD_PRELOAD='{}' ", first, NULLMARK_FAULTY_THREADS);
    EXPECT_EQ(shell("run c.json -o r.json --threads 8 >out 2>err", refused.c_str()), static_cast<int>(ExitCode::input_error));
    EXPECT_NE(only_line().find(" of 9 threads cannot be started: Resource temporarily unavailable; give fewer --threads"),
              std::string::npos)
        << read("err");
    EXPECT_FALSE(exists("r.json"));
  }
}

/// Whatever a tracker throws, and wherever, is an error of its cell alone.
TEST_F(ProcessTest, ATrackerThatThrowsFailsAlone) {
  for (const auto& [fault, message] : {std::pair("throws", "no flight today"), std::pair("theory", "no theory")}) {
    SCOPED_TRACE(fault);
    write("f.json", with_fault(fault));
    EXPECT_EQ(shell("run f.json -o f.results.json --force >out 2>err", "", NULLMARK_FAULTY_PROGRAM),
              static_cast<int>(ExitCode::internal_error));
    const RunRecord found = results("f.results.json");
    ASSERT_EQ(found.cells.size(), 3u);
    for (const int honest : {0, 2}) EXPECT_EQ(found.cells[static_cast<std::size_t>(honest)].status, Status::ok);
    EXPECT_EQ(found.cells[1].status, Status::error);
    EXPECT_EQ(found.cells[1].reason, std::string("the tracker threw: ") + message);
    EXPECT_EQ(run("check f.results.json"), 1) << read("err");
    EXPECT_NE(read("out").find(message), std::string::npos) << read("out");
    for (const char* command : {"compare f.results.json", "report f.results.json -o page.html"})
      EXPECT_NE(shell(std::string(command) + " >out 2>err", "", NULLMARK_FAULTY_PROGRAM), 1) << command << read("err");
  }
}

TEST_F(ProcessTest, ACrashNamesItsCell) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers tell of crashes themselves";
#endif
  for (const auto& [fault, number] : {std::pair("crashes", SIGSEGV), std::pair("terminates", SIGABRT)}) {
    SCOPED_TRACE(fault);
    write("f.json", with_fault(fault));
    // As a command of a list: a shell that waits for it tells the signal in its own words.
    EXPECT_EQ(shell("run f.json -o f.results.json --threads 2 --force >out 2>err", "ulimit -c 0; ", NULLMARK_FAULTY_PROGRAM),
              128 + number);
    const std::string told =
        fmt::format("nullmark: crashed (signal {}) in cell faulty/fault:{}/linear/global; `run` keeps", number, fault);
    EXPECT_NE(read("err").find(told), std::string::npos) << read("err");
  }
}

TEST_F(ProcessTest, ARateBeforeTheFirstFlightIsZeroWhereARayMisses) {
  write("f.json", with_fault("rate_first", R"({"type":"single","from":[5,5,5],"to":[6,5,5]})"));
  EXPECT_EQ(shell("run f.json -o f.results.json >out 2>err", "", NULLMARK_FAULTY_PROGRAM), 0) << read("err");
}

}  // namespace
}  // namespace nullmark
