// Whatever ends a run - a kill at any moment, a full disk, an interrupt - what it had finished is there when it is resumed, the
// results file is complete or absent, and the statistics are those of a run that nothing disturbed.
//
// NULLMARK_KILLS sets the number of random kills (50).

#include <sys/mount.h>

#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include "harness/model/exit_code.h"
#include "harness/testing/ended_run.h"

namespace nullmark {
namespace {

using Clock = std::chrono::steady_clock;

class Kill : public EndedRunTest {};

TEST_F(Kill, RandomMoments) {
  const char* const wish = std::getenv("NULLMARK_KILLS");
  const int wanted = wish ? std::atoi(wish) : 50;
  const auto begin = Clock::now();
  const std::string expected = undisturbed("c.json");
  const std::chrono::duration<double> whole = Clock::now() - begin;
  std::mt19937 random(2024);
  std::uniform_real_distribution<double> part(0, 1);
  int kills = 0, recovered = 0;
  while (kills < wanted) {
    std::filesystem::remove(folder_ / "r.json");
    std::set<std::string> before;
    // A run, killed up to five times on its way.
    int in_a_row = 0;
    for (; in_a_row < 5 && kills < wanted; ++in_a_row) {
      Process process(folder_, {"run", "c.json", "-o", "r.json", "--resume"});
      std::this_thread::sleep_for(part(random) * whole);
      process.signal(SIGKILL);
      if (process.wait() != 128 + SIGKILL) break;
      ++kills;
      const std::set<std::string> after = finished("r.json");
      expect_kept(before, after);
      before = after;
    }
    expect_recovers("c.json", "r.json", expected);
    if (!HasFailure()) recovered += in_a_row;
  }
  RecordProperty("recovered", fmt::format("{} of {}", recovered, kills));
  fmt::print("{} of {} kills recovered\n", recovered, kills);
}

/// Every step that a run takes on the disk is one it dies before, and one it dies in.
TEST_F(Kill, EveryStepOnTheDisk) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers want to be preloaded first";
#endif
  const std::string expected = undisturbed("few.json");
  for (const char* action : {"kill", "tear"}) {
    int step = 1;
    for (;; ++step) {
      std::filesystem::remove(folder_ / "r.json");
      SCOPED_TRACE(fmt::format("{} {}", action, step));
      const int code = Process(folder_, {"run", "few.json", "-o", "r.json"}, faulty(action, step)).wait();
      if (code == 0) break;
      ASSERT_EQ(code, 128 + SIGKILL) << read("err");
      expect_recovers("few.json", "r.json", expected);
    }
    // Header, three cells, results: a write and a sync each, and the rename and the removals.
    EXPECT_GT(step, 12) << action;
  }
}

TEST_F(Kill, FullAtEveryWrite) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers want to be preloaded first";
#endif
  const std::string expected = undisturbed("few.json");
  int step = 1;
  for (;; ++step) {
    std::filesystem::remove(folder_ / "r.json");
    SCOPED_TRACE(fmt::format("full {}", step));
    const int code = Process(folder_, {"run", "few.json", "-o", "r.json"}, faulty("full", step)).wait();
    if (code == 0) break;
    EXPECT_EQ(code, static_cast<int>(ExitCode::input_error));
    EXPECT_NE(read("err").find("r.json"), std::string::npos) << read("err");
    EXPECT_NE(read("err").find("No space left on device"), std::string::npos) << read("err");
    EXPECT_FALSE(exists("r.json"));
    expect_recovers("few.json", "r.json", expected);
  }
  EXPECT_GT(step, 5);
}

/// A file system of the size; tells whether this process may make one.
class SmallDisk {
 public:
  SmallDisk(std::filesystem::path folder, const char* options, unsigned long flags = 0) : folder_(std::move(folder)) {
    std::filesystem::create_directories(folder_);
    mounted_ = ::mount("tmpfs", folder_.c_str(), "tmpfs", flags, options) == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount(folder_.c_str());
  }
  bool mounted() const { return mounted_; }
  void remount(const char* options, unsigned long flags = 0) const {
    ASSERT_EQ(::mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT | flags, options), 0);
  }

 private:
  std::filesystem::path folder_;
  bool mounted_ = false;
};

TEST_F(Kill, SmallDiskFillsUp) {
  const std::string expected = undisturbed("small.json");
  const SmallDisk disk(folder_ / "disk", "size=16k");
  if (!disk.mounted()) GTEST_SKIP() << "no right to mount: " << std::strerror(errno);
  EXPECT_EQ(run("run small.json -o disk/r.json"), static_cast<int>(ExitCode::input_error));
  EXPECT_NE(read("err").find("No space left on device"), std::string::npos) << read("err");
  EXPECT_FALSE(exists("disk/r.json"));
  EXPECT_FALSE(finished("disk/r.json").empty()) << "nothing was kept";
  disk.remount("size=10m");
  expect_recovers("small.json", "disk/r.json", expected);
}

TEST_F(Kill, FolderThatCannotBeWritten) {
  const SmallDisk disk(folder_ / "disk", "size=1m", MS_RDONLY);
  if (!disk.mounted()) {
    if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere, and there is no right to mount: " << std::strerror(errno);
    std::filesystem::permissions(folder_ / "disk", std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  }
  for (const char* option : {"", " --force", " --resume"}) {
    EXPECT_EQ(run(std::string("run small.json -o disk/r.json") + option), static_cast<int>(ExitCode::input_error));
    const std::string error = read("err");
    EXPECT_EQ(error.rfind("nullmark: disk/r.json", 0), 0u) << error;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
  }
}

TEST_F(Kill, SecondRunOnTheSameResultsIsRefused) {
  configure("c.json", 40000);
  const std::string expected = undisturbed("c.json");
  Process first(folder_, {"run", "c.json", "-o", "r.json"});
  while (!exists("r.json.journal")) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  for (const char* option : {"", " --force", " --resume"}) {
    const std::string command =
        fmt::format("cd '{}' && '{}' run c.json -o r.json{} >out2 2>err2", folder_.string(), NULLMARK_PROGRAM, option);
    const int status = std::system(command.c_str());
    EXPECT_EQ(WEXITSTATUS(status), static_cast<int>(ExitCode::input_error));
    EXPECT_EQ(read("err2"), "nullmark: r.json.journal: another run is writing these results; wait for it or give another -o\n");
  }
  EXPECT_EQ(first.wait(), 0) << read("err");
  EXPECT_EQ(statistics_text(results("r.json")), expected);
}

TEST_F(Kill, InterruptsOnceAndTwice) {
  configure("c.json", 20000);
  const std::string expected = undisturbed("c.json");
  for (const bool twice : {false, true}) {
    SCOPED_TRACE(twice);
    std::filesystem::remove(folder_ / "r.json");
    Process process(folder_, {"run", "c.json", "-o", "r.json"});
    while (finished("r.json").empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::set<std::string> before = finished("r.json");
    process.signal(SIGINT);
    if (twice) {
      // Two of a signal that wait at once are one.
      while (read("err").empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      process.signal(SIGINT);
    }
    EXPECT_EQ(process.wait(), static_cast<int>(ExitCode::interrupted));
    if (!twice) {
      EXPECT_TRUE(exists("r.json"));
    }
    expect_kept(before, finished("r.json"));
    expect_recovers("c.json", "r.json", expected);
  }
}

TEST_F(Kill, DevicesAreNotReplaced) {
  // By its own name, so that a fault of the program could not harm the machine's.
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0666), 0);
  for (const char* command : {"run small.json -o pipe", "run small.json -o pipe --force", "merge whole.json -o pipe --force"}) {
    if (!exists("whole.json")) undisturbed("small.json");
    EXPECT_EQ(run(command), static_cast<int>(ExitCode::input_error)) << command;
    EXPECT_EQ(read("err"), "nullmark: pipe: is not a regular file; expected the path of a file, or - for standard output\n");
    EXPECT_TRUE(std::filesystem::is_fifo(folder_ / "pipe")) << command;
    EXPECT_FALSE(exists("pipe.journal"));
  }
  EXPECT_EQ(run("make-volume pipe --resolution 8 --force"), static_cast<int>(ExitCode::input_error));
  EXPECT_TRUE(std::filesystem::is_fifo(folder_ / "pipe"));
  std::ofstream(folder_ / "kept") << "kept";
  std::filesystem::create_symlink("kept", folder_ / "link.vdb");
  EXPECT_EQ(run("make-volume link.vdb --resolution 8 --force"), static_cast<int>(ExitCode::input_error));
  EXPECT_EQ(read("kept"), "kept");
}

TEST_F(Kill, PicturesReplaceNoPipeAndNoTargetOfALink) {
  std::ofstream(folder_ / "p.json") << R"({"nullmark":"config/2","name":"p","timing":{"enabled":false},"experiments":[{"name":"e",
    "rays":{"type":"orthographic","width":2,"height":2},"samples_per_ray":2,"verdict":{"enabled":false},"images":true,
    "matrix":{"estimator":"ratio","medium":"linear"}}]})";
  ASSERT_EQ(run("run p.json -o p.r.json"), 0) << read("err");
  std::filesystem::path layers;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "p.r.images"))
    if (entry.path().extension() == ".exr") layers = entry.path();
  std::filesystem::remove(layers);
  ASSERT_EQ(::mkfifo(layers.c_str(), 0666), 0);
  EXPECT_EQ(run("run p.json -o p.r.json --force"), 0);
  EXPECT_NE(read("err").find("is not a regular file"), std::string::npos) << read("err");
  EXPECT_TRUE(std::filesystem::is_fifo(layers));
  std::filesystem::remove(layers);
  std::ofstream(folder_ / "kept") << "kept";
  std::filesystem::create_symlink(folder_ / "kept", layers);
  EXPECT_EQ(run("run p.json -o p.r.json --force"), 0);
  EXPECT_NE(read("err").find("is a link"), std::string::npos) << read("err");
  EXPECT_EQ(read("kept"), "kept");
}

TEST_F(Kill, FullStandardOutputIsAnError) {
  const std::string command =
      fmt::format("cd '{}' && '{}' run small.json -o - >/dev/full 2>err", folder_.string(), NULLMARK_PROGRAM);
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), static_cast<int>(ExitCode::internal_error));
  EXPECT_NE(read("err").find("No space left on device"), std::string::npos) << read("err");
}

}  // namespace
}  // namespace nullmark
