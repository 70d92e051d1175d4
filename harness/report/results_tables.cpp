#include "harness/report/results_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "harness/analysis/table_values.h"
#include "harness/config/cell_names.h"
#include "harness/io/results_json.h"
#include "harness/io/text.h"
#include "harness/io/transport_json.h"
#include "harness/model/cost.h"
#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/report/history_text.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

using Line = std::vector<std::string>;

/// What the cells of one table share.
std::string heading(const CellRecord& record) {
  const Cell& cell = record.cell;
  std::string text = fmt::format("{}: {}, {}, {}, {}", cell.experiment, record.medium->label, record.majorant->label,
                                 to_string(cell.quantity), record.ray_set->label);
  if (cell.equal_lookups)
    text += fmt::format(", {} lookups per ray", *cell.equal_lookups);
  else
    text += fmt::format(", {} samples per ray", cell.samples_per_ray);
  text += fmt::format(", seed {}", cell.seed);
  if (cell.own_streams) text += ", own streams";
  if (const std::string light = transport_label(cell.transport); !light.empty()) text += ", " + light;
  if (cell.measurement.clamp) text += ", clamped";
  if (cell.measurement.quantise_bits > 0) text += fmt::format(", {} bits", cell.measurement.quantise_bits);
  return text;
}

bool heavy_tailed(const ChannelRecord& channel) { return channel.relative_variance && *channel.relative_variance > kHeavyTail; }

/// A variance, 0 where it is no more than rounding leaves.
std::optional<Real> unless_rounding(const ChannelRecord& channel, const std::optional<Real>& variance) {
  const Real rounding = kRounding * channel.reference_rms.value_or(0);
  return variance && *variance <= rounding * rounding ? std::optional<Real>(0) : variance;
}

/// The sample value, or the theory, marked, where the sample value tells little.
std::string shown(const ChannelRecord& channel, const std::optional<Real>& value, const std::optional<Real>& theory) {
  return heavy_tailed(channel) && theory ? short_number(theory) + "*" : short_number(value);
}

/// What stands beside the verdict's word: what a PASS proves, or the reason of any other word.  The status where there is none.
std::string status_of(const CellRecord& record) {
  const std::string status = to_string(record.status), finding = finding_of(record);
  if (finding.empty()) return status;
  return record.status == Status::ok || finding == status ? finding : status + ": " + finding;
}

std::string output_name(const CellRecord& record, std::size_t c) {
  return c < record.outputs.size() ? record.outputs[c] : fmt::format("channel {}", c);
}

Line channel_line(const CellRecord& record, std::size_t c) {
  const ChannelRecord& channel = record.channel[c];
  const bool first = c == 0;
  const auto once = [&](const std::optional<Real>& number) { return first ? short_number(number) : std::string(); };
  return {first ? tracker_label(record.cell) + (record.outputs.empty() ? "" : ", " + record.outputs[0])
                : "  " + output_name(record, c),
          first ? marked_word(record) : "",
          shown(channel, channel.rmse, channel.rmse_theory),
          short_number(channel.bias),
          shown(channel, unless_rounding(channel, channel.variance), unless_rounding(channel, channel.variance_theory)) +
              (variance_is_uncertain(record, channel) ? "?" : ""),
          short_number(unless_rounding(channel, channel.variance_theory)),
          once(record.lookups_per_sample),
          once(record.lookups_theory),
          once(metric(record, "ns_per_sample_alone")),
          once(metric(record, "ns_per_sample")),
          once(record.time ? std::optional(record.time->floor_ratio) : std::nullopt),
          short_number(variance_x_ns(record, c)),
          (first ? status_of(record) : std::string()) +
              (channel.reference || !channel.mean ? "" : fmt::format("{}mean {:.6g}", first ? ", " : "", *channel.mean))};
}

void append_lines(const CellRecord& record, std::vector<Line>& lines) {
  for (std::size_t c = 0; c < record.channel.size(); ++c) lines.push_back(channel_line(record, c));
  if (!record.channel.empty()) return;
  Line line(lines[0].size(), "-");
  line.front() = tracker_label(record.cell);
  line.back() = status_of(record);
  lines.push_back(line);
}

/// In order of first appearance.
template <class Item, class Key>
std::vector<std::pair<std::string, std::vector<const Item*>>> grouped(const std::vector<Item>& items, const Key& key) {
  std::vector<std::pair<std::string, std::vector<const Item*>>> groups;
  std::map<std::string, std::size_t> index;
  for (const Item& item : items) {
    const auto [at, added] = index.emplace(key(item), groups.size());
    if (added) groups.push_back({at->first, {}});
    groups[at->second].second.push_back(&item);
  }
  return groups;
}

template <class Value>
void add_headings(const std::vector<std::pair<std::string, Value>>& words, std::vector<std::string>& headings) {
  for (const auto& [word, value] : words)
    if (std::find(headings.begin(), headings.end(), word) == headings.end()) headings.push_back(word);
}

template <class Value>
const Value* value_under(const std::vector<std::pair<std::string, Value>>& row, const std::string& heading) {
  for (const auto& [word, value] : row)
    if (word == heading) return &value;
  return nullptr;
}

std::vector<Line> side_by_side(const Table& table, const CellsByName& cells) {
  std::vector<std::string> given, answered;
  bool theory = false, note = false;
  for (const TableRow& row : table.rows) {
    add_headings(row.given, given);
    add_headings(row.cells, answered);
    theory |= row.theory_of.has_value();
    note |= !row.note.empty();
  }
  Line head = {""};
  head.insert(head.end(), given.begin(), given.end());
  head.insert(head.end(), answered.begin(), answered.end());
  if (theory) head.emplace_back("theory");
  head.emplace_back(note ? "note" : "");

  std::vector<Line> lines = {head};
  for (const TableRow& row : table.rows) {
    Line line = {row.label};
    const auto cell_value = [&](const std::string& name, auto value) { return row_value(cells, table, row, name, value); };
    for (const std::string& word : given) {
      const Real* number = value_under(row.given, word);
      line.push_back(number ? fmt::format("{}", *number) : "-");
    }
    for (const std::string& word : answered) {
      const std::string* name = value_under(row.cells, word);
      line.push_back(name ? short_number(cell_value(*name, metric)) : "-");
    }
    if (theory) line.push_back(row.theory_of ? short_number(cell_value(*row.theory_of, metric_theory)) : "-");
    line.push_back(row.note);
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace

const std::vector<std::string>& results_columns() {
  static const std::vector<std::string> kColumns = {"verdict",         "rmse",        "bias",           "variance",
                                                    "variance theory", "lookups",     "lookups theory", "ns/sample alone",
                                                    "ns/sample",       "floor ratio", "variance x ns",  "status"};
  return kColumns;
}

std::string results_tables(const RunRecord& run, const TableShape& shape) {
  std::string text = fmt::format("{} cell{}: {}\n\n", run.cells.size(), run.cells.size() == 1 ? "" : "s", verdicts_counted(run));
  std::vector<std::string> left_out;
  bool marked = false, uncertain = false, measured = false;
  for (const auto& [title, records] : grouped(run.cells, heading)) {
    std::vector<Line> lines = {{"estimator"}};
    lines[0].insert(lines[0].end(), results_columns().begin(), results_columns().end());
    for (const CellRecord* record : records) {
      append_lines(*record, lines);
      measured |= record->status == Status::ok && record->cell.measurement != Measurement{};
      for (const ChannelRecord& channel : record->channel) {
        marked |= heavy_tailed(channel) && channel.variance_theory;
        uncertain |= variance_is_uncertain(*record, channel);
      }
    }
    text += title + "\n" + shaped(lines, 2, 1, shape, left_out) + "\n";
  }
  if (marked)
    text += fmt::format("* theory: the relative variance is above {}, too heavy a tail for the sample's own\n\n", kHeavyTail);
  if (uncertain) text += "? too few samples to know this variance: rare samples decide it\n\n";
  if (measured) text += "- theory: none is known of clamped or quantised samples\n\n";
  for (const auto& [title, lines] : configured_tables(run))
    text += fmt::format("{}\n{}\n", title, fitted(lines, 1, shape.width, left_out));
  return text + left_out_line(left_out);
}

std::vector<std::pair<std::string, std::vector<Line>>> configured_tables(const RunRecord& run) {
  std::vector<std::pair<std::string, std::vector<Line>>> tables;
  const CellsByName cells = cells_by_name(run);
  for (const Table& table : run.tables)
    tables.emplace_back(fmt::format("{} ({})", table.title, table.metric), side_by_side(table, cells));
  return tables;
}

}  // namespace nullmark
