#include "harness/run/merge.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/cli/commands.h"
#include "harness/io/file_io.h"
#include "harness/io/notice.h"
#include "harness/io/outputs.h"
#include "harness/io/results_json.h"
#include "harness/run/judge_parts.h"

namespace nullmark {
namespace {

/// How to go on where verdicts ask for samples that no part holds.
void tell_open(const std::vector<std::string>& cells, const std::string& output) {
  constexpr std::size_t kMost = 10;
  notice("nullmark: {} cells need samples that the parts do not hold; `nullmark run CONFIG --resume -o {}` draws on:\n",
         cells.size(), output);
  for (std::size_t i = 0; i < std::min(cells.size(), kMost); ++i) notice("  {}\n", cells[i]);
  if (cells.size() > kMost) notice("  and {} more\n", cells.size() - kMost);
}

}  // namespace

ExitCode merge_command(const MergeCommand& command) {
  const bool to_stdout = command.output == "-";
  refuse_overwriting(command.parts, {command.output});
  expect_new(command.output, command.force, kResultsBeginning);
  std::vector<RunRecord> parts;
  for (const std::string& file : command.parts) parts.push_back(read_results(read_file(file), file));
  RunRecord merged = merge_results(parts, command.parts, builds_of(command.builds));
  std::vector<RunRecord>().swap(parts);
  const std::vector<std::string> open = judge_parts(merged, command.output, to_stdout ? "" : command.output);
  if (to_stdout)
    write_results(merged, [](std::string_view part) { fmt::print("{}", part); });
  else
    write_results(merged, command.output);
  if (!open.empty()) tell_open(open, to_stdout ? "RESULTS" : command.output);
  return ExitCode::ok;
}

}  // namespace nullmark
