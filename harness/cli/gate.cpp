#include <fmt/format.h>

#include <filesystem>

#include "harness/cli/commands.h"
#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/notice.h"
#include "harness/io/outputs.h"
#include "harness/performance_gate/baseline.h"
#include "harness/performance_gate/report.h"
#include "harness/performance_gate/required.h"
#include "harness/performance_gate/wall_time.h"
#include "harness/report/junit.h"

namespace nullmark {
namespace {

void write_files(const GateCommand& command, const PerformanceReport& report) {
  if (!command.junit.empty()) write_atomically(command.junit, performance_junit(report));
  if (!command.markdown.empty()) write_atomically(command.markdown, performance_markdown(report));
}

void deliver(const GateCommand& command, const PerformanceReport& report) {
  write_files(command, report);
  tell("{}", performance_text(report));
}

/// Says what stands in the way, on the terminal and in the files.
ExitCode without_baseline(const GateCommand& command, const Counts& fresh, const std::string& remedy) {
  PerformanceReport report;
  report.name = fresh.name;
  report.before = command.baseline;
  report.after = fresh.source;
  report.missing = {remedy};
  write_files(command, report);
  notice("nullmark: {}\n", remedy);
  return report.exit();
}

/// The tiers that `--require` names, if it is there.
std::optional<std::vector<Tier>> required_tiers(const GateCommand& command) {
  if (command.require.empty()) return std::nullopt;
  std::vector<Tier> tiers;
  for (const std::string& word : command.require) tiers.push_back(required_tier(word));
  return tiers;
}

/// Makes the results the baseline of their configuration and build, and shows what that changes.
ExitCode update(const GateCommand& command, const Counts& fresh, std::optional<Real> threshold) {
  if (fresh.baseline) throw InputError(command.results + ": is a baseline itself; expected results of `nullmark run`");
  if (fresh.cells.empty())
    throw InputError(command.results + ": holds no cell that was sampled; expected at least one, or the baseline guards nothing");
  if (!fresh.build.known())
    throw InputError(command.results + ": does not say what it was built for; run the configuration again with this program");
  const std::filesystem::path path(command.baseline);
  const bool folder = std::filesystem::is_directory(path) || path.extension() != ".json";
  const std::string file = folder ? (path / baseline_file_name(fresh)).string() : command.baseline;
  std::string text = baseline_text(fresh);
  if (std::filesystem::exists(file)) {
    const Counts before = read_counts(file);
    if (!before.baseline || before.name != fresh.name || !(before.build == fresh.build))
      throw InputError(fmt::format("{}: holds {}, which --update does not replace; name the folder of the baselines", file,
                                   before.baseline ? "the baseline of another configuration or build" : "results"));
    text = baseline_text(refreshed(before, fresh));
    deliver(command, compare_counts(before, fresh, threshold));
  }
  if (const std::filesystem::path parent = std::filesystem::path(file).parent_path(); !parent.empty())
    std::filesystem::create_directories(parent);
  write_atomically(file, text);
  tell("baseline: {}\n", file);
  return ExitCode::ok;
}

}  // namespace

ExitCode gate_command(const GateCommand& command) {
  refuse_overwriting_others({command.results, command.baseline, command.blocks},
                            {{command.junit, kJunitBeginning}, {command.markdown, "### nullmark gate"}});
  const std::optional<std::vector<Tier>> required = required_tiers(command);
  const Counts fresh = read_counts(command.results);
  std::optional<Real> threshold;
  if (command.threshold) threshold = *command.threshold / 100;
  if (command.update) return update(command, fresh, threshold);

  std::string remedy;
  const std::optional<Counts> before = std::filesystem::is_directory(command.baseline)
                                           ? find_baseline(command.baseline, fresh, remedy)
                                           : std::optional(read_counts(command.baseline));
  if (!before) return without_baseline(command, fresh, remedy);
  PerformanceReport report = compare_counts(*before, fresh, threshold);
  if (!command.blocks.empty()) {
    const std::vector<GateRow> rows = compare_wall_time(read_blocks(command.blocks), threshold, command.quiet_machine);
    report.rows.insert(report.rows.end(), rows.begin(), rows.end());
  }
  report.missing = missing_tiers(report, *before, fresh, required);
  deliver(command, report);
  return report.exit();
}

}  // namespace nullmark
