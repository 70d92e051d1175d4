// Whatever ends a run - a kill at any moment, a full disk, an interrupt - what it had finished is there when it is resumed, the
// results file is complete or absent, and the statistics are those of a run that nothing disturbed.
//
// NULLMARK_KILLS sets the number of random kills (50).

#include <fcntl.h>
#include <spawn.h>
#include <sys/mount.h>

#include <chrono>
#include <csignal>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "harness/model/exit_code.h"
#include "harness/run/journal.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

using Clock = std::chrono::steady_clock;

/// A run of the program under way.
class Process {
 public:
  Process(const std::filesystem::path& folder, std::vector<std::string> words, const std::vector<std::string>& environment = {}) {
    words.insert(words.begin(), NULLMARK_PROGRAM);
    std::vector<char*> arguments, variables;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    for (char** variable = environ; *variable; ++variable) variables.push_back(*variable);
    std::vector<std::string> own = environment;
    for (std::string& variable : own) variables.push_back(variable.data());
    variables.push_back(nullptr);
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_addchdir_np(&files, folder.c_str());
    constexpr int kNew = O_WRONLY | O_CREAT | O_TRUNC;
    ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, (folder / "out").c_str(), kNew, 0666);
    ::posix_spawn_file_actions_addopen(&files, STDERR_FILENO, (folder / "err").c_str(), kNew, 0666);
    if (::posix_spawn(&id_, NULLMARK_PROGRAM, &files, nullptr, arguments.data(), variables.data()) != 0)
      throw std::runtime_error("cannot start " NULLMARK_PROGRAM);
    ::posix_spawn_file_actions_destroy(&files);
  }
  ~Process() {
    if (id_ > 0) {
      signal(SIGKILL);
      wait();
    }
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void signal(int number) const { ::kill(id_, number); }

  /// Exit code, or 128 and the signal that ended it.
  int wait() {
    int status = 0;
    ::waitpid(std::exchange(id_, 0), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  pid_t id_ = 0;
};

class Kill : public ProgramTest {
 protected:
  // Tests of laws would take most of the time, and write nothing.
  static constexpr const char* kConfig = R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":{"type":"orthographic","width":8,"height":8},"verdict":{"laws":"never"},"samples_per_ray":@,
       "matrix":{"estimator":["ratio","delta","residual_ratio"],"medium":{"type":"linear","end":#}}}]})";

  void SetUp() override {
    ProgramTest::SetUp();
    configure("c.json", 4000);
    configure("small.json", 10);
    configure("few.json", 10, "1");
  }

  void configure(const std::string& name, int samples_per_ray, const std::string& ends = "[1,2,3,4,5,6,7,8]") {
    std::string text = kConfig;
    text.replace(text.find('@'), 1, std::to_string(samples_per_ray));
    text.replace(text.find('#'), 1, ends);
    write(name, text);
  }

  /// What a run that nothing disturbs tells.
  std::string undisturbed(const std::string& config) {
    EXPECT_EQ(run("run " + config + " -o whole.json"), 0) << read("err");
    return statistics_text(results("whole.json"));
  }

  bool exists(const std::string& name) const { return std::filesystem::exists(folder_ / name); }

  /// The finished cells of a run that was ended, each as the one line that holds it: from its journal or its results.
  std::set<std::string> finished(const std::string& name) const {
    std::set<std::string> cells;
    if (exists(name))
      for (const CellRecord& cell : results(name).cells)
        if (cell.status == Status::ok) cells.insert(cell_json(cell).dump());
    if (const std::string journal = Journal::path_for(name); exists(journal)) {
      std::istringstream lines(read(journal));
      std::string line;
      for (int number = 0; std::getline(lines, line) && !lines.eof(); ++number)
        if (number > 0) cells.insert(line);
    }
    return cells;
  }

  void expect_kept(const std::set<std::string>& before, const std::set<std::string>& after) const {
    for (const std::string& cell : before) EXPECT_TRUE(after.count(cell)) << "lost or changed: " << cell.substr(0, 200);
  }

  /// Resumes to the end; everything finished before is kept and the whole is what it should be, with nothing left over.
  void expect_recovers(const std::string& config, const std::string& name, const std::string& expected) {
    const std::set<std::string> before = finished(name);
    ASSERT_EQ(run("run " + config + " -o " + name + " --resume"), 0) << read("err");
    expect_kept(before, finished(name));
    EXPECT_EQ(statistics_text(results(name)), expected);
    EXPECT_FALSE(exists(Journal::path_for(name)));
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      EXPECT_NE(entry.path().extension(), ".tmp") << entry.path();
  }

  std::vector<std::string> faulty(const std::string& action, int step) const {
    return {"LD_PRELOAD=" NULLMARK_FAULTY_DISK, "FAULTY_DISK_FOLDER=" + std::filesystem::canonical(folder_).string(),
            fmt::format("FAULTY_DISK={} {}", action, step)};
  }
};

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
}

TEST_F(Kill, FullStandardOutputIsAnError) {
  const std::string command =
      fmt::format("cd '{}' && '{}' run small.json -o - >/dev/full 2>err", folder_.string(), NULLMARK_PROGRAM);
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), static_cast<int>(ExitCode::internal_error));
  EXPECT_NE(read("err").find("No space left on device"), std::string::npos) << read("err");
}

}  // namespace
}  // namespace nullmark
