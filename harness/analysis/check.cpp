#include "harness/analysis/check.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/analysis/disagreements.h"
#include "harness/config/cell_names.h"
#include "harness/verdict/cell_word.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

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

}  // namespace

std::size_t configured_cells(const RunRecord& run, const std::function<bool(const Json&)>& counts) {
  const Json config = known_json(run.config_text);
  std::size_t cells = 0;
  if (!config.is_object() || !config.contains("experiments")) return cells;
  for (const Json& experiment : config["experiments"])
    if (experiment.is_object() && experiment.contains("include"))
      cells += static_cast<std::size_t>(std::count_if(experiment["include"].begin(), experiment["include"].end(), counts));
  return cells;
}

namespace {

/// Decides a cell anew, from its evidence alone, and counts it.
void count_cell(CellRecord& record, Summary& summary) {
  if (record.verdict && record.status == Status::ok) {
    const VerdictRecord before = *record.verdict;
    decide(*record.verdict, record.outputs, record.range);
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
    case Kind::agree:
      ++summary.agree;
      break;
    case Kind::differ:
      ++summary.differ;
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
    case Kind::untested:
      ++summary.untested;
  }
}

/// Whether a claim was reproduced or refuted: a result without a verdict of its own.
bool claim_decided(const Summary& summary) {
  return std::any_of(summary.findings.begin(), summary.findings.end(),
                     [](const ClaimFinding& one) { return one.outcome != ClaimOutcome::cannot_tell; });
}

bool has_required(const Summary& summary, ClaimOutcome outcome) {
  return std::any_of(summary.findings.begin(), summary.findings.end(),
                     [&](const ClaimFinding& one) { return one.claim->required && one.outcome == outcome; });
}

bool has_order(const Summary& summary, Outcome outcome) {
  return std::any_of(summary.orders.begin(), summary.orders.end(), [&](const OrderFit& fit) { return fit.outcome == outcome; });
}

ExitCode exit_of(const Summary& summary) {
  const bool told = claim_decided(summary), untold = has_required(summary, ClaimOutcome::cannot_tell);
  if (summary.fail > 0 || summary.differ > 0 || has_order(summary, Outcome::fail) || has_required(summary, ClaimOutcome::refuted))
    return ExitCode::bias_proven;
  if (summary.errors > 0 || summary.altered > 0) return ExitCode::internal_error;
  if (summary.pass + summary.agree + summary.expected_open + summary.unexpected_open + summary.violated == 0 && !told && !untold)
    return ExitCode::nothing_ran;
  const bool open = summary.never_started > 0 || summary.drawn_in_part > 0 || summary.unexpected_open > 0 ||
                    (summary.pass == 0 && !told) || untold || !summary.nothing_proven.empty() ||
                    !summary.undecided_trackers.empty() || (summary.strict && summary.undecided_claims > 0);
  return open ? ExitCode::inconclusive : summary.exit;
}

}  // namespace

Summary summarise(RunRecord& run, bool strict) {
  Summary summary;
  summary.strict = strict;
  for (CellRecord& record : run.cells) {
    count_cell(record, summary);
    summary.never_started += record.status == Status::not_run && record.drawn_parts.empty();
    summary.drawn_in_part += !record.drawn_parts.empty();
  }
  summary.configured = configured_cells(run, [](const Json&) { return true; });
  summary.selected = selected_cells(run).value_or(summary.configured);
  if (summary.selected > run.cells.size()) summary.never_started += summary.selected - run.cells.size();
  summary.undecided_claims = undecided_claims(run);
  summary.undecided_trackers = undecided_trackers(run);
  summary.disagreements = disagreements(run);
  summary.orders = fit_orders(run.cells);
  summary.findings = findings(run);
  if (summary.pass > 0 && summary.pass == summary.own_mean && !has_order(summary, Outcome::pass) && !claim_decided(summary))
    summary.nothing_proven = "no cell proves anything about the quantity itself: only own means passed";
  summary.exit = exit_of(summary);
  return summary;
}

}  // namespace nullmark
