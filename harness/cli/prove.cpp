#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "harness/analysis/check.h"
#include "harness/cli/commands.h"
#include "harness/cli/process.h"
#include "harness/cli/signals.h"
#include "harness/cli/watched_run.h"
#include "harness/foreign/consent.h"
#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/notice.h"
#include "harness/io/outputs.h"
#include "harness/io/results_json.h"
#include "harness/registry/components.h"
#include "harness/report/history_text.h"
#include "harness/report/prove_text.h"
#include "harness/run/battery.h"
#include "harness/run/medium_contract.h"
#include "harness/run/progress.h"
#include "harness/run/provenance.h"

namespace nullmark {
namespace {

/// Cells that are not done by then are left undecided.
constexpr double kSeconds = 50, kQuickSeconds = 15;

/// "ratio", or an object as in a configuration.
Json component_argument(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t\n");
  return first != std::string::npos && text[first] == '{' ? parse_json(text, "prove") : Json(text);
}

/// "uses: theory, event" in lines of a terminal's width.
std::string list_text(std::string line, const std::vector<std::string>& members) {
  constexpr std::size_t kWidth = 100;
  std::string text;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const std::string member = members[i] + (i + 1 < members.size() ? "," : "");
    if (line.size() + 1 + member.size() > kWidth) {
      text += line + "\n";
      line = " ";
    }
    line += " " + member;
  }
  return text + line + "\n";
}

/// Which optional members a tracker has: a slip in the name of one shows nowhere else.
std::string members_text(const std::string& type) {
  std::vector<std::string> used, others;
  for (const auto& [member, has] : Registry<EstimatorEntry>::instance().find(type)->members)
    (has ? used : others).push_back(member);
  // Of a tracker from outside there is no header with members.
  if (used.empty() && others.empty()) return "";
  if (used.empty()) used = {"no optional member"};
  return list_text("uses:", used) + list_text("may also state:", others);
}

/// Runs the battery and hands its results to `conclude`.
ExitCode run_battery(const ProveCommand& command, const Battery& battery, const std::function<ExitCode(RunRecord)>& conclude) {
  RunOptions options;
  options.timing = false;
  options.threads = command.threads;
  options.time_budget = command.quick ? kQuickSeconds : kSeconds;
  options.interrupted = &received_signal;
  RunContext context;
  context.command_line = command.command_line;
  context.threads = command.threads;
  context.selected = static_cast<std::size_t>(std::count(battery.selected.begin(), battery.selected.end(), true));
  std::optional<Progress> progress(std::in_place, context.selected, Progress::Lines::none);
  RunObserver observer;
  observer.cell_done = [&](const SharedRecord& record, std::size_t done, std::size_t total) {
    progress->cell_done(*record, done, total);
  };
  observer.progress = [&](const CellRecord& record, double fraction) { progress->cell_progress(record, fraction); };
  observer.timing = [](double, std::size_t) {};
  observer.cell_timed = [](const SharedRecord&) {};
  observer.verdict_share = observer.statistics_share = [](double) {};
  observer.warning = [&](const std::string& message) { progress->warning(message); };
  return watched_run(battery.plan, battery.selected, {}, options, observer, [&](std::vector<CellRecord> records) {
    progress.reset();
    RunRecord run = make_run_record(battery.plan, std::move(records), context);
    // Cells that the tracker's parameters do not allow were never to run.
    run.provenance["filter"] = "\"scenes that fit\"";
    return conclude(std::move(run));
  });
}

ExitCode prove_medium_alone(const ProveCommand& command, std::string& text) {
  bool kept = true;
  for (const ContractFinding& finding : check_medium(component_argument(command.medium))) {
    text += fmt::format("{} {}{}\n", finding.kept ? "PASS" : "FAIL", finding.what,
                        finding.detail.empty() ? "" : ": " + finding.detail);
    kept &= finding.kept;
  }
  return kept ? ExitCode::ok : ExitCode::bias_proven;
}

}  // namespace

ExitCode prove_command(const ProveCommand& command) {
  take_consent(command.allow_foreign);
  refuse_overwriting({}, {command.output});
  expect_new(command.output, command.force, kResultsBeginning);
  expect_threads(command.threads);
  std::string text;
  ExitCode medium_exit = ExitCode::ok;
  if (!command.medium.empty()) {
    medium_exit = prove_medium_alone(command, text);
    tell("medium {}\n{}\n", command.medium, text);
  }
  const std::string estimator = command.estimator.empty() ? "ratio" : command.estimator;
  const Battery battery = make_battery(component_argument(estimator),
                                       command.medium.empty() ? Json() : component_argument(command.medium), command.quick);
  catch_signals();
  return run_battery(command, battery, [&](RunRecord run) {
    const Summary summary = summarise(run);
    tell("estimator {}: {}\n{}{}", estimator, verdicts_counted(run), members_text(battery.plan.cells[0].estimator->type),
         scenes_text(run));
    for (const std::string& one : battery.left_out) tell("not tried: {}\n", one);
    tell("{}", findings_text(run));
    for (const std::string& one : summary.undecided_trackers) tell("{}\n", one);
    if (!summary.nothing_proven.empty()) tell("{}\n", summary.nothing_proven);
    if (!command.output.empty()) write_results(run, command.output);
    if (summary.exit == ExitCode::bias_proven || medium_exit != ExitCode::ok) return ExitCode::bias_proven;
    return summary.exit;
  });
}

}  // namespace nullmark
