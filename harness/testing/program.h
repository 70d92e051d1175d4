#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "harness/io/file_io.h"
#include "harness/io/results_json.h"

namespace nullmark {

/// Tests of the program itself, in a folder of their own: several copies of the tests may run on one machine.
class ProgramTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const ::testing::TestInfo& test = *::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) /
              fmt::format("nullmark_{}_{}_{}", test.test_suite_name(), test.name(), ::getpid());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  std::string read(const std::string& name) const { return read_file((folder_ / name).string()); }
  RunRecord results(const std::string& name) const { return read_results(read(name), name); }

  /// Exit code; output goes to the files "out" and "err".
  int run(const std::string& arguments, const char* program = NULLMARK_PROGRAM, const std::string& input = "/dev/null") const {
    const std::string command = fmt::format("cd '{}' && '{}' {} >out 2>err <{}", folder_.string(), program, arguments, input);
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  std::filesystem::path folder_;
};

}  // namespace nullmark
