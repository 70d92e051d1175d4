#include "harness/run/merge.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string_view>

#include "harness/cli/commands.h"
#include "harness/io/json_input.h"
#include "harness/io/notice.h"
#include "harness/io/outputs.h"
#include "harness/io/results_json.h"
#include "harness/io/text.h"
#include "harness/run/judge_parts.h"

namespace nullmark {
namespace {

/// How to go on where verdicts ask for samples that no part holds.
void tell_open(const std::vector<std::string>& cells, const std::string& output) {
  constexpr std::size_t kMost = 10;
  notice("nullmark: {} cells need samples that these results do not hold; `nullmark run CONFIG --resume -o {}` draws them:\n",
         cells.size(), output);
  for (std::size_t i = 0; i < std::min(cells.size(), kMost); ++i) notice("  {}\n", cells[i]);
  if (cells.size() > kMost) notice("  and {} more\n", cells.size() - kMost);
}

/// Which shards are missing, where all parts are shards of as many.
void tell_missing(const std::vector<RunRecord>& parts) {
  std::set<std::string> there;
  std::size_t count = 0;
  for (const RunRecord& part : parts) {
    const auto at = part.provenance.find("shard");
    const Json told = at == part.provenance.end() ? Json() : known_json(at->second);
    const std::string shard = told.is_string() ? told.get<std::string>() : "";
    const auto of = whole_number(std::string_view(shard).substr(std::min(shard.size(), shard.find('/') + 1)));
    if (!of || (count != 0 && *of != count)) return;
    count = *of;
    there.insert(shard);
  }
  for (std::size_t i = 1; i <= count; ++i)
    if (const std::string shard = fmt::format("{}/{}", i, count); !there.contains(shard))
      notice("nullmark: warning: shard {} is missing; run it and merge all again\n", shard);
}

}  // namespace

ExitCode merge_command(const MergeCommand& command) {
  const bool to_stdout = command.output == "-";
  refuse_overwriting(command.parts, {command.output});
  expect_new(command.output, command.force, kResultsBeginning);
  std::vector<RunRecord> parts;
  for (const std::string& file : command.parts) parts.push_back(read_results_file(file));
  tell_missing(parts);
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
