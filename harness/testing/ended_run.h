#pragma once

#include <fcntl.h>
#include <spawn.h>

#include <csignal>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include "harness/run/journal.h"
#include "harness/testing/program.h"

namespace nullmark {

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

/// Tests of runs that are ended on their way.
class EndedRunTest : public ProgramTest {
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
        if (number > 0 && Json::accept(line)) cells.insert(line);
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

}  // namespace nullmark
