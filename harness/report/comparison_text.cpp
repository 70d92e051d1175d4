#include "harness/report/comparison_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "harness/analysis/comparison.h"
#include "harness/io/text.h"
#include "harness/report/results_tables.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

using Line = std::vector<std::string>;

/// "0.0123", "0.0123 ±4 %", "0.0123 [0.001, inf]" where the interval is wide.
std::string shown(const Interval& x) {
  if (x.exact()) return fmt::format("{:.3g}", x.value);
  const Real half = std::max(x.high / x.value - 1, 1 - x.low / x.value);
  if (half < 0.0005) return fmt::format("{:.3g}", x.value);
  return half < 0.5 ? fmt::format("{:.3g} ±{:.2g} %", x.value, 100 * half)
                    : fmt::format("{:.3g} [{:.3g}, {:.3g}]", x.value, x.low, x.high);
}
std::string shown(const std::optional<Interval>& x) { return x ? shown(*x) : "-"; }

std::string time_shown(const RankedCell& ranked, std::size_t target) {
  const std::optional<Interval>& seconds = ranked.seconds[target];
  if (seconds && !std::isfinite(seconds->value)) return "never";
  const bool unproven = seconds && !is_proven_to_reach(ranked, kTargets[target]);
  return fmt::format("{}{}{}", ranked.amortised[target] ? "~" : "", shown(seconds), unproven ? "*" : "");
}

std::string rank_shown(const RankedCell& ranked) {
  return ranked.rank ? fmt::format("{}{}", *ranked.rank, ranked.tied ? "=" : "") : "-";
}

std::string floor_shown(const RankedCell& ranked) {
  if (!ranked.cost || !ranked.cost->floor) return "";
  const Interval& floor = *ranked.cost->floor;
  if (floor.high == 0) return "";
  return floor.low > 0 ? fmt::format("{:.2g} %", 100 * floor.value) : fmt::format("< {:.2g} %", 100 * floor.high);
}

std::string break_even_shown(const Comparison& comparison, const RankedCell& ranked) {
  if (!ranked.break_even) return "";
  if (ranked.break_even->kind != BreakEven::Kind::at) return to_string(ranked.break_even->kind);
  return fmt::format("{} s, at {:.2g} %{}", shown(ranked.break_even->seconds), 100 * ranked.break_even->error.value,
                     break_even_is_unproven(comparison, ranked) ? "*" : "");
}

bool any_floor(const Comparison& comparison) {
  return std::any_of(comparison.cells.begin(), comparison.cells.end(),
                     [](const RankedCell& ranked) { return ranked.cost && ranked.cost->floor; });
}

bool any_alone(const Comparison& comparison) {
  return std::any_of(comparison.cells.begin(), comparison.cells.end(),
                     [](const RankedCell& ranked) { return ranked.cost && ranked.cost->variance_x_ns_alone; });
}

constexpr const char *kAlone = "alone", *kFloor = "floor", *kBreakEven = "cheaper than the best unbiased until";

/// The columns of a table whose headings are wanted.
template <class Wanted>
std::vector<Line> with_columns(const std::vector<Line>& whole, const Wanted& wanted) {
  std::vector<Line> lines(whole.size());
  for (std::size_t c = 0; c < whole[0].size(); ++c) {
    if (!wanted(whole[0][c])) continue;
    for (std::size_t i = 0; i < whole.size(); ++i) lines[i].push_back(whole[i][c]);
  }
  return lines;
}

std::vector<Line> ranking(const Comparison& comparison) {
  std::vector<Line> lines = {{"", "estimator"}};
  lines[0].insert(lines[0].end(), comparison_columns().begin(), comparison_columns().end());
  for (const RankedCell& ranked : comparison.cells) {
    const std::optional<Cost>& cost = ranked.cost;
    lines.push_back({rank_shown(ranked), ranked.label, marked_word(*ranked.record), time_shown(ranked, 0), time_shown(ranked, 1),
                     shown(ranked.relative), cost ? shown(cost->variance) : "-", cost ? shown(cost->variance_x_lookups) : "-",
                     cost ? shown(cost->variance_x_ns) : "-", cost ? shown(cost->variance_x_ns_alone) : "-", floor_shown(ranked),
                     break_even_shown(comparison, ranked)});
  }
  const bool floors = any_floor(comparison), alone = any_alone(comparison);
  return with_columns(lines, [&](const std::string& heading) {
    return heading == kAlone ? alone : heading == kFloor || heading == kBreakEven ? floors : true;
  });
}

/// The columns of a ranking that a page of paper has room for.
std::vector<Line> for_a_page(const std::vector<Line>& whole) {
  const std::vector<std::string> kept = {"", "estimator", "verdict", "variance", "s to 1 %", "/ baseline", "floor"};
  return with_columns(whole,
                      [&](const std::string& heading) { return std::find(kept.begin(), kept.end(), heading) != kept.end(); });
}

/// The interval alone, of a number that stands beside it.
std::string ends_shown(const Interval& x) { return fmt::format("[{:.3g}, {:.3g}]", x.low, x.high); }

/// What a sample's error says of a march with a floor is not what the means of the run say, so theirs stand beside it.
std::vector<Line> pairs(const Comparison& comparison) {
  const bool floors = std::any_of(comparison.pairings.begin(), comparison.pairings.end(),
                                  [](const Pairing& pairing) { return pairing.of_the_means.has_value(); });
  Line heading = {"estimator", "mean squared error of 1 sample / baseline's, same streams",
                  "interval if streams were independent"};
  if (floors) heading.push_back(fmt::format("of {} samples, bias included", comparison.pairings[0].samples));
  std::vector<Line> lines = {heading};
  for (const Pairing& pairing : comparison.pairings) {
    lines.push_back({comparison.cells[pairing.ranked].label, shown(pairing.ratio), ends_shown(pairing.unpaired)});
    if (floors) lines.back().push_back(pairing.of_the_means ? shown(*pairing.of_the_means) : "");
  }
  return lines;
}

std::string not_paired(const Comparison& comparison) {
  std::string text;
  for (const Unpaired& one : comparison.unpaired)
    text += fmt::format("{}{} {}", text.empty() ? "not paired: " : "; ", comparison.cells[one.ranked].label, one.reason);
  return text.empty() ? "" : text + "\n";
}

std::string amortised_line(const Comparison& comparison) {
  for (const RankedCell& ranked : comparison.cells)
    if (ranked.amortised[0] || ranked.amortised[1])
      return fmt::format(
          "~ fewer samples are needed than the {} that shared a walk through the majorant structure when they were timed\n",
          ranked.cost->ns_by_batch.front().first);
  return "";
}

std::string unproven_line(const Comparison& comparison) {
  const std::string note = unproven_note(comparison);
  return note.empty() ? "" : fmt::format("* {}\n", note);
}

std::string remark_lines(const Comparison& comparison) {
  std::string text;
  for (const Remark& remark : comparison.remarks) {
    std::vector<std::string> labels;
    for (const std::size_t i : remark.cells) labels.push_back(comparison.cells[i].label);
    const std::string names = fmt::format("{}", fmt::join(labels, ", "));
    text += remark.kind == Remark::Kind::equal
                ? fmt::format("the same samples to the last bit: {}\n", names)
                : fmt::format(
                      "timed with walks side by side in registers: {}; the others ran one walk at a time; \"lanes\": false in "
                      "the configuration times all alike\n",
                      names);
  }
  return text;
}

/// Ranks of one tracker that differ: what is said of one of its results does not hold of all.
std::string split_lines(const Comparison& comparison) {
  std::map<std::string, std::vector<std::string>> ranks;
  // Cells are in the order of their ranks.
  for (const RankedCell& ranked : comparison.cells) {
    if (!ranked.seconds[0]) continue;
    const std::string rank = ranked.rank ? fmt::to_string(*ranked.rank) : "never";
    std::vector<std::string>& of = ranks[ranked.tracker];
    if (of.empty() || of.back() != rank) of.push_back(rank);
  }
  std::string text;
  for (const auto& [tracker, of] : ranks)
    if (of.size() > 1)
      text += fmt::format("ranks of {}: {}; a tracker is faster than another only if all of its results are\n", tracker,
                          fmt::join(of, " and "));
  return text;
}

/// Why cells that have a time are not compared with the baseline.
std::string same_tracker_line(const Comparison& comparison) {
  if (!comparison.baseline || !comparison.cells[*comparison.baseline].rank) return "";
  const bool some = std::any_of(comparison.cells.begin(), comparison.cells.end(),
                                [](const RankedCell& ranked) { return ranked.rank && !ranked.relative; });
  return some ? "- under / baseline: another result of the baseline's tracker, which is no rival\n" : "";
}

/// Of trackers in processes of their own: what is theirs of their time.
std::string seam_lines(const Comparison& comparison) {
  std::string text;
  for (const RankedCell& ranked : comparison.cells) {
    const std::optional<TimeRecord>& time = ranked.record->time;
    if (time && time->seam_ns_per_sample > 0)
      text += fmt::format(
          "{}: of {:.4g} ns a sample, {:.4g} are exchanges with its process and {:.4g} its own; {} samples share an exchange, "
          "set by samples_per_traversal\n",
          ranked.label, time->ns_per_sample, std::min(time->seam_ns_per_sample, time->ns_per_sample),
          std::max<Real>(0, time->ns_per_sample - time->seam_ns_per_sample), time->samples_per_traversal);
    if (ranked.record->tracker.lookups_told)
      text += fmt::format("{}: lookups as the tracker tells them, not counted\n", ranked.label);
  }
  return text;
}

/// In how many scenes each tracker is among the fastest, the most frequent first: "ratio in 2 scenes, delta in 1 scene".  Several
/// results of a tracker count once; those that not all have this rank are named one by one.
std::string fastest_counted(const std::vector<Comparison>& all, bool unbiased) {
  constexpr std::size_t kNamed = 2;
  std::vector<std::pair<std::string, std::size_t>> wins;
  for (const Comparison& comparison : all) {
    std::set<std::string> counted;
    for (const std::size_t i : fastest(comparison, unbiased)) {
      const RankedCell& ranked = comparison.cells[i];
      const std::string& tracker = ranked.split ? ranked.label : ranked.tracker;
      if (!counted.insert(tracker).second) continue;
      const auto at = std::find_if(wins.begin(), wins.end(), [&](const auto& win) { return win.first == tracker; });
      at == wins.end() ? void(wins.emplace_back(tracker, 1)) : void(++at->second);
    }
  }
  std::stable_sort(wins.begin(), wins.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::vector<std::string> named;
  for (std::size_t i = 0; i < std::min(kNamed, wins.size()); ++i)
    named.push_back(fmt::format("{} in {} scene{}", wins[i].first, wins[i].second, wins[i].second == 1 ? "" : "s"));
  const std::size_t more = wins.size() - named.size();
  return fmt::format("{}{}", fmt::join(named, ", "),
                     more > 0 ? fmt::format(" and {} more tracker{}", more, more == 1 ? "" : "s") : "");
}

bool has_rivals(const Comparison& comparison) {
  return std::any_of(comparison.cells.begin(), comparison.cells.end(),
                     [&](const RankedCell& other) { return other.tracker != comparison.cells[0].tracker; });
}

/// Who is fastest where, in the words of the report's summary.  Whoever is alone in a scene has won nothing.
std::string fastest_line(const std::vector<Comparison>& comparisons) {
  if (std::none_of(comparisons.begin(), comparisons.end(), [](const Comparison& one) { return !fastest(one, false).empty(); }))
    return "no tracker is ranked: none was timed, or none reaches 1 %\n\n";
  std::vector<Comparison> all;
  std::copy_if(comparisons.begin(), comparisons.end(), std::back_inserter(all),
               [](const Comparison& one) { return has_rivals(one) && !fastest(one, false).empty(); });
  const std::size_t ranked = all.size();
  if (ranked == 0) return "no scene has two trackers to compare\n\n";
  const std::string unbiased = fastest_counted(all, true);
  return fmt::format(
      "Fastest to 1 % error, alone or tied, of {} scene{}: {}{}\nA rank is 1 plus the number of trackers that are proven "
      "faster\n\n",
      ranked, ranked == 1 ? "" : "s", fastest_counted(all, false),
      unbiased.empty() ? "" : "; of those that claim to be unbiased: " + unbiased);
}

std::string baseline_line(const Comparison& comparison) {
  return comparison.baseline ? fmt::format("baseline: {}", comparison.cells[*comparison.baseline].label) : "no baseline here";
}

}  // namespace

const std::vector<std::string>& comparison_columns() {
  // Costs come first: a narrow terminal leaves out what is on the right.
  static const std::vector<std::string> kColumns = {
      "verdict",       "s to 1 %", "s to 0.1 %", "/ baseline", "variance", "variance x lookups",
      "variance x ns", kAlone,     kFloor,       kBreakEven};
  return kColumns;
}

std::string compare_text(const std::vector<RunRecord>& runs, const std::string& baseline, bool paired, const TableShape& shape) {
  const std::vector<Comparison> all = comparisons(runs, baseline);
  std::string text = all.empty() ? "" : fastest_line(all);
  std::vector<std::string> left_out;
  for (const Comparison& comparison : all) {
    text += fmt::format("{}\n{}", comparison.name, shaped(ranking(comparison), 3, 2, shape, left_out));
    text += amortised_line(comparison) + unproven_line(comparison) + split_lines(comparison) + same_tracker_line(comparison) +
            seam_lines(comparison) + remark_lines(comparison);
    if (paired && !comparison.pairings.empty()) text += fitted(pairs(comparison), 1, shape.width, left_out);
    if (paired) text += not_paired(comparison);
    text += baseline_line(comparison) + "\n\n";
  }
  for (const RunRecord& run : runs)
    for (const auto& [title, lines] : configured_tables(run))
      text += fmt::format("{}\n{}\n", title, fitted(lines, 1, shape.width, left_out));
  return text + left_out_line(left_out);
}

std::string compare_latex(const std::vector<RunRecord>& runs, const std::string& baseline) {
  std::string text =
      fmt::format("{}: tables for \\usepackage{{booktabs,graphicx}}; \\pm and brackets are intervals of 95 %\n", kLatexBeginning);
  for (const Comparison& comparison : comparisons(runs, baseline)) {
    std::vector<std::string> notes = {amortised_line(comparison), unproven_line(comparison), baseline_line(comparison) + "\n"};
    std::string caption = comparison.name;
    for (const std::string& note : notes)
      if (!note.empty()) caption += "; " + note.substr(0, note.size() - 1);
    text += latex_table(for_a_page(ranking(comparison)), 3, caption);
  }
  for (const RunRecord& run : runs)
    for (const auto& [title, lines] : configured_tables(run)) text += latex_table(lines, 1, title);
  return text;
}

std::string compare_markdown(const std::vector<RunRecord>& runs, const std::string& baseline, bool paired) {
  std::string text = "### nullmark compare\n\n";
  for (const Comparison& comparison : comparisons(runs, baseline)) {
    text += fmt::format("**{}**\n\n{}\n", markdown_cell(comparison.name), markdown_table(ranking(comparison)));
    // A line that begins with a star or a dash would be a list.
    const std::string unproven = unproven_line(comparison);
    const std::string same = same_tracker_line(comparison);
    for (const std::string& line : {amortised_line(comparison), unproven.empty() ? "" : "\\" + unproven, split_lines(comparison),
                                    same.empty() ? "" : "\\" + same, seam_lines(comparison), remark_lines(comparison)})
      if (!line.empty()) text += markdown_cell(line) + "\n";
    if (paired && !comparison.pairings.empty()) text += markdown_table(pairs(comparison)) + "\n";
    if (paired && !comparison.unpaired.empty()) text += markdown_cell(not_paired(comparison)) + "\n";
    text += markdown_cell(baseline_line(comparison)) + "\n\n";
  }
  for (const RunRecord& run : runs)
    for (const auto& [title, lines] : configured_tables(run))
      text += fmt::format("**{}**\n\n{}\n", markdown_cell(title), markdown_table(lines));
  return text;
}

}  // namespace nullmark
