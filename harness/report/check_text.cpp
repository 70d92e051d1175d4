#include "harness/report/check_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "harness/io/text.h"
#include "harness/model/names.h"
#include "harness/report/claims_text.h"
#include "harness/report/junit.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

/// How many cells of a kind have each mark: " (of them 3 by pilot, 1 own mean)"; empty where none has one.
std::string marks_among(const RunRecord& run, Kind kind) {
  std::map<Mark, std::size_t> counts;
  for (const CellRecord& record : run.cells)
    if (kind_of(record) == kind)
      for (const Mark mark : marks_of(record)) ++counts[mark];
  std::string text;
  for (const auto& [mark, count] : counts) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, mark_name(mark));
  return text.empty() ? "" : fmt::format(" (of them {})", text);
}

std::string failed_orders(const Summary& s) {
  const auto failed =
      std::count_if(s.orders.begin(), s.orders.end(), [](const OrderFit& fit) { return fit.outcome == Outcome::fail; });
  return failed > 0 ? fmt::format(", {} ORDER FAIL", failed) : "";
}

std::string counts(const RunRecord& run, const Summary& s) {
  return fmt::format(
             "{} PASS{}, {} FAIL{}, {} INCONCLUSIVE as planned{}, {} INCONCLUSIVE{}, {} VIOLATED, {} errors, {} not run, {} not "
             "tested",
             s.pass, marks_among(run, Kind::pass), s.fail, marks_among(run, Kind::fail), s.expected_open,
             marks_among(run, Kind::expected_open), s.unexpected_open, marks_among(run, Kind::unexpected_open), s.violated,
             s.errors, s.not_run, s.untested) +
         (s.agree + s.differ > 0 ? fmt::format(", {} AGREE, {} DIFFER", s.agree, s.differ) : "") + failed_orders(s);
}

std::string order_line(const OrderFit& fit) {
  if (fit.steps.size() < 3) return fmt::format("{}: claimed order {:.0f}, {}", fit.name, fit.claimed, fit.reason);
  return fmt::format("{}: claimed order {:.0f}, measured {:.3f} +- {:.3f}: {}", fit.name, fit.claimed, fit.order, fit.half_width,
                     fit.outcome == Outcome::inconclusive ? fit.reason : to_string(fit.outcome));
}

bool disables_verdict(const Json& cell) {
  if (!cell.is_object() || !cell.contains("verdict")) return false;
  const Json& spec = cell["verdict"];
  return spec.is_object() && spec.contains("enabled") && spec["enabled"] == false;
}

/// ": 3 because no ray meets any extinction: nothing was tested"; empty where no cell says why.
std::string reasons_of_untested(const RunRecord& run) {
  std::map<std::string, std::size_t> reasons;
  for (const CellRecord& record : run.cells)
    if (kind_of(record) == Kind::untested && !record.reason.empty()) ++reasons[record.reason];
  std::string text;
  for (const auto& [reason, count] : reasons) text += fmt::format("{} {} ({})", text.empty() ? ":" : ";", reason, count);
  return text;
}

/// Samples a ray: minutes of CPU for each ray at 100 ns a sample.
constexpr std::uint64_t kMostAdvised = 1'000'000'000;

/// Whether a test of the mean had no bet on one side, as where a pilot's variance is not trusted: no number of samples was
/// planned.
bool unplanned_by_pilot(const VerdictRecord& verdict) {
  return std::any_of(verdict.tests.begin(), verdict.tests.end(), [](const TestRecord& test) {
    return test.channel >= 0 && !test.deterministic() && !(std::isfinite(test.log_e_low) && std::isfinite(test.log_e_high));
  });
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
    lines.push_back(fmt::format("{} cells of the configuration {}were never started", summary.never_started,
                                run.provenance.contains("shard") ? "belong to other shards, or " : ""));
  if (summary.drawn_in_part > 0)
    lines.push_back(
        fmt::format("{} cells are drawn in part: `merge` joins the results of all shards, and `run CONFIG --resume -o RESULTS` "
                    "draws what is missing",
                    summary.drawn_in_part));
  if (summary.altered > 0) lines.push_back(fmt::format("{} verdicts in the file are not what its figures say", summary.altered));
  lines.insert(lines.end(), summary.disagreements.begin(), summary.disagreements.end());
  // Of samples that were handed in, no key allows more.
  std::uint64_t wanted = 0;
  std::size_t hopeless = 0, unplanned = 0;
  for (const CellRecord& record : run.cells) {
    if (record.tracker.unrepeatable || kind_of(record) != Kind::expected_open ||
        record.verdict->planned <= record.verdict->affordable)
      continue;
    if (record.verdict->planned > kMostAdvised && unplanned_by_pilot(*record.verdict))
      ++unplanned;
    else if (record.verdict->planned > kMostAdvised)
      ++hopeless;
    else
      wanted = std::max(wanted, record.verdict->planned);
  }
  if (wanted > 0)
    lines.push_back(
        fmt::format("cells that are INCONCLUSIVE as planned need up to {} samples a ray: raise \"max_samples_per_ray\" or "
                    "\"max_lookups_per_ray\" in \"verdict\" of their experiments, and run again",
                    wanted));
  if (hopeless > 0)
    lines.push_back(
        fmt::format("{} INCONCLUSIVE as planned need{} more than {:.0e} samples a ray: the variance is too high for this epsilon",
                    hopeless == 1 ? "1 cell that is" : fmt::format("{} cells that are", hopeless), hopeless == 1 ? "s" : "",
                    static_cast<double>(kMostAdvised)));
  if (unplanned > 0)
    lines.push_back(fmt::format(
        "{} INCONCLUSIVE as planned whatever \"max_samples_per_ray\" is; `check --all` says why. Where a pilot is not "
        "trusted, a larger \"samples_per_ray\" makes a larger one",
        unplanned == 1 ? "1 cell is" : fmt::format("{} cells are", unplanned)));
  lines.insert(lines.end(), summary.undecided_trackers.begin(), summary.undecided_trackers.end());
  if (!summary.nothing_proven.empty()) lines.push_back(summary.nothing_proven);
  for (const ClaimFinding& one : summary.findings)
    if (one.claim->required && one.outcome != ClaimOutcome::reproduced)
      lines.push_back(fmt::format("required claim {} {}: {}", one.claim->id,
                                  one.outcome == ClaimOutcome::refuted ? "is refuted" : "cannot be told", deciding_figures(one)));
  if (summary.strict && summary.undecided_claims > 0)
    lines.push_back(fmt::format("--strict: {} cells that claim something are not decided", summary.undecided_claims));
  return lines;
}

std::string families(const RunRecord& run) {
  // Whoever hands in samples knows nothing of lookups.
  const bool lookups = std::any_of(run.cells.begin(), run.cells.end(), [](const CellRecord& record) {
    return record.verdict && record.verdict->lookups != Outcome::none;
  });
  for (const CellRecord& record : run.cells)
    if (record.verdict)
      return fmt::format("at most {:g} of all runs show even one false FAIL among {} mean tests{}", record.verdict->alpha,
                         record.verdict->family,
                         lookups ? fmt::format(" (and the same among {} of lookups)", record.verdict->lookups_family) : "");
  const std::size_t off = configured_cells(run, disables_verdict), cells = run.cells.size();
  if (off == 0) return "no cell was judged" + reasons_of_untested(run);
  return fmt::format("no cell was judged: the configuration disables the verdict in {} cells",
                     off == cells ? fmt::format("all {}", cells) : fmt::format("{} of {}", off, cells));
}

/// Whether a list of verdicts has the cell: all that are no plain PASS and claim something.
bool is_listed(const CellRecord& record) {
  const Kind kind = kind_of(record);
  return kind != Kind::untested && ((kind != Kind::pass && kind != Kind::agree) || !marks_of(record).empty());
}

/// Whether somebody should look at a cell of the kind: always, and where every claim must be decided.
bool needs_attention(Kind kind, bool strict) {
  if (kind == Kind::fail || kind == Kind::differ || kind == Kind::error || kind == Kind::unexpected_open) return true;
  return strict && (kind == Kind::expected_open || kind == Kind::violated || kind == Kind::not_run);
}

/// Verdict and marks, without the numbers of the cell.
std::string word_of_group(const CellRecord& record) {
  std::vector<std::string> marks;
  for (const Mark mark : marks_of(record)) marks.emplace_back(mark == Mark::law ? mark_text(mark, record) : mark_name(mark));
  return with_marks(verdict_word(kind_of(record)), marks);
}

/// Why a cell was not run; the word alone does not tell.
std::string reason_of_group(const CellRecord& record) {
  return kind_of(record) == Kind::not_run ? fmt::format(" ({})", finding_of(record)) : "";
}

std::string cell_line(const CellRecord& record) {
  return fmt::format("{}: {}: {}\n", marked_word(record), record.cell.name, finding_of(record));
}

/// A line for the cells of one word: "PASS (by pilot): 372 cells of mis_bidirectional (216), spectral (40) and 12 more trackers".
std::string group_line(const std::string& word, const std::vector<const CellRecord*>& cells) {
  constexpr std::size_t kNamed = 4;
  std::map<std::string, std::size_t> counts;
  for (const CellRecord* record : cells) ++counts[record->cell.estimator->type];
  std::vector<std::pair<std::size_t, std::string>> trackers;
  for (const auto& [tracker, count] : counts) trackers.emplace_back(count, tracker);
  std::sort(trackers.begin(), trackers.end(),
            [](const auto& a, const auto& b) { return a.first != b.first ? a.first > b.first : a.second < b.second; });
  std::vector<std::string> named;
  for (std::size_t i = 0; i < std::min(kNamed, trackers.size()); ++i)
    named.push_back(fmt::format("{} ({})", trackers[i].second, trackers[i].first));
  const std::size_t more = trackers.size() - named.size();
  return fmt::format("{}: {} cells of {}{}\n", word, cells.size(), fmt::join(named, ", "),
                     more > 0 ? fmt::format(" and {} more tracker{}", more, more == 1 ? "" : "s") : "");
}

/// The cells that nobody need look at one by one, where they are many: a line for each word.
std::string grouped_lines(const RunRecord& run, bool strict, const std::string& command) {
  std::map<std::pair<Kind, std::string>, std::vector<const CellRecord*>> groups;
  for (const CellRecord& record : run.cells)
    if (is_listed(record) && !needs_attention(kind_of(record), strict))
      groups[{kind_of(record), word_of_group(record) + reason_of_group(record)}].push_back(&record);
  std::string text;
  for (const auto& [key, cells] : groups) text += cells.size() == 1 ? cell_line(*cells[0]) : group_line(key.second, cells);
  return text + fmt::format("each of them: {}\n", command);
}

}  // namespace

std::string summary_text(const RunRecord& run, const Summary& summary, bool all, const std::string& command) {
  constexpr std::ptrdiff_t kFew = 40;
  const auto quiet = std::count_if(run.cells.begin(), run.cells.end(), [&](const CellRecord& record) {
    return is_listed(record) && !needs_attention(kind_of(record), summary.strict);
  });
  const bool grouped = !all && quiet > kFew;
  std::string text = fmt::format("{}\n{}\n", counts(run, summary), families(run));
  if (grouped) text += grouped_lines(run, summary.strict, command);
  for (const Kind kind : {Kind::pass, Kind::agree, Kind::violated, Kind::expected_open, Kind::not_run, Kind::unexpected_open,
                          Kind::error, Kind::differ, Kind::fail})
    for (const CellRecord& record : run.cells)
      if (kind_of(record) == kind && is_listed(record) && (!grouped || needs_attention(kind, summary.strict)))
        text += cell_line(record);
  for (const OrderFit& fit : summary.orders) text += fmt::format("ORDER: {}\n", order_line(fit));
  if (!summary.findings.empty()) text += findings_text(summary.findings);
  for (const std::string& line : remarks_of(run, summary)) text += line + "\n";
  return text;
}

std::string judgement_text(const RunRecord& run, const Summary& summary) {
  std::string text;
  for (const CellRecord& record : run.cells) text += cell_line(record);
  text += families(run) + "\n";
  for (const std::string& line : remarks_of(run, summary)) text += line + "\n";
  return text;
}

std::string summary_markdown(const RunRecord& run, const Summary& summary, const std::string& file) {
  std::string text = fmt::format("### nullmark check: {}\n\n{}; {}.\n", markdown_cell(run.name), counts(run, summary),
                                 markdown_cell(families(run)));
  for (const std::string& line : remarks_of(run, summary)) text += fmt::format("- {}\n", markdown_cell(line));
  const auto table = [&](std::initializer_list<Kind> kinds, const std::string& title, bool commands) {
    // GitHub shows no summary above 1 MiB.
    constexpr std::size_t kMostRows = 200;
    std::string rows;
    std::size_t count = 0;
    for (const CellRecord& record : run.cells)
      if (std::find(kinds.begin(), kinds.end(), kind_of(record)) != kinds.end() && is_listed(record)) {
        if (++count > kMostRows) continue;
        rows += fmt::format("| {} | {} | {} |\n", marked_word(record), markdown_cell(record.cell.name),
                            markdown_cell(finding_of(record)));
        if (commands) rows += fmt::format("| | | {} |\n", markdown_code(reproduction(record, file)));
      }
    if (count > kMostRows) rows += fmt::format("| | and {} more | |\n", count - kMostRows);
    if (count > 0)
      text +=
          fmt::format("\n<details{}><summary>{} ({})</summary>\n\n| verdict | cell | reason |\n|---|---|---|\n{}\n</details>\n",
                      commands ? " open" : "", title, count, rows);
  };
  table({Kind::fail, Kind::differ, Kind::error}, "Biased, or not computed", true);
  table({Kind::unexpected_open}, "Undecided", false);
  table({Kind::expected_open}, "Undecidable by their mean, as planned", false);
  table({Kind::violated}, "Need a true majorant and did not have one", false);
  table({Kind::pass, Kind::agree}, "Passed, with a mark", false);
  if (!summary.findings.empty()) text += fmt::format("\n{}", findings_markdown(summary.findings));
  if (!summary.orders.empty()) {
    text += "\n| convergence order |\n|---|\n";
    for (const OrderFit& fit : summary.orders) text += fmt::format("| {} |\n", markdown_cell(order_line(fit)));
  }
  return text;
}

}  // namespace nullmark
