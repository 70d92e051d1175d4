#include "harness/analysis/history_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "harness/io/text.h"
#include "harness/model/cost.h"
#include "harness/performance_gate/baseline.h"
#include "harness/statistics/rank_sum.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

/// Relative differences up to here are rounding.
constexpr Real kSameError = 1e-6;

bool is_sampled(const CellRecord& record) { return record.status == Status::ok && record.samples > 0; }

bool is_proof(Kind kind) { return kind == Kind::fail || kind == Kind::differ; }

bool is_proven_beyond(const CellRecord& record) { return record.verdict && record.verdict->beyond; }

/// Whether only the tracker, and no chance, can turn one verdict into the other.
bool verdict_change_is_proven(const CellRecord& before, const CellRecord& after, bool same_samples) {
  const Kind was = kind_of(before), is = kind_of(after);
  if (same_samples || was == Kind::error || was == Kind::untested || is == Kind::untested) return true;
  if (is_proof(is) || is == Kind::violated || is == Kind::error) return true;
  // A bias within epsilon may be proven, or passed, as the samples fall.
  return is_proof(was) && (is == Kind::pass || is == Kind::agree) && is_proven_beyond(before);
}

std::string signed_percent(Real change) {
  return std::isfinite(change) ? fmt::format("{:+.3g} %", 100 * change) : std::string("from 0");
}

bool is_drawn_in_part(const CellRecord& record) { return !record.drawn_parts.empty(); }

/// Why a sampled record has no errors of parts of its samples.
const char* why_no_errors(const CellRecord& record) {
  if (!record.outputs.empty()) return "several outputs";
  const bool known = std::all_of(record.channel.begin(), record.channel.end(),
                                 [](const ChannelRecord& channel) { return channel.reference.has_value(); });
  return known && !record.channel.empty() ? "too few samples" : "no reference";
}

/// The mean of the parts' mean squared errors.
Real mean_square(const std::vector<Real>& parts) {
  return std::accumulate(parts.begin(), parts.end(), Real{0}) / static_cast<Real>(parts.size());
}

/// Mean square, over the channels, of what rounding leaves.
Real rounding_square(const CellRecord& record) {
  Real largest = 0;
  for (const ChannelRecord& channel : record.channel) largest = std::max(largest, kRounding * channel.reference_rms.value_or(0));
  return largest * largest;
}

class StepComparer {
 public:
  StepComparer(const HistoryResult& before, const HistoryResult& after)
      : before_(before),
        after_(after),
        was_(counts_of(before.run, before.file)),
        is_(counts_of(after.run, after.file)),
        same_build_(was_.build.known() && was_.build == is_.build) {}

  HistoryStep compare(const std::vector<TimedBlock>& blocks) {
    match();
    for (const auto& [before, after] : pairs_) compare_verdicts(*before, *after);
    compare_errors();
    compare_costs();
    compare_times(blocks);
    std::stable_sort(step_.changes.begin(), step_.changes.end(),
                     [](const CellChange& a, const CellChange& b) { return a.change < b.change; });
    std::set<std::string> changed;
    for (const CellChange& one : step_.changes) changed.insert(one.cell);
    step_.changed = changed.size();
    for (const auto& [text, cells] : not_compared_)
      step_.notes.push_back(fmt::format("{} in {} cell{}", text, cells.size(), cells.size() == 1 ? "" : "s"));
    return std::move(step_);
  }

 private:
  void changed(const std::string& cell, Change change, std::string before, std::string after, std::string note) {
    step_.changes.push_back({cell, change, std::move(before), std::move(after), std::move(note)});
  }

  /// Cells are the same where their names are.
  void match() {
    std::map<std::string, const CellRecord*> earlier;
    for (const CellRecord& record : before_.run.cells) earlier.emplace(record.cell.name, &record);
    std::size_t absent = 0, not_run = 0, in_part = 0, was_in_part = 0;
    for (const CellRecord& after : after_.run.cells) {
      ++step_.cells;
      const auto at = earlier.find(after.cell.name);
      const CellRecord* before = at == earlier.end() ? nullptr : at->second;
      if (before) earlier.erase(at);
      if (is_drawn_in_part(after))
        ++in_part;
      else if (before && is_drawn_in_part(*before))
        ++was_in_part;
      else if (before &&
               (is_sampled(*before) || is_sampled(after) || before->status == Status::error || after.status == Status::error))
        add_pair(*before, after);
      else if (!before && !before_.partial)
        changed(after.cell.name, Change::came, "", marked_word(after), "");
      else
        ++(before ? not_run : absent);
    }
    for (const CellRecord& before : before_.run.cells) {
      if (!earlier.contains(before.cell.name)) continue;
      ++step_.cells;
      if (after_.partial)
        ++absent;
      else
        changed(before.cell.name, Change::went, marked_word(before), "", "");
    }
    if (in_part > 0)
      step_.notes.push_back(
          fmt::format("{} cell{} drawn in part, so not compared: merge the results of all shards, or draw the rest with "
                      "`nullmark run CONFIG --resume`",
                      in_part, in_part == 1 ? "" : "s"));
    if (was_in_part > 0)
      step_.notes.push_back(fmt::format("{} cell{} drawn in part in the earlier result, so not compared", was_in_part,
                                        was_in_part == 1 ? "" : "s"));
    tell_seeds();
    if (absent > 0)
      step_.notes.push_back(fmt::format("{} cell{} in one of the results only, because {}", absent, absent == 1 ? "" : "s",
                                        before_.partial && after_.partial
                                            ? "both hold a part of the cells: `nullmark merge` joins shards of one run"
                                            : "the other holds a part of the cells"));
    if (not_run > 0) step_.notes.push_back(fmt::format("{} cell{} not run in both results", not_run, not_run == 1 ? "" : "s"));
  }

  void add_pair(const CellRecord& before, const CellRecord& after) {
    const Kind was = kind_of(before), is = kind_of(after);
    if (was == Kind::not_run && is != Kind::not_run)
      return changed(after.cell.name, Change::came, "not run", marked_word(after), "");
    if (was != Kind::not_run && is == Kind::not_run)
      return changed(after.cell.name, Change::went, marked_word(before), "not run", after.reason);
    pairs_.emplace_back(&before, &after);
    if (!is_sampled(before) || !is_sampled(after)) return;
    ++step_.compared;
    if (before.cell.samples_per_ray != after.cell.samples_per_ray)
      ++step_.other_samples[{before.cell.samples_per_ray, after.cell.samples_per_ray}];
  }

  /// "other seed (1 → 7) in 54 cells": whoever reads of differences must know of it.
  void tell_seeds() {
    constexpr std::size_t kNamed = 2;
    std::map<std::pair<std::uint64_t, std::uint64_t>, std::size_t> seeds;
    std::size_t cells = 0;
    for (const auto& [before, after] : pairs_)
      if (before->cell.seed != after->cell.seed) ++seeds[{before->cell.seed, after->cell.seed}], ++cells;
    if (cells == 0) return;
    std::string named;
    std::size_t left = kNamed;
    for (auto at = seeds.begin(); at != seeds.end() && left > 0; ++at, --left)
      named += fmt::format("{}{} → {}", named.empty() ? "" : ", ", at->first.first, at->first.second);
    if (seeds.size() > kNamed) named += fmt::format(", and {} more", seeds.size() - kNamed);
    step_.notes.push_back(
        fmt::format("other seed ({}) in {} cell{}: their samples differ by chance", named, cells, cells == 1 ? "" : "s"));
  }

  /// Whether the same build drew the same samples, so that no difference is chance.
  bool same_samples(const CellRecord& before, const CellRecord& after) const {
    return same_build_ && before.cell.id == after.cell.id && before.samples == after.samples && before.build == after.build &&
           !before.tracker.unrepeatable && !after.tracker.unrepeatable;
  }

  void compare_verdicts(const CellRecord& before, const CellRecord& after) {
    if (kind_of(before) == kind_of(after)) return;
    CellChange one{after.cell.name, Change::verdict, marked_word(before), marked_word(after), finding_of(after)};
    const bool proven = verdict_change_is_proven(before, after, same_samples(before, after));
    (proven ? step_.changes : step_.undecided).push_back(std::move(one));
  }

  void compare_errors() {
    std::map<std::string, const CellCounts*> was, is;
    for (const CellCounts& cell : was_.cells) was.emplace(cell.name, &cell);
    for (const CellCounts& cell : is_.cells) is.emplace(cell.name, &cell);
    const Real level = kFalseErrorChanges / static_cast<Real>(std::max<std::size_t>(1, pairs_.size()));
    for (const auto& [before, after] : pairs_) {
      if (!is_sampled(*before) || !is_sampled(*after)) continue;
      const std::string& name = after->cell.name;
      if (was.at(name)->setting != is.at(name)->setting) {
        changed(name, Change::other_setting, "", "", "other rays, medium or parameters under the same name");
        continue;
      }
      compare_error(*before, *after, level);
    }
  }

  /// Parts of equal numbers of samples are exchangeable where the tracker is the same.
  void compare_error(const CellRecord& before, const CellRecord& after, Real level) {
    const std::vector<Real>&was = before.squared_error_blocks, &is = after.squared_error_blocks;
    if (was.empty() || is.empty() || was.size() != is.size())
      return not_compared(fmt::format("errors not compared: {}", why_no_errors(was.empty() ? before : after)), after);
    if (before.samples != after.samples || before.rays != after.rays)
      return not_compared("errors not compared: other numbers of samples", after);
    const Real then = mean_square(was), now = mean_square(is);
    if (std::max(then, now) <= std::max(rounding_square(before), rounding_square(after))) return;
    const Real change = then == 0 ? kInfinity : std::sqrt(now / then) - 1;
    if (std::abs(change) <= kSameError || rank_sum_probability(was, is) > level) return;
    changed(after.cell.name, change > 0 ? Change::larger_error : Change::smaller_error, short_number(std::sqrt(then)),
            short_number(std::sqrt(now)), signed_percent(change) + " rmse of a sample");
  }

  void compare_costs() {
    std::map<std::string, std::pair<const CellRecord*, const CellRecord*>> records;
    for (const auto& pair : pairs_) records[pair.second->cell.name] = pair;
    const std::vector<GateRow> rows = compare_counts(was_, is_).rows;
    // Of lookups, draws and other counts of the same walks one is told; what is proven comes first.
    std::set<std::string> told;
    for (const bool proven : {true, false})
      for (const GateRow& row : rows)
        if (const auto at = records.find(row.cell); at != records.end())
          tell_cost(row, *at->second.first, *at->second.second, proven, told);
  }

  void tell_cost(const GateRow& row, const CellRecord& before, const CellRecord& after, bool proven,
                 std::set<std::string>& told) {
    if (row.finding == GateResult::not_compared)
      return not_compared(fmt::format("{} not compared: {}", row.tier == Tier::counts ? "exact counts" : row.metric, row.note),
                          after);
    const bool up = row.finding == GateResult::regression, down = row.finding == GateResult::better;
    if ((up || down) != proven) return;
    if (!proven && row.finding != GateResult::changed && row.finding != GateResult::undecided) return;
    const bool of_walks = row.tier == Tier::counts || row.tier == Tier::expected;
    if (row.tier == Tier::counts && !same_samples(before, after)) return;
    if (of_walks && !told.insert(row.cell).second) return;
    CellChange one{row.cell, change_of(row, proven, up), short_number(row.before), short_number(row.after),
                   fmt::format("{} {}", signed_percent(*row.change), row.metric)};
    (row.finding == GateResult::undecided ? step_.undecided : step_.changes).push_back(std::move(one));
  }

  static Change change_of(const GateRow& row, bool proven, bool up) {
    if (row.tier == Tier::instructions) return up ? Change::more_instructions : Change::fewer_instructions;
    if (row.tier == Tier::misses) return up ? Change::more_misses : Change::fewer_misses;
    if (!proven && row.tier == Tier::counts) return Change::other_walks;
    if (row.metric == "draws") return up ? Change::more_draws : Change::fewer_draws;
    return up || (!proven && *row.change > 0) ? Change::more_lookups : Change::fewer_lookups;
  }

  void compare_times(const std::vector<TimedBlock>& blocks) {
    if (!blocks.empty()) {
      step_.time = fmt::format(
          "times: {} blocks of runs that took turns; of the cells called slower or faster, at most 5 % are "
          "so by chance",
          blocks.size());
      for (const GateRow& row : compare_wall_time(blocks, {}, false)) compare_time(row);
      return;
    }
    const auto timed = [](const RunRecord& run) {
      return std::any_of(run.cells.begin(), run.cells.end(), [](const CellRecord& record) { return record.time.has_value(); });
    };
    if (!timed(before_.run) || !timed(after_.run))
      step_.time = "times have no verdict: not both results were timed";
    else if (before_.cpu != after_.cpu)
      step_.time = fmt::format("times have no verdict: measured on another CPU, {} and then {}", before_.cpu, after_.cpu);
    else if (!(was_.build == is_.build))
      step_.time = fmt::format("times have no verdict: another build, {} and then {}", was_.build.text(), is_.build.text());
    else
      step_.time =
          "times have no verdict: between single runs the machine changes as much; scripts/compare-builds OLD_PROGRAM "
          "NEW_PROGRAM "
          "CONFIG FOLDER measures them in turn, and --blocks FOLDER judges that";
  }

  void compare_time(const GateRow& row) {
    if (row.finding == GateResult::noisy) {
      step_.time = "times have no verdict: " + row.note;
      return;
    }
    const bool slower = row.finding == GateResult::slower || row.finding == GateResult::regression;
    const bool faster = row.finding == GateResult::better;
    if (!slower && !faster && row.finding != GateResult::undecided) return;
    CellChange one{row.cell, slower || (!faster && *row.change > 0) ? Change::slower : Change::faster, "", "",
                   fmt::format("{} [{}, {}]", signed_percent(*row.change), signed_percent(*row.low), signed_percent(*row.high))};
    (slower || faster ? step_.changes : step_.undecided).push_back(std::move(one));
  }

  void not_compared(const std::string& text, const CellRecord& record) { not_compared_[text].insert(record.cell.name); }

  const HistoryResult &before_, &after_;
  Counts was_, is_;
  bool same_build_;
  std::vector<std::pair<const CellRecord*, const CellRecord*>> pairs_;
  std::map<std::string, std::set<std::string>> not_compared_;
  HistoryStep step_;
};

}  // namespace

HistoryStep compare_results(const HistoryResult& before, const HistoryResult& after, const std::vector<TimedBlock>& blocks) {
  return StepComparer(before, after).compare(blocks);
}

}  // namespace nullmark
