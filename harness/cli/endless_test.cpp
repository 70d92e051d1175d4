// Cells that cannot end are refused before they are started; what does not end by itself is ended.

#include <chrono>

#include "harness/model/exit_code.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

using Clock = std::chrono::steady_clock;

class Endless : public ProgramTest {
 protected:
  /// One honest cell, and one with the given tracker, medium and majorant.
  void configure(const std::string& estimator, const std::string& medium = R"("linear")",
                 const std::string& majorant = R"("global")", const std::string& samples = R"("samples_per_ray":[50])") const {
    write("c.json", fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[
      {{"name":"a","rays":"single","samples_per_ray":50,"verdict":{{"laws":"never"}},"matrix":{{"estimator":"delta","medium":"cosine"}}}},
      {{"name":"b","rays":"single","verdict":{{"laws":"never"}},
        "matrix":{{"estimator":{},"medium":{},"majorant":{},{}}}}}]}})",
                                estimator, medium, majorant, samples));
  }

  /// Exit code of a run that is sent a signal, if any, some time after its first cell was finished; and its seconds from then on.
  std::pair<int, double> ended(const std::string& options, const char* signal) const {
    const std::string command = fmt::format(
        "cd '{}' && rm -f err && {{ '{}' run c.json -o r.json {} >out 2>err & }}; "
        "while kill -0 $! && ! grep -qs '1/2' err; do sleep .02; done 2>/dev/null; sleep .1; date +%s.%N >since; {} wait $!",
        folder_.string(), NULLMARK_FAULTY_PROGRAM, options, signal ? fmt::format("kill -{} $!;", signal) : "");
    const int status = std::system(command.c_str());
    const double now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), now - std::stod(read("since"))};
  }

  void expect_first_is_kept(const char* reason) const {
    const RunRecord found = results("r.json");
    ASSERT_EQ(found.cells.size(), 2u);
    EXPECT_EQ(found.cells[0].status, Status::ok);
    EXPECT_EQ(found.cells[1].status, Status::not_run);
    EXPECT_EQ(found.cells[1].reason, reason);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "r.json.journal"));
  }

  // Two seconds are promised; a busy machine may take longer to start a process and to write.
  static constexpr double kSoon = 4;
};

TEST_F(Endless, SamplesOfTooManyLookupsAreRefusedWithTheForecast) {
  for (const char* medium : {R"({"type":"homogeneous","extinction":1e30})", R"({"type":"homogeneous","extinction":1e308})"}) {
    configure(R"("ratio")", medium);
    ASSERT_EQ(run("run c.json -o r.json --force"), 0) << read("err");
    const RunRecord found = results("r.json");
    EXPECT_EQ(found.cells[0].status, Status::ok);
    EXPECT_EQ(found.cells[1].status, Status::skipped);
    EXPECT_EQ(found.cells[1].reason.rfind("a sample is expected to take 1e+30", 0) == 0 ||
                  found.cells[1].reason.rfind("a sample is expected to take 1e+308", 0) == 0,
              true)
        << found.cells[1].reason;
    EXPECT_NE(read("err").find("a sample is expected to take"), std::string::npos) << read("err");
    EXPECT_EQ(run("run c.json --dry-run"), 0);
    EXPECT_NE(read("out").find("a sample is expected to take"), std::string::npos) << read("out");
  }
}

TEST_F(Endless, MoreSamplesThanCanBeCountedAreRefused) {
  for (const char* lookups : {"1e300", "1e17"}) {
    configure(R"("ratio")", R"("linear")", R"("global")", fmt::format(R"("equal_lookups":{})", lookups));
    ASSERT_EQ(run("run c.json -o r.json --force"), 0) << read("err");
    const RunRecord found = results("r.json");
    EXPECT_EQ(found.cells[1].status, Status::skipped);
    EXPECT_EQ(found.cells[1].reason.rfind(fmt::format("equal_lookups {:.3g} makes", std::stod(lookups)), 0), 0u)
        << found.cells[1].reason;
  }
}

/// A tracker that answers nothing, in a sample and in its theory.
TEST_F(Endless, SignalsEndWhatDoesNotAnswer) {
  constexpr const char* kTwiceAsTimeoutDoes = "TERM $!; sleep .05; kill -TERM";
  for (const auto& [signal, code] : {std::pair("INT", ExitCode::interrupted), std::pair("TERM", ExitCode::terminated),
                                     std::pair(kTwiceAsTimeoutDoes, ExitCode::terminated)}) {
    std::filesystem::remove(folder_ / "r.json");
    configure(R"({"type":"faulty","fault":"sleeps"})");
    const auto [exit, seconds] = ended("--threads 2", signal);
    EXPECT_EQ(exit, static_cast<int>(code)) << read("err");
    EXPECT_LT(seconds, kSoon);
    expect_first_is_kept("interrupted");
    EXPECT_NE(read("err").find("warning: cell faulty/fault:sleeps/linear/global was still under way"), std::string::npos)
        << read("err");
  }
}

TEST_F(Endless, TheTimeBudgetEndsWhatDoesNotAnswer) {
  configure(R"({"type":"faulty","fault":"sleeps"})");
  const auto [exit, seconds] = ended("--threads 2 --time-budget 0.5", nullptr);
  EXPECT_EQ(exit, 0) << read("err");
  EXPECT_LT(seconds, kSoon);
  expect_first_is_kept("time budget spent");
}

TEST_F(Endless, ATheoryOrAStructureThatTakesMinutesIsEnded) {
  configure(R"({"type":"faulty","fault":"slow_theory"})");
  const auto begin = Clock::now();
  EXPECT_EQ(run("run c.json -o r.json --time-budget 0.3", NULLMARK_FAULTY_PROGRAM), static_cast<int>(ExitCode::nothing_ran));
  EXPECT_LT(std::chrono::duration<double>(Clock::now() - begin).count(), kSoon);
  for (const CellRecord& cell : results("r.json").cells) EXPECT_EQ(cell.status, Status::not_run);
  EXPECT_NE(read("err").find("cell faulty/fault:slow_theory/linear/global was still under way"), std::string::npos)
      << read("err");
}

}  // namespace
}  // namespace nullmark
