#include "harness/analysis/history.h"

#include <fmt/format.h>

#include "harness/cli/commands.h"
#include "harness/io/fitted.h"
#include "harness/io/json_input.h"
#include "harness/io/notice.h"
#include "harness/io/results_json.h"
#include "harness/performance_gate/wall_time.h"
#include "harness/report/history_text.h"

namespace nullmark {

ExitCode history_command(const HistoryCommand& command) {
  if (command.results.size() < 2)
    throw InputError(command.results.at(0) + ": is alone; expected two results or more of one configuration");
  std::vector<RunRecord> runs;
  for (const std::string& file : command.results) runs.push_back(read_results_file(file));
  const std::vector<TimedBlock> blocks = command.blocks.empty() ? std::vector<TimedBlock>() : read_blocks(command.blocks);
  const History history = history_of(std::move(runs), command.results, blocks);
  if (!history.steps.empty() && command.json)
    fmt::print("{}\n", history_json(history).dump(2, ' ', false, Json::error_handler_t::replace));
  if (!history.steps.empty() && !command.json) tell("{}", wrapped(history_text(history, terminal_width()), terminal_width()));
  for (const std::string& warning : history.warnings) notice("nullmark: warning: {}\n", warning);
  if (history.steps.empty()) notice("nullmark: all files hold the same results; nothing to compare\n");
  return history.steps.empty() || history.steps.back().compared == 0 ? ExitCode::nothing_ran : ExitCode::ok;
}

}  // namespace nullmark
