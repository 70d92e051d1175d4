// What the program does with trackers from outside: consent, shards, replay, other code, and children that are killed.

#include <signal.h>

#include <chrono>
#include <random>
#include <thread>

#include "harness/foreign/foreign_test.h"
#include "harness/foreign/serve.h"
#include "harness/model/exit_code.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

using foreign_test::library;
using foreign_test::process;

class ForeignProgram : public ProgramTest {
 protected:
  void configure(const std::string& estimator, int samples = 4096, const std::string& media = R"("linear")") const {
    write(
        "c.json",
        fmt::format(
            R"({{"nullmark":"config/2","name":"c","timing":{{"repetitions":1,"seconds":0.001}},"experiments":[{{"name":"e","rays":"single","samples_per_ray":{},"matrix":{{"estimator":{},"medium":{},"majorant":["global",{{"type":"grid","resolution":4}}]}}}}]}})",
            samples, estimator, media));
  }
  /// The file's statistics, without times and provenance.
  std::vector<std::string> statistics(const std::string& name) const {
    std::vector<std::string> lines;
    for (const CellRecord& record : results(name).cells)
      lines.push_back(fmt::format("{} {:.17g} {:.17g} {} {}", record.cell.name, record.channel.at(0).mean.value_or(-1),
                                  record.channel[0].variance.value_or(-1), record.lookups, record.draws));
    return lines;
  }
};

TEST_F(ForeignProgram, NothingRunsWithoutConsent) {
  write("mine.sh", "#!/bin/sh\ntouch started\n");
  std::filesystem::permissions(folder_ / "mine.sh", std::filesystem::perms::owner_all);
  for (const std::string& estimator : {library(NULLMARK_TRACKERS_LIBRARY, "ratio"), process({"./mine.sh"})}) {
    configure(estimator);
    EXPECT_EQ(run("run c.json -o r.json"), 2);
    EXPECT_NE(read("err").find("c.json: /experiments/0/matrix/estimator: "), std::string::npos) << read("err");
    EXPECT_NE(read("err").find("give --allow-foreign or set NULLMARK_ALLOW_FOREIGN=1"), std::string::npos) << read("err");
    EXPECT_FALSE(std::filesystem::exists(folder_ / "r.json"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "started"));
  configure(library(NULLMARK_TRACKERS_LIBRARY, "ratio"));
  EXPECT_EQ(run("run c.json -o r.json --allow-foreign"), 0) << read("err");
}

TEST_F(ForeignProgram, CommandsThatReadResultsStartNothing) {
  write("mine.sh", fmt::format("#!/bin/sh\ntouch started\nexec {}\n", NULLMARK_FAULTY_PROCESS));
  std::filesystem::permissions(folder_ / "mine.sh", std::filesystem::perms::owner_all);
  configure(process({"./mine.sh"}));
  ASSERT_EQ(run("run c.json -o r.json --allow-foreign"), 0) << read("err");
  ASSERT_TRUE(std::filesystem::remove(folder_ / "started"));
  const auto before = std::distance(std::filesystem::directory_iterator(folder_), {});
  std::filesystem::copy(folder_ / "r.json", folder_ / "s.json");
  for (const char* command :
       {"check r.json", "compare r.json", "report r.json -o r.html", "export r.json --format csv", "export r.json --format jsonl",
        "replay r.json process/linear/global", "gate --baseline s.json r.json", "merge r.json -o m.json"}) {
    const std::string with_consent = std::string("env NULLMARK_ALLOW_FOREIGN=1 '") + NULLMARK_PROGRAM + "' " + command;
    if (std::string(command).rfind("replay", 0) != 0) {
      const int code = std::system(fmt::format("cd '{}' && {} >out 2>err </dev/null", folder_.string(), with_consent).c_str());
      EXPECT_TRUE(WIFEXITED(code));
    }
    run(command);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "started")) << command;
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), before + 3);  // s.json, r.html, m.json
}

TEST_F(ForeignProgram, ShardsAndThreadsMakeTheSameBits) {
  configure("[" + library(NULLMARK_EXAMPLE_LIBRARY, "ratio") + "," +
            process({"/usr/bin/python3", "-B", "-m", "nullmark", "serve", NULLMARK_EXAMPLE_PYTHON}) + "]");
  ::setenv("PYTHONPATH", NULLMARK_SOURCE_DIR "/harness/python", 1);
  ASSERT_EQ(run("run c.json -o whole.json --allow-foreign --threads 1 --no-timing"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o a.json --allow-foreign --shard 1/2 --no-timing"), 0) << read("err");
  ASSERT_EQ(run("run c.json -o b.json --allow-foreign --shard 2/2 --no-timing"), 0) << read("err");
  ASSERT_EQ(run("merge a.json b.json -o merged.json"), 0) << read("err");
  EXPECT_EQ(statistics("whole.json"), statistics("merged.json"));
  EXPECT_EQ(statistics("whole.json").size(), 4u);
}

TEST_F(ForeignProgram, ReplayAndResumeRefuseOtherCode) {
  std::filesystem::copy(NULLMARK_TRACKERS_LIBRARY, folder_ / "mine.so");
  configure(library("mine.so", "ratio"));
  ASSERT_EQ(run("run c.json -o r.json --allow-foreign --no-timing"), 0) << read("err");
  const std::string cell = results("r.json").cells.at(0).cell.name;
  EXPECT_EQ(run(fmt::format("replay r.json '{}'", cell)), 2);
  EXPECT_NE(read("err").find("--allow-foreign"), std::string::npos) << read("err");
  EXPECT_EQ(run(fmt::format("replay r.json '{}' --allow-foreign --ray 0 --sample 3", cell)), 0) << read("err");
  EXPECT_NE(read("out").find("lookup"), std::string::npos) << read("out");
  std::filesystem::copy(NULLMARK_EXAMPLE_LIBRARY, folder_ / "mine.so", std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(run(fmt::format("replay r.json '{}' --allow-foreign", cell)), 2);
  EXPECT_NE(read("err").find("the tracker's code has changed since"), std::string::npos) << read("err");
  EXPECT_EQ(run("run c.json -o r.json --resume --allow-foreign --no-timing"), 2);
  EXPECT_NE(read("err").find("its code was replaced"), std::string::npos) << read("err");
}

TEST_F(ForeignProgram, ProveTriesATrackerOfALibrary) {
  const std::string honest = library(NULLMARK_EXAMPLE_LIBRARY, "ratio"),
                    slip = library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("parameters":{"fault":"slip"})");
  EXPECT_EQ(run(fmt::format("prove '{}' --quick --allow-foreign", honest)), 0) << read("out") << read("err");
  const auto first_line = [&] { return read("out").substr(0, read("out").find('\n')); };
  EXPECT_EQ(first_line().find(fmt::format("estimator {}: ", honest)), 0u) << read("out");
  EXPECT_NE(first_line().find(" PASS"), std::string::npos) << read("out");
  EXPECT_EQ(run(fmt::format("prove '{}' --quick --allow-foreign", slip)), 3) << read("out") << read("err");
  EXPECT_NE(first_line().find(" FAIL"), std::string::npos) << read("out");
}

TEST_F(ForeignProgram, ACrashInsideTheProgramNamesItsCell) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers tell of crashes themselves";
#endif
  configure(library(NULLMARK_TRACKERS_LIBRARY, "ratio", R"("parameters":{"fault":"crashes"})"));
  EXPECT_EQ(run("run c.json -o r.json --allow-foreign"), 128 + SIGSEGV);
  EXPECT_NE(read("err").find("crashed (signal 11) in cell"), std::string::npos) << read("err");
  EXPECT_NE(read("err").find("\"isolate\": true"), std::string::npos) << read("err");
}

/// The processes of a session's trackers, by their command lines.
std::vector<pid_t> children(const std::string& marker) {
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream file(entry.path() / "cmdline");
    const std::string line{std::istreambuf_iterator<char>(file), {}};
    if (line.find(marker) != std::string::npos && line.find(kServeLibrary) != std::string::npos) found.push_back(std::stoi(name));
  }
  return found;
}

TEST_F(ForeignProgram, KilledChildrenCostTheirCellsAlone) {
  // A copy, so that its processes are told from others'.
  std::filesystem::copy(NULLMARK_EXAMPLE_LIBRARY, folder_ / "mine.so");
  configure(library("mine.so", "ratio", R"("isolate":true,"seconds":5)"), 65536,
            R"({"type":"linear","optical_depth":[0.5,1,1.5,2,2.5,3,3.5,4,4.5,5]})");
  const char* const kills_asked = std::getenv("NULLMARK_CHILD_KILLS");
  const int kills = kills_asked ? std::atoi(kills_asked) : 20;
  std::mt19937 random(7);
  int killed = 0, errors = 0;
  for (int round = 0; killed < kills && round < 10 * kills; ++round) {
    const auto begun = std::chrono::steady_clock::now();
    std::thread program([&] { run("run c.json -o r.json --force --allow-foreign --no-timing"); });
    const std::string marker = (folder_ / "mine.so").string();
    for (int i = 0; i < 500 && children(marker).size() < 2; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    for (int i = 0; i < 4 && killed < kills; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(random() % 300));
      const auto processes = children(marker);
      if (!processes.empty() && ::kill(processes[random() % processes.size()], SIGKILL) == 0) ++killed;
    }
    program.join();
    EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(60));
    if (!std::filesystem::exists(folder_ / "r.json")) {
      // Killed as it greeted: the configuration is refused in one line.
      EXPECT_NE(read("err").find("signal 9"), std::string::npos) << read("err");
      continue;
    }
    const RunRecord run = results("r.json");
    ASSERT_EQ(run.cells.size(), 20u);
    for (const CellRecord& record : run.cells) {
      ASSERT_TRUE(record.status == Status::ok || record.status == Status::error) << record.cell.name;
      if (record.status == Status::ok) continue;
      ++errors;
      EXPECT_NE(record.reason.find("signal 9"), std::string::npos) << record.reason;
    }
    std::filesystem::remove(folder_ / "r.json");
  }
  EXPECT_EQ(killed, kills);
  EXPECT_GT(errors, 0);
  EXPECT_TRUE(children((folder_ / "mine.so").string()).empty());
}

TEST_F(ForeignProgram, ChildrenDieWithTheProgram) {
  std::filesystem::copy(NULLMARK_TRACKERS_LIBRARY, folder_ / "mine.so");
  configure(library("mine.so", "ratio", R"("isolate":true,"seconds":1000,"parameters":{"fault":"sleeps"})"));
  const std::string marker = (folder_ / "mine.so").string();
  const std::string command =
      fmt::format("cd '{}'; '{}' run c.json -o r.json --allow-foreign --no-timing 2>err & echo $! >pid; wait", folder_.string(),
                  NULLMARK_PROGRAM);
  std::thread program([&] { [[maybe_unused]] const int status = std::system(command.c_str()); });
  for (int i = 0; i < 500 && children(marker).empty(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_FALSE(children(marker).empty());
  ::kill(std::stoi(read("pid")), SIGKILL);
  program.join();
  for (int i = 0; i < 100 && !children(marker).empty(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_TRUE(children(marker).empty());
}

}  // namespace
}  // namespace nullmark
