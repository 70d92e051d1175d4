// A power cut at any moment leaves a valid results file or none, and a run that can be resumed: at every step that a run takes on
// the disk, with what no sync had put there lost, reordered or torn (power_cut.h).

#include "harness/testing/power_cut.h"

#include <algorithm>

#include "harness/testing/ended_run.h"

namespace nullmark {
namespace {

class PowerCut : public EndedRunTest {
 protected:
  static constexpr const char* kResults = "r.json";

  void SetUp() override {
    EndedRunTest::SetUp();
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "sanitizers want to be preloaded first";
#endif
    expected_ = undisturbed("few.json");
  }

  void put(const DiskFiles& files) const {
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      if (entry.path().filename().string().rfind(kResults, 0) == 0) std::filesystem::remove(entry.path());
    for (const auto& [name, bytes] : files) std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }

  DiskFiles files() const {
    DiskFiles found;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      if (const std::string name = entry.path().filename().string(); name.rfind(kResults, 0) == 0) found[name] = read(name);
    return found;
  }

  /// Runs on these files, and tells the steps.
  std::vector<DiskStep> steps_of_run(const DiskFiles& before, const std::string& option) const {
    put(before);
    const std::filesystem::path log = folder_ / "log";
    std::filesystem::remove(log);
    std::vector<std::string> environment = faulty("log", 0);
    environment.push_back("FAULTY_DISK_LOG=" + log.string());
    std::vector<std::string> words = {"run", "few.json", "-o", kResults};
    if (!option.empty()) words.push_back(option);
    EXPECT_EQ(Process(folder_, words, environment).wait(), 0) << read("err");
    return read_disk_steps(log, kResults, before);
  }

  /// Cells that a sync has put on the disk, each its line.  The name of their file must then be there too.
  std::set<std::string> settled(const DiskFiles& before, const std::vector<DiskStep>& steps, std::size_t count) const {
    std::vector<Kept> kept(count, Kept::all);
    for (const std::size_t i : unsynced_steps(steps, count))
      if (steps[i].of_file()) kept[i] = Kept::none;
    for (std::size_t i = 0; i < count; ++i)
      if (steps[i].what == "unlink") kept[i] = Kept::none;
    put(files_after(before, steps, kept));
    return finished(kResults);
  }

  /// The number of states that cuts leave, each resumed to the end.
  std::size_t survive_every_cut(const DiskFiles& before, const std::string& option) {
    const std::vector<DiskStep> steps = steps_of_run(before, option);
    std::size_t states = 0;
    for (std::size_t count = 0; count <= steps.size(); ++count) {
      const std::set<std::string> kept = settled(before, steps, count);
      for (const DiskFiles& state : states_after_cut(before, steps, count)) {
        SCOPED_TRACE(fmt::format("after {} steps, state {}", count, states));
        put(state);
        ++states;
        if (exists(kResults)) {
          EXPECT_NO_THROW(results(kResults));
        }
        expect_kept(kept, finished(kResults));
        expect_recovers("few.json", kResults, expected_);
        if (HasFailure()) return states;
      }
    }
    fmt::print("{} steps on the disk, {} states after cuts\n", steps.size(), states);
    return states;
  }

  std::string expected_;
};

TEST_F(PowerCut, OfARun) { EXPECT_GT(survive_every_cut({}, ""), 30u); }

/// The journal of a run that a kill has ended in the middle of a line: a head and at least one cell before it.
TEST_F(PowerCut, OfAResumedRun) {
  DiskFiles torn;
  const std::string journal = Journal::path_for(kResults);
  const auto lines = [&] { return std::count(torn[journal].begin(), torn[journal].end(), '\n'); };
  int whole = 0;
  for (int step = 1; lines() < 2 || torn.at(journal).back() == '\n'; ++step) {
    put({});
    const int ended = Process(folder_, {"run", "few.json", "-o", kResults}, faulty("tear", step)).wait();
    if (ended == 0) {
      // Cells that were done together were written together, and the cut fell between them: another run writes them apart.
      ASSERT_LT(++whole, 100) << "never torn";
      step = 0;
      continue;
    }
    ASSERT_EQ(ended, 128 + SIGKILL);
    torn = files();
  }
  EXPECT_GT(survive_every_cut(torn, "--resume"), 15u);
}

/// A run that was killed between the sync of its journal and that of the folder: the next one owes the name.
TEST_F(PowerCut, OfARunWhoseJournalHasNoDurableName) {
  put({});
  ASSERT_EQ(Process(folder_, {"run", "few.json", "-o", kResults}, faulty("kill", 3)).wait(), 128 + SIGKILL);
  const DiskFiles begun = files();
  ASSERT_EQ(begun.at(Journal::path_for(kResults)).back(), '\n');
  const std::vector<DiskStep> steps = steps_of_run(begun, "--resume");
  const auto first = [&](const char* what) {
    return std::find_if(steps.begin(), steps.end(), [&](const DiskStep& step) { return step.what == what; });
  };
  EXPECT_LT(first("sync_folder"), first("sync"));
}

/// Old results with other numbers: after any cut one of the two is there, whole.
TEST_F(PowerCut, OfARunThatReplaces) {
  configure("other.json", 20, "1");
  ASSERT_EQ(run(std::string("run other.json -o ") + kResults), 0);
  const DiskFiles before = files();
  const std::vector<DiskStep> steps = steps_of_run(before, "--force");
  const std::string after = read(kResults);
  ASSERT_NE(before.at(kResults), after);
  std::size_t old_ones = 0, new_ones = 0;
  for (std::size_t count = 0; count <= steps.size(); ++count)
    for (const DiskFiles& state : states_after_cut(before, steps, count)) {
      ASSERT_TRUE(state.count(kResults));
      old_ones += state.at(kResults) == before.at(kResults);
      new_ones += state.at(kResults) == after;
      EXPECT_TRUE(state.at(kResults) == before.at(kResults) || state.at(kResults) == after) << "after " << count << " steps";
      put(state);
      EXPECT_EQ(run(std::string("run few.json -o ") + kResults + " --force"), 0) << read("err");
      EXPECT_EQ(statistics_text(results(kResults)), expected_);
    }
  EXPECT_GT(old_ones, 0u);
  EXPECT_GT(new_ones, 0u);
}

}  // namespace
}  // namespace nullmark
