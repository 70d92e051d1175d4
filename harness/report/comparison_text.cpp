#include "harness/report/comparison_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/analysis/comparison.h"
#include "harness/io/text.h"
#include "harness/report/results_tables.h"

namespace nullmark {
namespace {

using Line = std::vector<std::string>;

/// "0.0123", "0.0123 ±4 %", "0.0123 [0.001, inf]" where the interval is wide.
std::string shown(const Interval& x) {
  if (x.exact()) return fmt::format("{:.3g}", x.value);
  const Real half = std::max(x.high / x.value - 1, 1 - x.low / x.value);
  if (half < 0.0005) return fmt::format("{:.3g}", x.value);
  return half < 0.5 ? fmt::format("{:.3g} ±{:.2g} %", x.value, 100 * half)
                    : fmt::format("{:.3g} [{:.2g}, {:.2g}]", x.value, x.low, x.high);
}
std::string shown(const std::optional<Interval>& x) { return x ? shown(*x) : "-"; }

std::string time_shown(const Contender& contender, std::size_t target) {
  const std::optional<Interval>& seconds = contender.seconds[target];
  if (seconds && !std::isfinite(seconds->value)) return "never";
  return fmt::format("{}{}", contender.amortised[target] ? "~" : "", shown(seconds));
}

std::string rank_shown(const Contender& contender) {
  return contender.rank ? fmt::format("{}{}", *contender.rank, contender.tied ? "=" : "") : "-";
}

std::string floor_shown(const Contender& contender) {
  if (!contender.cost || !contender.cost->floor) return "";
  const Interval& floor = *contender.cost->floor;
  if (floor.high == 0) return "";
  return floor.low > 0 ? fmt::format("{:.2g} %", 100 * floor.value) : fmt::format("< {:.2g} %", 100 * floor.high);
}

std::string break_even_shown(const Contender& contender) {
  if (!contender.break_even) return "";
  switch (contender.break_even->kind) {
    case BreakEven::Kind::first_sample:
      return "its first sample";
    case BreakEven::Kind::never_cheaper:
      return "never cheaper";
    case BreakEven::Kind::no_floor_seen:
      return "no floor seen";
    case BreakEven::Kind::exact:
      return "exact but for rounding";
    case BreakEven::Kind::at:
      break;
  }
  return fmt::format("{} s, at {:.2g} %", shown(contender.break_even->seconds), 100 * contender.break_even->error.value);
}

bool any_floor(const Contest& contest) {
  return std::any_of(contest.contenders.begin(), contest.contenders.end(),
                     [](const Contender& contender) { return contender.cost && contender.cost->floor; });
}

std::vector<Line> ranking(const Contest& contest) {
  const bool floors = any_floor(contest);
  Line heading = {"", "estimator", "variance", "variance x lookups", "variance x ns", "s to 1 %", "s to 0.1 %", "/ baseline"};
  if (floors) heading.insert(heading.end(), {"floor", "cheaper than the best unbiased until"});
  std::vector<Line> lines = {heading};
  for (const Contender& contender : contest.contenders) {
    const std::optional<Cost>& cost = contender.cost;
    lines.push_back({rank_shown(contender), contender.label, cost ? shown(cost->variance) : "-",
                     cost ? shown(cost->variance_x_lookups) : "-", cost ? shown(cost->variance_x_ns) : "-",
                     time_shown(contender, 0), time_shown(contender, 1), shown(contender.relative)});
    if (floors) lines.back().insert(lines.back().end(), {floor_shown(contender), break_even_shown(contender)});
  }
  return lines;
}

/// The interval alone, of a number that stands beside it.
std::string ends_shown(const Interval& x) { return fmt::format("[{:.3g}, {:.3g}]", x.low, x.high); }

/// What a sample's error says of a march with a floor is not what the means of the run say, so theirs stand beside it.
std::vector<Line> pairs(const Contest& contest) {
  const bool floors = std::any_of(contest.pairings.begin(), contest.pairings.end(),
                                  [](const Pairing& pairing) { return pairing.of_the_means.has_value(); });
  Line heading = {"estimator", "mean squared error of 1 sample / baseline's, same streams",
                  "interval if streams were independent"};
  if (floors) heading.push_back(fmt::format("of {} samples, bias included", contest.pairings[0].samples));
  std::vector<Line> lines = {heading};
  for (const Pairing& pairing : contest.pairings) {
    lines.push_back({contest.contenders[pairing.contender].label, shown(pairing.ratio), ends_shown(pairing.unpaired)});
    if (floors) lines.back().push_back(pairing.of_the_means ? shown(*pairing.of_the_means) : "");
  }
  return lines;
}

std::string not_paired(const Contest& contest) {
  std::string text;
  for (const Unpaired& one : contest.unpaired)
    text += fmt::format("{}{} {}", text.empty() ? "not paired: " : "; ", contest.contenders[one.contender].label, one.reason);
  return text.empty() ? "" : text + "\n";
}

std::string amortised_line(const Contest& contest) {
  for (const Contender& contender : contest.contenders)
    if (contender.amortised[0] || contender.amortised[1])
      return fmt::format(
          "~ fewer samples are needed than the {} that shared a walk through the majorant structure when they were timed\n",
          contender.cost->ns_by_batch.front().first);
  return "";
}

std::string baseline_line(const Contest& contest) {
  return contest.baseline ? fmt::format("baseline: {}", contest.contenders[*contest.baseline].label) : "no baseline here";
}

}  // namespace

std::string compare_text(const std::vector<RunRecord>& runs, const std::string& baseline, bool paired) {
  std::string text;
  for (const Contest& contest : contests(runs, baseline)) {
    text += fmt::format("{}\n{}", contest.name, aligned(ranking(contest), 2));
    text += amortised_line(contest);
    if (paired && !contest.pairings.empty()) text += aligned(pairs(contest), 1);
    if (paired) text += not_paired(contest);
    text += baseline_line(contest) + "\n\n";
  }
  for (const RunRecord& run : runs)
    for (const auto& [title, lines] : configured_tables(run)) text += fmt::format("{}\n{}\n", title, aligned(lines, 1));
  return text;
}

std::string compare_markdown(const std::vector<RunRecord>& runs, const std::string& baseline, bool paired) {
  std::string text;
  for (const Contest& contest : contests(runs, baseline)) {
    text += fmt::format("**{}**\n\n{}\n", markdown_cell(contest.name), markdown_table(ranking(contest)));
    if (const std::string line = amortised_line(contest); !line.empty()) text += line + "\n";
    if (paired && !contest.pairings.empty()) text += markdown_table(pairs(contest)) + "\n";
    if (paired && !contest.unpaired.empty()) text += markdown_cell(not_paired(contest)) + "\n";
    text += baseline_line(contest) + "\n\n";
  }
  for (const RunRecord& run : runs)
    for (const auto& [title, lines] : configured_tables(run))
      text += fmt::format("**{}**\n\n{}\n", markdown_cell(title), markdown_table(lines));
  return text;
}

}  // namespace nullmark
