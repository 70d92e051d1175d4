// Parts of a configuration, by their numbers or by what schedulers put into the environment.

#include "harness/cli/shard.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "harness/io/json_input.h"

namespace nullmark {
namespace {

/// Sets variables for as long as it lives.
class Environment {
 public:
  explicit Environment(const std::map<std::string, std::string>& variables) : variables_(variables) {
    for (const auto& [name, value] : variables_) ::setenv(name.c_str(), value.c_str(), 1);
  }
  ~Environment() {
    for (const auto& [name, value] : variables_) ::unsetenv(name.c_str());
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::map<std::string, std::string> variables_;
};

std::string refusal(const std::string& text) {
  try {
    return "taken as " + requested_shard(text).text();
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(Shard, IsToldByNumbers) {
  EXPECT_EQ(requested_shard("").text(), "1/1");
  EXPECT_EQ(requested_shard("2/4").text(), "2/4");
  for (const char* text : {"0/4", "5/4", "2", "2/", "/4", "a/b", "2/4/8", "auto/0", "auto/x"})
    EXPECT_NE(refusal(text).find("expected"), std::string::npos) << text;
}

TEST(Shard, IsToldBySchedulers) {
  struct Case {
    std::map<std::string, std::string> environment;
    const char *asked, *shard;
  };
  const Case cases[] = {
      {{{"SLURM_ARRAY_TASK_ID", "3"}, {"SLURM_ARRAY_TASK_MIN", "1"}, {"SLURM_ARRAY_TASK_COUNT", "4"}}, "auto", "3/4"},
      {{{"SLURM_ARRAY_TASK_ID", "8"},
        {"SLURM_ARRAY_TASK_MIN", "0"},
        {"SLURM_ARRAY_TASK_STEP", "4"},
        {"SLURM_ARRAY_TASK_COUNT", "3"}},
       "auto",
       "3/3"},
      {{{"SGE_TASK_ID", "5"}, {"SGE_TASK_FIRST", "1"}, {"SGE_TASK_LAST", "9"}, {"SGE_TASK_STEPSIZE", "2"}}, "auto", "3/5"},
      {{{"AWS_BATCH_JOB_ARRAY_INDEX", "0"}, {"AWS_BATCH_JOB_ARRAY_SIZE", "7"}}, "auto", "1/7"},
      {{{"JOB_COMPLETION_INDEX", "15"}}, "auto/16", "16/16"},
      {{{"OMPI_COMM_WORLD_RANK", "1"}, {"OMPI_COMM_WORLD_SIZE", "2"}}, "auto", "2/2"},
      {{{"PMI_RANK", "1"}, {"PMI_SIZE", "3"}}, "auto", "2/3"},
      {{{"PARALLEL_SEQ", "1"}}, "auto/2", "1/2"}};
  for (const Case& one : cases) {
    const Environment there(one.environment);
    EXPECT_EQ(refusal(one.asked), std::string("taken as ") + one.shard) << one.environment.begin()->first;
  }
}

TEST(Shard, IsRefusedWhereTheSchedulerDoesNotTell) {
  EXPECT_NE(refusal("auto").find("no task of Slurm"), std::string::npos);
  {
    const Environment outside(std::map<std::string, std::string>{{"SGE_TASK_ID", "undefined"}});
    EXPECT_NE(refusal("auto").find("no task of Slurm"), std::string::npos);
  }
  {
    const Environment uncounted(std::map<std::string, std::string>{{"JOB_COMPLETION_INDEX", "2"}});
    EXPECT_NE(refusal("auto").find("expected auto/N"), std::string::npos);
    EXPECT_NE(refusal("auto/2").find("expected one of them"), std::string::npos) << "a part that nobody runs would be missing";
  }
}

}  // namespace
}  // namespace nullmark
