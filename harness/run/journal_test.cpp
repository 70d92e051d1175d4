#include "harness/run/journal.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/results_json.h"
#include "harness/testing/record_examples.h"

namespace nullmark {
namespace {

class JournalTest : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::remove(path_); }
  void TearDown() override { std::filesystem::remove(path_); }

  std::string open_error(const std::string& hash, Journal::Mode mode) {
    try {
      Journal journal(results_, hash, mode);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }

  /// Leaves a journal of the given cells behind, as a killed run does.
  void leave(const std::vector<CellRecord>& cells) {
    Journal journal(results_, "hash", Journal::Mode::fresh);
    for (const CellRecord& cell : cells) journal.append(cell);
  }

  const std::string results_ =
      ::testing::TempDir() + "nullmark_" + ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".json";
  const std::string path_ = Journal::path_for(results_);
  const std::vector<CellRecord> cells_ = example_results().cells;
};

TEST_F(JournalTest, ResumesWithTheLastLineOfEachCell) {
  CellRecord untimed = cells_[0];
  untimed.time.reset();
  leave({untimed, cells_[1], cells_[0]});
  Journal journal(results_, "hash", Journal::Mode::resume);
  ASSERT_EQ(journal.cells().size(), 2u);
  EXPECT_EQ(cell_json(journal.cells()[0]), cell_json(cells_[0]));
  EXPECT_EQ(cell_json(journal.cells()[1]), cell_json(cells_[1]));
}

/// Neither a link, whose target would be emptied, nor a pipe, which would be waited for.
TEST_F(JournalTest, IsAFileOfItsOwn) {
  const std::string target = results_ + ".victim";
  std::ofstream(target) << "precious";
  std::filesystem::create_symlink(target, path_);
  for (const Journal::Mode mode : {Journal::Mode::fresh, Journal::Mode::resume, Journal::Mode::overwrite})
    EXPECT_EQ(open_error("hash", mode), path_ + ": is a link, and a journal is a file; remove it or give another -o");
  EXPECT_EQ(read_file(target), "precious");
  std::filesystem::remove(target);
  std::filesystem::remove(path_);
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  for (const Journal::Mode mode : {Journal::Mode::fresh, Journal::Mode::resume, Journal::Mode::overwrite})
    EXPECT_EQ(open_error("hash", mode), path_ + ": is not a regular file; remove it or give another -o");
}

TEST_F(JournalTest, LeavesAnotherFileOfItsNameAlone) {
  for (const char* text :
       {"precious notes", "precious\nnotes\n", "{\"mine\":1}", "{\"nullmark\":\"config/2\",\"experiments\":[]}\n"})
    for (const Journal::Mode mode : {Journal::Mode::fresh, Journal::Mode::resume, Journal::Mode::overwrite}) {
      std::ofstream(path_, std::ios::trunc) << text;
      EXPECT_NE(open_error("hash", mode).find(path_ + ": is not the journal of a run"), std::string::npos) << text;
      EXPECT_EQ(read_file(path_), text);
    }
}

TEST_F(JournalTest, DropsATornLastLineAndGoesOnAfterIt) {
  leave({cells_[0], cells_[1]});
  const std::string whole = read_file(path_);
  // Whatever byte the kill came at.
  const std::size_t second = whole.rfind('\n', whole.size() - 2) + 1;
  for (const std::size_t length : {second + 1, second + 40, whole.size() - 1}) {
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << whole.substr(0, length);
    {
      Journal journal(results_, "hash", Journal::Mode::resume);
      EXPECT_EQ(journal.cells().size(), 1u) << length;
      journal.append(cells_[2]);
    }
    const Journal again(results_, "hash", Journal::Mode::resume);
    ASSERT_EQ(again.cells().size(), 2u) << length;
    EXPECT_EQ(again.cells()[1].cell.id, cells_[2].cell.id);
  }
}

TEST_F(JournalTest, SkipsALineThatIsNoCellWithAWarning) {
  leave({cells_[0], cells_[1]});
  const std::string text = read_file(path_);
  const std::size_t second = text.find('\n') + 1, third = text.find('\n', second) + 1;
  std::string damaged = text;
  damaged[damaged.find("\"id\"")] = '?';
  const std::string among = text.substr(0, third) + "[1/2] a line of progress: ok\n" + text.substr(third);
  for (const auto& [content, kept, line] : {std::tuple{damaged, 1u, ":2"}, std::tuple{among, 2u, ":3"}}) {
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << content;
    ::testing::internal::CaptureStderr();
    const Journal journal(results_, "hash", Journal::Mode::resume);
    const std::string warning = ::testing::internal::GetCapturedStderr();
    EXPECT_EQ(journal.cells().size(), kept);
    EXPECT_NE(warning.find("warning: " + path_ + line), std::string::npos) << warning;
    EXPECT_EQ(std::count(warning.begin(), warning.end(), '\n'), 1) << warning;
  }
}

/// Figures that contradict each other would make the results unreadable.
TEST_F(JournalTest, SkipsACellThatDoesNotFitItself) {
  CellRecord edited = cells_[0];
  *edited.channel[0].mean += 1;
  leave({edited, cells_[1]});
  const Journal journal(results_, "hash", Journal::Mode::resume);
  ASSERT_EQ(journal.cells().size(), 1u);
  EXPECT_EQ(journal.cells()[0].cell.id, cells_[1].cell.id);
}

TEST_F(JournalTest, RefusesADamagedHead) {
  leave({cells_[0]});
  const std::string text = read_file(path_);
  std::ofstream(path_, std::ios::binary | std::ios::trunc) << "[1/2] a line of progress: ok\n" << text;
  EXPECT_NE(open_error("hash", Journal::Mode::resume).find(path_ + ": is not the journal of a run"), std::string::npos);
  std::ofstream(path_, std::ios::binary | std::ios::trunc) << text.substr(0, 20) << "damaged\n" << text;
  const std::string error = open_error("hash", Journal::Mode::resume);
  EXPECT_EQ(error.rfind(path_ + ":1", 0), 0u) << error;
  EXPECT_TRUE(error.ends_with("; the journal is damaged: --force starts again")) << error;
}

TEST_F(JournalTest, RefusesAnotherConfiguration) {
  leave({cells_[0]});
  EXPECT_NE(open_error("other", Journal::Mode::resume).find("another configuration"), std::string::npos);
  EXPECT_NE(open_error("hash", Journal::Mode::fresh).find("--resume"), std::string::npos);
  EXPECT_EQ(open_error("other", Journal::Mode::overwrite), "no error");
}

TEST_F(JournalTest, LocksOutASecondRun) {
  const Journal journal(results_, "hash", Journal::Mode::fresh);
  for (const auto mode : {Journal::Mode::fresh, Journal::Mode::resume, Journal::Mode::overwrite})
    EXPECT_NE(open_error("hash", mode).find("another run"), std::string::npos);
}

TEST_F(JournalTest, StaysOnlyWhileItHoldsCells) {
  leave({});
  EXPECT_FALSE(std::filesystem::exists(path_));
  leave({cells_[0]});
  EXPECT_TRUE(std::filesystem::exists(path_));
  Journal journal(results_, "hash", Journal::Mode::resume);
  journal.remove();
  EXPECT_FALSE(std::filesystem::exists(path_));
}

}  // namespace
}  // namespace nullmark
