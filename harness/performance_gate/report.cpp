#include "harness/performance_gate/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "harness/io/text.h"

namespace nullmark {
namespace {

constexpr GateResult kGravest[] = {GateResult::regression, GateResult::slower, GateResult::noisy,        GateResult::undecided,
                                   GateResult::changed,    GateResult::better, GateResult::not_compared, GateResult::same};

std::string percent(const std::optional<Real>& change) {
  if (!change) return "-";
  if (!std::isfinite(*change)) return "from 0";
  return fmt::format("{:+.3g} %", 100 * *change);
}

std::string confidence(const GateRow& row) {
  if (row.confidence.empty()) return "-";
  if (row.low == row.high) return row.confidence;
  return fmt::format("{} to {}, {}", percent(row.low), percent(row.high), row.confidence);
}

std::string tier_name(const GateRow& row) { return fmt::format("{} {}", static_cast<int>(row.tier), to_string(row.tier)); }

/// What a comparison says, as one line.
std::string sentence(const GateRow& row) {
  std::string text = to_string(row.finding);
  if (row.change)
    text +=
        fmt::format(": {} {}, threshold {:.3g} % ({})", row.metric, percent(row.change), 100 * row.threshold, confidence(row));
  if (!row.note.empty()) text += (row.change ? "; " : ": ") + row.note;
  return text;
}

std::vector<const GateRow*> by_gravity(const PerformanceReport& report, bool all) {
  std::vector<const GateRow*> rows;
  for (const GateResult finding : kGravest)
    for (const GateRow& row : report.rows)
      if (row.finding == finding && (all || (finding != GateResult::same && finding != GateResult::not_compared)))
        rows.push_back(&row);
  return rows;
}

const std::vector<std::string> kHeading = {"cell",   "tier",      "metric",     "before", "after",
                                           "change", "threshold", "confidence", "finding"};

std::vector<std::string> words(const GateRow& row) {
  return {row.cell,
          tier_name(row),
          row.metric,
          short_number(row.before),
          short_number(row.after),
          percent(row.change),
          fmt::format("{:.3g} %", 100 * row.threshold),
          confidence(row),
          fmt::format("{}{}{}", to_string(row.finding), row.note.empty() ? "" : ": ", row.note)};
}

/// "tier 1, exact counts: 3 same, 1 REGRESSION", one line for each tier that compared anything.
std::vector<std::string> totals(const PerformanceReport& report) {
  std::vector<std::string> lines;
  for (const Tier tier : kTiers) {
    std::string line;
    for (const GateResult finding : kGravest)
      if (const std::size_t count = report.count(tier, finding); count > 0)
        line += fmt::format("{}{} {}", line.empty() ? "" : ", ", count, to_string(finding));
    lines.push_back(
        fmt::format("tier {}, {}: {}", static_cast<int>(tier), to_string(tier), line.empty() ? "nothing to compare" : line));
  }
  return lines;
}

/// Why comparisons were not made, how many and an example, one line for each reason: cells that silently vanish would keep a
/// comparison green.
std::vector<std::string> left_out(const PerformanceReport& report) {
  std::map<std::string, std::pair<std::size_t, std::string>> reasons;
  for (const GateRow& row : report.rows) {
    if (row.finding != GateResult::not_compared) continue;
    auto& [count, example] = reasons[fmt::format("tier {}, {}", static_cast<int>(row.tier), row.note)];
    if (++count == 1) example = row.cell;
  }
  std::vector<std::string> lines;
  lines.reserve(reasons.size());
  for (const auto& [reason, seen] : reasons)
    lines.push_back(
        fmt::format("not compared ({}): {} cell{}, for example {}", reason, seen.first, seen.first == 1 ? "" : "s", seen.second));
  return lines;
}

/// "exact counts, instructions": the tiers that compared something, or those that did not.
std::string tiers(const PerformanceReport& report, bool compared) {
  std::string names;
  for (const Tier tier : kTiers)
    if (report.compared(tier) == compared) names += fmt::format("{}{}", names.empty() ? "" : ", ", to_string(tier));
  return names;
}

std::string conclusion(const PerformanceReport& report) {
  const std::string unmeasured = tiers(report, false);
  const std::string rest = unmeasured.empty() ? "" : fmt::format("; not compared: {}", unmeasured);
  if (const std::size_t regressions = report.count(GateResult::regression); regressions > 0)
    return fmt::format("{} performance regression{} proven{}", regressions, regressions == 1 ? "" : "s", rest);
  if (tiers(report, true).empty()) return "nothing could be compared";
  if (!report.missing.empty()) return fmt::format("not compared as required{}", rest);
  return fmt::format("no performance regression proven by {}{}", tiers(report, true), rest);
}

/// One line for each sentence of `missing`.
std::vector<std::string> missing(const PerformanceReport& report) {
  std::vector<std::string> lines;
  lines.reserve(report.missing.size());
  for (const std::string& sentence : report.missing) lines.push_back("missing: " + sentence);
  return lines;
}

/// What to do about counts that differ from a baseline's.
std::string remedy(const PerformanceReport& report) {
  std::size_t differ = 0;
  for (const GateRow& row : report.rows)
    differ += row.tier != Tier::wall_time &&
              (row.finding == GateResult::regression || row.finding == GateResult::changed || row.finding == GateResult::better);
  if (differ == 0) return "";
  return fmt::format("{} counts are not {}'s; if that is meant, make these the baseline with --update and review the difference",
                     differ, report.before);
}

}  // namespace

std::string performance_text(const PerformanceReport& report) {
  std::string text = fmt::format("{}: {}\n{} against {}\n", report.name, conclusion(report), report.after, report.before);
  std::vector<std::vector<std::string>> lines = {kHeading};
  for (const GateRow* row : by_gravity(report, false)) lines.push_back(words(*row));
  if (lines.size() > 1) text += aligned(lines, 3);
  for (const std::string& line : totals(report)) text += line + "\n";
  for (const std::string& note : report.notes) text += note + "\n";
  for (const std::string& line : left_out(report)) text += line + "\n";
  for (const std::string& line : missing(report)) text += line + "\n";
  if (const std::string line = remedy(report); !line.empty()) text += line + "\n";
  return text;
}

std::string performance_markdown(const PerformanceReport& report) {
  std::string text = fmt::format("### nullmark gate: {}\n\n{} against {}: **{}**.\n\n", markdown_cell(report.name),
                                 markdown_cell(report.after), markdown_cell(report.before), conclusion(report));
  for (const auto& lines : {totals(report), report.notes, left_out(report), missing(report)})
    for (const std::string& line : lines) text += fmt::format("- {}\n", markdown_cell(line));
  if (const std::string line = remedy(report); !line.empty()) text += fmt::format("- {}\n", markdown_cell(line));
  const auto table = [&](const std::vector<const GateRow*>& rows) {
    std::string result;
    for (const std::string& word : kHeading) result += fmt::format("| {} ", word);
    result += "|\n|---|---|---|---|---|---|---|---|---|\n";
    for (const GateRow* row : rows) {
      for (const std::string& word : words(*row)) result += fmt::format("| {} ", markdown_cell(word));
      result += "|\n";
    }
    return result;
  };
  if (const auto grave = by_gravity(report, false); !grave.empty()) text += fmt::format("\n{}", table(grave));
  text += fmt::format("\n<details><summary>All comparisons ({})</summary>\n\n{}\n</details>\n", report.rows.size(),
                      table(by_gravity(report, true)));
  return text;
}

std::string performance_junit(const PerformanceReport& report) {
  std::string cases;
  std::size_t failures = 0, skipped = 0;
  for (const GateRow& row : report.rows) {
    cases += fmt::format("    <testcase classname=\"tier {}, {}\" name=\"{}: {}\"", static_cast<int>(row.tier),
                         to_string(row.tier), xml(row.cell), xml(row.metric));
    if (row.finding == GateResult::same || row.finding == GateResult::better) {
      cases += "/>\n";
      continue;
    }
    const bool failed = row.finding == GateResult::regression;
    ++(failed ? failures : skipped);
    cases +=
        fmt::format(">\n      <{0} message=\"{1}\"/>\n    </testcase>\n", failed ? "failure" : "skipped", xml(sentence(row)));
  }
  for (const std::string& sentence : report.missing)
    cases += fmt::format(
        "    <testcase classname=\"required\" name=\"{0}\">\n      <error message=\"missing: {1}\"/>\n    </testcase>\n",
        xml(sentence.substr(0, sentence.find(':'))), xml(sentence));
  const std::string counts = fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\"",
                                         report.rows.size() + report.missing.size(), failures, report.missing.size(), skipped);
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {0}>\n  <testsuite name=\"{1}\" {0}>\n{2}  "
      "</testsuite>\n</testsuites>\n",
      counts, xml(report.name), cases);
}

}  // namespace nullmark
