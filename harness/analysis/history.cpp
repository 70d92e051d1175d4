#include "harness/analysis/history.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "harness/analysis/check.h"
#include "harness/analysis/history_step.h"
#include "harness/io/json_input.h"
#include "harness/io/results_json.h"
#include "harness/performance_gate/baseline.h"

namespace nullmark {
namespace {

Json told(const RunRecord& run, const char* key) {
  const auto at = run.provenance.find(key);
  return at == run.provenance.end() ? Json() : known_json(at->second);
}

std::string told(const RunRecord& run, const char* key, const char* member) {
  const Json json = told(run, key);
  return json.is_object() && json.contains(member) && json[member].is_string() ? json[member].get<std::string>() : std::string();
}

/// What the machine code of a run depends on.
std::string made_by(const RunRecord& run) {
  std::string text;
  for (const char* key : {"git", "compiler", "target", "libc", "plugin"}) text += told(run, key).dump() + "\n";
  return text;
}

std::string commit_of(const RunRecord& run) {
  constexpr std::size_t kDigits = 7;
  const Json git = told(run, "git");
  const std::string commit = told(run, "git", "commit").substr(0, kDigits);
  const bool dirty = git.is_object() && git.contains("dirty") && git["dirty"] == true;
  return commit.empty() ? "" : commit + (dirty ? ", changed" : "");
}

HistoryResult result_of(RunRecord run, const std::string& file) {
  HistoryResult result;
  result.file = file;
  const Json start = told(run, "start");
  // "2026-11-20T03:04:05Z" sorts as it is.
  if (!start.is_string() || start.get<std::string>().size() < 19)
    throw InputError(file + ": does not tell when it was measured; run the configuration again with this program");
  result.date = start.get<std::string>();
  result.commit = commit_of(run);
  result.cpu = told(run, "cpu", "model");
  const Counts counts = counts_of(run, file);
  result.build = counts.build.text();
  result.partial = counts.partial || run.cells.size() < summarise(run).configured;
  result.run = std::move(run);
  return result;
}

void refuse_other_configurations(const std::vector<HistoryResult>& results) {
  const HistoryResult& first = results[0];
  std::set<std::string> names;
  for (const CellRecord& record : first.run.cells) names.insert(record.cell.name);
  for (const HistoryResult& other : results) {
    const bool shares =
        other.run.cells.empty() || std::any_of(other.run.cells.begin(), other.run.cells.end(),
                                               [&](const CellRecord& record) { return names.contains(record.cell.name); });
    if (other.run.name != first.run.name)
      throw InputError(fmt::format("{}: is of configuration \"{}\", and {} of \"{}\"; expected results of one configuration",
                                   other.file, other.run.name, first.file, first.run.name));
    if (!shares)
      throw InputError(fmt::format("{}: has no cell in common with {}; expected {}", other.file, first.file,
                                   first.partial && other.partial ? "what `nullmark merge` makes of the shards of one run"
                                                                  : "results of one configuration"));
  }
}

/// Leaves out results that are there twice.
void drop_copies(History& history) {
  std::map<std::string, std::string> seen;
  std::vector<HistoryResult> kept;
  for (HistoryResult& result : history.results) {
    std::string text = results_text(result.run);
    const auto [at, fresh] = seen.emplace(std::move(text), result.file);
    if (fresh)
      kept.push_back(std::move(result));
    else
      history.warnings.push_back(fmt::format("{} holds the same results as {} and counts once", result.file, at->second));
  }
  history.results = std::move(kept);
}

/// Days alone where they tell the results apart, else with the time, to the second.
void shorten_dates(std::vector<HistoryResult>& results) {
  constexpr std::size_t kDay = 10, kSecond = 19;
  std::set<std::string> days;
  for (const HistoryResult& result : results) days.insert(result.date.substr(0, kDay));
  const bool by_day = days.size() == results.size();
  for (HistoryResult& result : results) {
    result.date = result.date.substr(0, by_day ? kDay : kSecond);
    if (!by_day) result.date[kDay] = ' ';
  }
}

void refuse_other_blocks(const std::vector<TimedBlock>& blocks, const HistoryResult& before, const HistoryResult& after) {
  std::set<std::string> machines;
  const auto refuse = [](const RunRecord& run, const HistoryResult& expected) {
    if (made_by(run) != made_by(expected.run) || run.name != expected.run.name)
      throw InputError(
          fmt::format("--blocks: holds runs of another program or configuration than {}; expected those of the last "
                      "two results that are compared, old and new",
                      expected.file));
  };
  for (const TimedBlock& block : blocks)
    for (std::size_t i = 0; i < 2; ++i) {
      refuse(block.before[i], before);
      refuse(block.control[i], before);
      refuse(block.after[i], after);
      for (const RunRecord* run : {&block.before[i], &block.control[i], &block.after[i]})
        machines.insert(told(*run, "cpu", "model"));
    }
  if (machines.size() > 1) throw InputError("--blocks: holds runs of several CPUs; expected runs that took turns on one");
}

bool is_whole(const HistoryResult& result) {
  return !result.partial && std::none_of(result.run.cells.begin(), result.run.cells.end(),
                                         [](const CellRecord& record) { return record.status == Status::not_run; });
}

/// Names the results that a step leaves out.
std::string left_out_note(const std::vector<HistoryResult>& results, std::size_t first, std::size_t end) {
  constexpr std::size_t kNamed = 3;
  std::string names;
  for (std::size_t i = first; i < std::min(end, first + kNamed); ++i) names += (i == first ? "" : ", ") + results[i].file;
  const std::size_t count = end - first;
  if (count > kNamed) names += fmt::format(" and {} more", count - kNamed);
  return fmt::format("not compared with {}, which {} fewer cells to compare, but with {}", names, count == 1 ? "has" : "have",
                     results[first - 1].file);
}

/// A part of the cells, such as those of a shard, must not hide that earlier results can be compared.
HistoryStep step_to(const std::vector<HistoryResult>& results, std::size_t to, const std::vector<TimedBlock>& blocks) {
  HistoryStep step;
  for (std::size_t from = to; from-- > 0;) {
    HistoryStep tried = compare_results(results[from], results[to], {});
    tried.since = from;
    const bool enough = !compares_nothing(tried) && is_whole(results[from]);
    if (from + 1 == to || tried.compared > step.compared) step = std::move(tried);
    if (enough) break;
  }
  const std::size_t since = step.since;
  if (!blocks.empty()) {
    refuse_other_blocks(blocks, results[since], results[to]);
    step = compare_results(results[since], results[to], blocks);
    step.since = since;
  }
  if (since + 1 < to) step.notes.push_back(left_out_note(results, since + 1, to));
  return step;
}

}  // namespace

const char* to_string(Change change) {
  switch (change) {
    case Change::verdict:
      return "verdict";
    case Change::slower:
      return "slower";
    case Change::faster:
      return "faster";
    case Change::more_instructions:
      return "more instructions";
    case Change::fewer_instructions:
      return "fewer instructions";
    case Change::more_misses:
      return "more cache misses";
    case Change::fewer_misses:
      return "fewer cache misses";
    case Change::more_lookups:
      return "more lookups";
    case Change::fewer_lookups:
      return "fewer lookups";
    case Change::more_draws:
      return "more draws";
    case Change::fewer_draws:
      return "fewer draws";
    case Change::larger_error:
      return "larger error";
    case Change::smaller_error:
      return "smaller error";
    case Change::other_walks:
      return "other walks";
    case Change::other_setting:
      return "other setting";
    case Change::came:
      return "new";
    case Change::went:
      break;
  }
  return "gone";
}

History history_of(std::vector<RunRecord> runs, const std::vector<std::string>& files, const std::vector<TimedBlock>& blocks) {
  History history;
  for (std::size_t i = 0; i < runs.size(); ++i) history.results.push_back(result_of(std::move(runs[i]), files[i]));
  if (history.results.empty()) return history;
  refuse_other_configurations(history.results);
  drop_copies(history);
  std::stable_sort(history.results.begin(), history.results.end(), [](const HistoryResult& a, const HistoryResult& b) {
    // A merged result has the date of its first part.
    return std::pair(a.date, !a.partial) < std::pair(b.date, !b.partial);
  });
  shorten_dates(history.results);
  const std::size_t count = history.results.size();
  for (std::size_t i = 1; i < count; ++i)
    history.steps.push_back(step_to(history.results, i, i + 1 == count ? blocks : std::vector<TimedBlock>()));
  return history;
}

std::string changes_counted(const HistoryStep& step) {
  std::map<Change, std::set<std::string>> cells;
  for (const CellChange& one : step.changes) cells[one.change].insert(one.cell);
  std::string text;
  for (const auto& [change, names] : cells)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", names.size(), to_string(change));
  return text;
}

bool compares_nothing(const HistoryStep& step) { return step.compared == 0 && step.changed == 0; }

}  // namespace nullmark
