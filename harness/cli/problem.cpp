#include "harness/run/problem.h"

#include "harness/cli/commands.h"
#include "harness/cli/process.h"
#include "harness/config/config.h"
#include "harness/io/notice.h"

namespace nullmark {

ExitCode problem_command(const ProblemCommand& command) {
  expect_threads(0);
  const Plan plan = read_configs(load_configs({command.config}));
  const std::vector<std::string> left_out =
      write_problem(plan, {command.output, command.resolution, command.with_answers, command.force});
  for (const std::string& line : left_out) notice("nullmark: warning: left out: {}\n", line);
  notice("problem: {}\n", command.output);
  return ExitCode::ok;
}

}  // namespace nullmark
