#include "harness/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>

#include "harness/cell_names.h"
#include "harness/findings_text.h"
#include "harness/json_input.h"
#include "harness/junit.h"
#include "harness/results_json.h"
#include "harness/table.h"
#include "harness/verdict.h"
#include "harness/verdict_json.h"
#include "harness/words.h"

namespace nullmark {
namespace {

/// How many cells of a kind have each mark: " (3 by pilot, 1 own mean)"; empty where none has one.
std::string marks_among(const RunRecord& run, Kind kind) {
  std::map<Mark, std::size_t> counts;
  for (const CellRecord& record : run.cells)
    if (kind_of(record) == kind)
      for (const Mark mark : marks_of(record)) ++counts[mark];
  std::string text;
  for (const auto& [mark, count] : counts) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, mark_name(mark));
  return text.empty() ? "" : fmt::format(" ({})", text);
}

std::string counts(const RunRecord& run, const Summary& s) {
  return fmt::format(
      "{} PASS{}, {} FAIL{}, {} INCONCLUSIVE as planned{}, {} INCONCLUSIVE{}, {} VIOLATED, {} errors, {} not run, {} claim "
      "nothing",
      s.pass, marks_among(run, Kind::pass), s.fail, marks_among(run, Kind::fail), s.expected_open,
      marks_among(run, Kind::expected_open), s.unexpected_open, marks_among(run, Kind::unexpected_open), s.violated, s.errors,
      s.not_run, s.unclaimed);
}

std::string order_line(const OrderFit& fit) {
  if (fit.steps.size() < 3) return fmt::format("{}: claimed order {:.0f}, {}", fit.name, fit.claimed, fit.reason);
  return fmt::format("{}: claimed order {:.0f}, measured {:.3f} +- {:.3f}: {}", fit.name, fit.claimed, fit.order, fit.half_width,
                     fit.outcome == Outcome::inconclusive ? fit.reason : to_string(fit.outcome));
}

/// The configuration in the results names every cell, whatever a filter, a shard or a time budget left of them.
std::size_t configured_cells(const RunRecord& run, const std::function<bool(const Json&)>& counts) {
  const Json config = known_json(run.config_text);
  std::size_t cells = 0;
  if (!config.is_object() || !config.contains("experiments")) return cells;
  for (const Json& experiment : config["experiments"])
    if (experiment.is_object() && experiment.contains("include"))
      cells += static_cast<std::size_t>(std::count_if(experiment["include"].begin(), experiment["include"].end(), counts));
  return cells;
}

/// The cells that a filter left of the configuration, as the run says.
std::optional<std::size_t> selected_cells(const RunRecord& run) {
  const auto at = run.provenance.find("selected");
  if (at == run.provenance.end()) return std::nullopt;
  const Json selected = known_json(at->second);
  return selected.is_number_unsigned() ? std::optional(selected.get<std::size_t>()) : std::nullopt;
}

bool claims_a_mean(const CellRecord& record) {
  return record.claims == "exact" || record.claims == "unbiased" || record.claims == "consistent";
}

std::size_t undecided_claims(const RunRecord& run) {
  return static_cast<std::size_t>(std::count_if(run.cells.begin(), run.cells.end(), [](const CellRecord& record) {
    const Kind kind = kind_of(record);
    return claims_a_mean(record) &&
           (kind == Kind::expected_open || kind == Kind::unexpected_open || kind == Kind::violated || kind == Kind::not_run);
  }));
}

/// See Summary::undecided_trackers, in the order of their first cells.
std::vector<std::string> undecided_trackers(const RunRecord& run) {
  struct Tracker {
    std::string name, claims;
    bool judged = false, decided = false;
  };
  std::vector<Tracker> trackers;
  for (const CellRecord& record : run.cells) {
    if (!claims_a_mean(record) || record.status != Status::ok || !record.verdict) continue;
    const Outcome mean = mean_of(*record.verdict);
    const std::string name = tracker_label(record.cell);
    auto at = std::find_if(trackers.begin(), trackers.end(), [&](const Tracker& tracker) { return tracker.name == name; });
    if (at == trackers.end()) at = trackers.insert(at, {name, record.claims});
    at->judged |= mean != Outcome::none;
    at->decided |= mean == Outcome::pass || mean == Outcome::fail;
  }
  std::vector<std::string> lines;
  for (const Tracker& tracker : trackers)
    if (tracker.judged && !tracker.decided)
      lines.push_back(fmt::format("{} claims {} and no cell decides it", tracker.name, tracker.claims));
  return lines;
}

bool disables_verdict(const Json& cell) {
  if (!cell.is_object() || !cell.contains("gate")) return false;
  const Json& gate = cell["gate"];
  return gate.is_object() && gate.contains("enabled") && gate["enabled"] == false;
}

std::size_t met(const std::vector<Expectation>& all) {
  return static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [](const Expectation& one) { return one.met; }));
}

/// ": 3 because no ray meets any extinction: nothing was tested"; empty where no cell says why.
std::string reasons_of_unclaimed(const RunRecord& run) {
  std::map<std::string, std::size_t> reasons;
  for (const CellRecord& record : run.cells)
    if (kind_of(record) == Kind::unclaimed && !record.reason.empty()) ++reasons[record.reason];
  std::string text;
  for (const auto& [reason, count] : reasons) text += fmt::format("{} {} ({})", text.empty() ? ":" : ";", reason, count);
  return text;
}

/// What keeps a run whose cells are good from being a success, and what was left out on purpose.
std::vector<std::string> remarks_of(const RunRecord& run, const Summary& summary) {
  std::vector<std::string> lines;
  if (summary.selected < summary.configured) {
    const auto filter = run.provenance.find("filter");
    lines.push_back(fmt::format("{} of the configuration's {} cells were selected{}{}", summary.selected, summary.configured,
                                run.provenance.contains("covering") ? " by --covering" : "",
                                filter == run.provenance.end() ? "" : fmt::format(" by --filter {}", filter->second)));
  }
  if (summary.never_started > 0)
    lines.push_back(fmt::format("{} cells of the configuration were never started", summary.never_started));
  if (summary.altered > 0) lines.push_back(fmt::format("{} verdicts in the file are not what its figures say", summary.altered));
  lines.insert(lines.end(), summary.undecided_trackers.begin(), summary.undecided_trackers.end());
  if (!summary.nothing_proven.empty()) lines.push_back(summary.nothing_proven);
  if (summary.strict && summary.undecided_claims > 0)
    lines.push_back(fmt::format("--strict: {} cells that claim something are not decided", summary.undecided_claims));
  return lines;
}

std::string families(const RunRecord& run) {
  for (const CellRecord& record : run.cells)
    if (record.verdict)
      return fmt::format(
          "at most {:g} of all runs show even one false FAIL among {} mean tests (and the same among {} of lookups)",
          record.verdict->alpha, record.verdict->family, record.verdict->lookups_family);
  const std::size_t off = configured_cells(run, disables_verdict), cells = run.cells.size();
  if (off == 0) return "no cell was judged" + reasons_of_unclaimed(run);
  return fmt::format("no cell was judged: the configuration disables the verdict in {} cells",
                     off == cells ? fmt::format("all {}", cells) : fmt::format("{} of {}", off, cells));
}

}  // namespace

Summary summarise(RunRecord& run, bool strict) {
  Summary summary;
  summary.strict = strict;
  for (CellRecord& record : run.cells) {
    if (record.verdict && record.status == Status::ok) {
      const VerdictRecord before = *record.verdict;
      decide(*record.verdict, record.outputs);
      const VerdictRecord& after = *record.verdict;
      summary.altered += before.unbiased != after.unbiased || before.own_mean != after.own_mean ||
                         before.lookups != after.lookups || before.lawful != after.lawful;
    }
    switch (kind_of(record)) {
      case Kind::pass:
        ++summary.pass;
        summary.own_mean += record.verdict->against == "own mean";
        break;
      case Kind::fail:
        ++summary.fail;
        break;
      case Kind::expected_open:
        ++summary.expected_open;
        break;
      case Kind::unexpected_open:
        ++summary.unexpected_open;
        break;
      case Kind::violated:
        ++summary.violated;
        break;
      case Kind::error:
        ++summary.errors;
        break;
      case Kind::not_run:
        ++summary.not_run;
        break;
      case Kind::unclaimed:
        ++summary.unclaimed;
    }
  }
  for (const CellRecord& record : run.cells) summary.never_started += record.status == Status::not_run;
  summary.configured = configured_cells(run, [](const Json&) { return true; });
  summary.selected = selected_cells(run).value_or(summary.configured);
  if (summary.selected > run.cells.size()) summary.never_started += summary.selected - run.cells.size();
  summary.undecided_claims = undecided_claims(run);
  summary.undecided_trackers = undecided_trackers(run);
  summary.orders = fit_orders(run.cells);
  const bool order_failed =
      std::any_of(summary.orders.begin(), summary.orders.end(), [](const OrderFit& fit) { return fit.outcome == Outcome::fail; });
  const bool order_passed =
      std::any_of(summary.orders.begin(), summary.orders.end(), [](const OrderFit& fit) { return fit.outcome == Outcome::pass; });
  summary.expectations = expectations(run);
  summary.findings = findings(run);
  const bool disappointed = std::any_of(summary.expectations.begin(), summary.expectations.end(),
                                        [](const Expectation& one) { return one.measured && !one.met; });
  const bool told = std::any_of(summary.findings.begin(), summary.findings.end(),
                                [](const ClaimFinding& one) { return one.outcome != ClaimOutcome::cannot_tell; });
  if (summary.pass > 0 && summary.pass == summary.own_mean && !order_passed && !told)
    summary.nothing_proven = "no cell proves anything about the quantity itself: only own means passed";
  if (summary.fail > 0 || order_failed || disappointed)
    summary.exit = ExitCode::bias_proven;
  else if (summary.errors > 0 || summary.altered > 0)
    summary.exit = ExitCode::internal_error;
  else if (summary.pass + summary.expected_open + summary.unexpected_open + summary.violated == 0 && !told)
    summary.exit = ExitCode::nothing_ran;
  else if (summary.never_started > 0 || summary.unexpected_open > 0 || (summary.pass == 0 && !told) ||
           !summary.nothing_proven.empty() || !summary.undecided_trackers.empty() || (strict && summary.undecided_claims > 0))
    summary.exit = ExitCode::inconclusive;
  return summary;
}

std::string summary_text(const RunRecord& run, const Summary& summary) {
  std::string text;
  for (const Kind kind :
       {Kind::pass, Kind::violated, Kind::expected_open, Kind::not_run, Kind::unexpected_open, Kind::error, Kind::fail})
    for (const CellRecord& record : run.cells)
      if (kind_of(record) == kind && (kind != Kind::pass || !marks_of(record).empty()))
        text += fmt::format("{}: {}: {}\n", marked_word(record), record.cell.name, finding_of(record));
  for (const OrderFit& fit : summary.orders) text += fmt::format("ORDER: {}\n", order_line(fit));
  for (const Expectation& one : summary.expectations)
    if (!one.met) text += fmt::format("{}: {}\n", one.measured ? "EXPECTED OTHERWISE" : "NOT MEASURED", expectation_line(one));
  if (!summary.expectations.empty())
    text += fmt::format("{} of {} expected numbers met\n", met(summary.expectations), summary.expectations.size());
  if (!summary.findings.empty()) text += findings_text(summary.findings);
  for (const std::string& line : remarks_of(run, summary)) text += line + "\n";
  return text + fmt::format("{}\n{}\n", counts(run, summary), families(run));
}

std::string summary_markdown(const RunRecord& run, const Summary& summary, const std::string& file) {
  std::string text = fmt::format("### nullmark check: {}\n\n{}; {}.\n", run.name, counts(run, summary), families(run));
  for (const std::string& line : remarks_of(run, summary)) text += fmt::format("- {}\n", escaped(line));
  const auto table = [&](std::initializer_list<Kind> kinds, const std::string& title, bool commands) {
    std::string rows;
    std::size_t count = 0;
    for (const CellRecord& record : run.cells)
      if (std::find(kinds.begin(), kinds.end(), kind_of(record)) != kinds.end() &&
          (kind_of(record) != Kind::pass || !marks_of(record).empty())) {
        rows += fmt::format("| {} | {} | {} |\n", marked_word(record), escaped(record.cell.name), escaped(finding_of(record)));
        if (commands) rows += fmt::format("| | | `{}` |\n", reproduction(record, file));
        ++count;
      }
    if (count > 0)
      text +=
          fmt::format("\n<details{}><summary>{} ({})</summary>\n\n| verdict | cell | reason |\n|---|---|---|\n{}\n</details>\n",
                      commands ? " open" : "", title, count, rows);
  };
  table({Kind::fail, Kind::error}, "Biased, or not computed", true);
  table({Kind::unexpected_open}, "Undecided", false);
  table({Kind::expected_open}, "Undecidable by their mean, as planned", false);
  table({Kind::violated}, "Need a true majorant and did not have one", false);
  table({Kind::pass}, "Passed, with a mark", false);
  if (!summary.expectations.empty()) {
    text += fmt::format("\n{} of {} expected numbers met.\n", met(summary.expectations), summary.expectations.size());
    for (const Expectation& one : summary.expectations)
      if (!one.met) text += fmt::format("- {}\n", escaped(expectation_line(one)));
  }
  if (!summary.findings.empty()) text += fmt::format("\n{}", findings_markdown(summary.findings));
  if (!summary.orders.empty()) {
    text += "\n| convergence order |\n|---|\n";
    for (const OrderFit& fit : summary.orders) text += fmt::format("| {} |\n", order_line(fit));
  }
  return text;
}

}  // namespace nullmark
