#include "harness/report/history_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "harness/io/fitted.h"
#include "harness/io/text.h"
#include "harness/model/metrics.h"
#include "harness/performance_gate/performance_gate.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

using Line = std::vector<std::string>;

std::string of_commit(const HistoryResult& result) {
  return result.commit.empty() ? result.date : fmt::format("{} (commit {})", result.date, result.commit);
}

std::vector<Line> changes_table(const std::vector<CellChange>& changes) {
  std::vector<Line> lines = {{"cell", "change", "before", "now", "note"}};
  for (const CellChange& one : changes) lines.push_back({one.cell, to_string(one.change), one.before, one.after, one.note});
  return lines;
}

/// The figure that a change is about, in one result.
std::string figure_of(const CellRecord& record, Change change) {
  switch (change) {
    case Change::verdict:
    case Change::came:
    case Change::went:
      return marked_word(record);
    case Change::slower:
    case Change::faster:
      return short_number(metric(record, "ns_per_sample"));
    case Change::more_draws:
    case Change::fewer_draws:
      return short_number(metric(record, "draws_per_sample"));
    case Change::larger_error:
    case Change::smaller_error:
      return short_number(metric(record, "sample_rmse"));
    default:
      return short_number(metric(record, "lookups_per_sample"));
  }
}

/// What changed last, over all results, the newest first.
std::vector<Line> series_table(const History& history) {
  Line head = {"cell", "change"};
  for (auto result = history.results.rbegin(); result != history.results.rend(); ++result) head.push_back(result->date);
  std::vector<Line> lines = {head};
  for (const CellChange& one : history.steps.back().changes) {
    Line line = {one.cell, to_string(one.change)};
    for (auto result = history.results.rbegin(); result != history.results.rend(); ++result) {
      const auto& cells = result->run.cells;
      const auto at =
          std::find_if(cells.begin(), cells.end(), [&](const CellRecord& record) { return record.cell.name == one.cell; });
      line.push_back(at == cells.end() ? "-" : figure_of(*at, one.change));
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

std::string machine_of(const HistoryResult& result) { return fmt::format("{}; {}", result.cpu, result.build); }

bool share_a_machine(const History& history) {
  return std::all_of(history.results.begin(), history.results.end(),
                     [&](const HistoryResult& result) { return machine_of(result) == machine_of(history.results[0]); });
}

std::vector<Line> results_table(const History& history) {
  const bool machines = !share_a_machine(history);
  std::vector<Line> lines = {{"result", "changed since the one before", "verdicts", "commit", "file"}};
  if (machines) lines[0].insert(lines[0].end(), {"CPU", "build"});
  for (std::size_t i = 0; i < history.results.size(); ++i) {
    const HistoryResult& result = history.results[i];
    lines.push_back({result.date, change_shown(history, i), verdicts_counted(result.run), result.commit, result.file});
    if (machines) lines.back().insert(lines.back().end(), {result.cpu, result.build});
  }
  return lines;
}

/// Levels of the statistics that no chance may pass.
std::string rates_line(const History& history) {
  Real alpha = 0;
  for (const HistoryResult& result : history.results)
    for (const CellRecord& record : result.run.cells)
      if (record.verdict) alpha = std::max(alpha, record.verdict->alpha);
  std::string text = fmt::format(
      "by chance, at most {:g} of comparisons of a program with itself show a change of lookups, and {:g} one of errors",
      kFalseRegressions, kFalseErrorChanges);
  return text + (alpha > 0 ? fmt::format("; at most {:g} of runs show a false FAIL\n", alpha) : "\n");
}

std::string undecided_text(const std::vector<CellChange>& undecided, std::size_t width, Line& left_out) {
  if (undecided.empty()) return "";
  constexpr std::size_t kFew = 5;
  std::set<std::string> cells;
  for (const CellChange& one : undecided) cells.insert(one.cell);
  std::vector<CellChange> few(undecided.begin(),
                              undecided.begin() + static_cast<std::ptrdiff_t>(std::min(kFew, undecided.size())));
  std::string text = fmt::format(
      "\nmay be chance, in {} cell{}{}\n", cells.size(), cells.size() == 1 ? "" : "s",
      few.size() < undecided.size() ? fmt::format(", {} of {} shown; --json shows all", few.size(), undecided.size()) : "");
  return text + fitted(changes_table(few), 2, width, left_out);
}

/// "samples_per_ray (64 → 1024)", and how many cells have them.
std::pair<std::string, std::size_t> other_samples(const HistoryStep& step) {
  constexpr std::size_t kNamed = 2;
  std::size_t cells = 0;
  Line named;
  for (const auto& [numbers, count] : step.other_samples) {
    cells += count;
    if (named.size() < kNamed) named.push_back(fmt::format("{} → {}", numbers.first, numbers.second));
  }
  const std::size_t more = step.other_samples.size() - named.size();
  return {fmt::format("samples_per_ray ({}{})", fmt::join(named, ", "), more > 0 ? fmt::format(", and {} more", more) : ""),
          cells};
}

}  // namespace

std::string verdicts_counted(const RunRecord& run) {
  std::map<Kind, std::size_t> counts;
  for (const CellRecord& record : run.cells) ++counts[kind_of(record)];
  std::string text;
  for (const auto& [kind, count] : counts) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, verdict_word(kind));
  return text;
}

std::string change_shown(const History& history, std::size_t result) {
  if (result == 0) return "-";
  const HistoryStep& step = history.steps[result - 1];
  if (compares_nothing(step)) return "nothing was compared";
  const std::string since = step.since + 1 == result ? "" : fmt::format(", since {}", history.results[step.since].date);
  return (step.changed == 0 ? "nothing"
                            : fmt::format("{} cell{}: {}", step.changed, step.changed == 1 ? "" : "s", changes_counted(step))) +
         since;
}

std::string changes_line(const History& history) {
  const HistoryStep& step = history.steps.back();
  const std::string since = of_commit(history.results[step.since]);
  if (compares_nothing(step)) return fmt::format("nothing could be compared since {}", since);
  std::string text;
  if (step.changed > 0)
    text = fmt::format("{} of {} cells changed since {}: {}", step.changed, step.cells, since, changes_counted(step));
  else if (step.other_samples.empty())
    text = fmt::format("nothing changed since {}: {} of {} cells compared", since, step.compared, step.cells);
  const auto [samples, cells] = other_samples(step);
  if (cells > 0)
    text += text.empty() ? fmt::format("nothing changed since {} but {}, in {} of {} cells", since, samples, cells, step.cells)
                         : fmt::format("; other {} in {}", samples, cells);
  const auto verdicts = std::count_if(step.undecided.begin(), step.undecided.end(),
                                      [](const CellChange& one) { return one.change == Change::verdict; });
  if (verdicts == 0) return text;
  return text + fmt::format("; {} verdict{}, which {}", verdicts, verdicts == 1 ? " differs" : "s differ",
                            cells > 0 ? "chance or other samples can do" : "may be chance");
}

std::string history_text(const History& history, std::size_t width) {
  const HistoryStep& step = history.steps.back();
  Line left_out;
  std::string text = changes_line(history) + "\n";
  if (!step.changes.empty()) text += "\n" + fitted(changes_table(step.changes), 2, width, left_out);
  if (!step.changes.empty() && history.results.size() > 2)
    text += "\nthe same over all results, the newest first\n" + fitted(series_table(history), 2, width, left_out);
  text += undecided_text(step.undecided, width, left_out);
  text += "\n" + fitted(results_table(history), 6, width, left_out);
  if (share_a_machine(history)) text += fmt::format("all measured on {}\n", machine_of(history.results[0]));
  text += "\n";
  for (const std::string& note : step.notes) text += note + "\n";
  if (!left_out.empty()) text += fmt::format("no room for columns: {}\n", fmt::join(left_out, ", "));
  return text + step.time + "\n" + rates_line(history);
}

}  // namespace nullmark
