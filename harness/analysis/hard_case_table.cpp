#include "harness/analysis/hard_case_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "harness/config/cell_names.h"
#include "harness/io/text.h"
#include "harness/model/metrics.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

using Line = std::vector<std::string>;

/// How often each word was said, in the order of their first appearance.
class Tally {
 public:
  void add(const std::string& word) {
    const auto at = std::find_if(counts_.begin(), counts_.end(), [&](const auto& count) { return count.first == word; });
    if (at == counts_.end())
      counts_.emplace_back(word, 1);
    else
      ++at->second;
  }
  std::string text() const {
    std::string text;
    for (const auto& [word, count] : counts_) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, word);
    return text.empty() ? "-" : text;
  }

 private:
  std::vector<std::pair<std::string, int>> counts_;
};

void raise(std::optional<Real>& most, Real x) { most = std::max(most.value_or(x), x); }

/// All cells of one tracker in one experiment.
struct Case {
  std::string experiment, tracker;
  std::size_t cells = 0;
  std::uint64_t samples = 0, nonfinite = 0;
  std::optional<Real> largest{}, relative_error{}, standard_errors{}, fewest_lookups{}, most_lookups{};
  Tally verdicts{}, guards{};

  void add(const CellRecord& record) {
    ++cells;
    verdicts.add(marked_word(record));
    if (record.status != Status::ok) guards.add(record.reason);
    if (record.status == Status::skipped || record.status == Status::not_run) return;
    samples += record.samples;
    nonfinite += record.nonfinite;
    if (record.largest_sample) raise(largest, *record.largest_sample);
    if (record.majorant_violations > 0) guards.add("with violations of the bound counted");
    if (record.verdict && record.verdict->out_of_range > 0) guards.add("with samples out of the declared range counted");
    for (const ChannelRecord& channel : record.channel) add_error(record, channel);
    if (record.lookups_per_sample) {
      raise(most_lookups, *record.lookups_per_sample);
      fewest_lookups = std::min(fewest_lookups.value_or(kInfinity), *record.lookups_per_sample);
    }
  }

  Line line() const {
    return {experiment,
            tracker,
            fmt::to_string(cells),
            fmt::to_string(nonfinite),
            verdicts.text(),
            short_number(largest),
            short_number(relative_error),
            short_number(standard_errors),
            fewest_lookups == most_lookups ? short_number(most_lookups)
                                           : fmt::format("{} to {}", short_number(fewest_lookups), short_number(most_lookups)),
            guards.text()};
  }

 private:
  /// A mean that has underflowed is compared as it stands.
  void add_error(const CellRecord& record, const ChannelRecord& channel) {
    if (!channel.bias || !channel.reference) return;
    const std::optional<Real>& variance = best_variance(channel);
    const Real scale = std::max(std::abs(*channel.reference), std::numeric_limits<Real>::min());
    constexpr Real kRounding = 1e-26;
    if (!variance || *variance <= kRounding * scale * scale)
      raise(relative_error, std::abs(*channel.bias) / scale);
    else
      raise(standard_errors, std::abs(*channel.bias) / std::sqrt(*variance / static_cast<Real>(record.samples)));
  }
};

std::vector<Line> lines_of(const RunRecord& run) {
  std::vector<Case> cases;
  std::map<std::pair<std::string, std::string>, std::size_t> index;
  for (const CellRecord& record : run.cells) {
    const std::string tracker = tracker_label(record.cell);
    const auto [at, added] = index.emplace(std::pair(record.cell.experiment, tracker), cases.size());
    if (added) cases.push_back({record.cell.experiment, tracker});
    cases[at->second].add(record);
  }
  std::vector<Line> lines = {{"case", "tracker", "cells", "not finite", "verdicts", "largest sample", "relative error",
                              "standard errors", "lookups a sample", "guards"}};
  for (const Case& one : cases) lines.push_back(one.line());
  return lines;
}

}  // namespace

std::string stability_text(const RunRecord& run) { return aligned(lines_of(run), 2); }

std::string stability_markdown(const RunRecord& run) { return markdown_table(lines_of(run)); }

}  // namespace nullmark
