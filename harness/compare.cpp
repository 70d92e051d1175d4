#include "harness/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "harness/cell_names.h"
#include "harness/json_input.h"
#include "harness/names.h"
#include "harness/transport_json.h"

namespace nullmark {
namespace {

struct Row {
  const CellRecord* record;
  Efficiency efficiency;
};

/// Unknown and unreachable times sort last, exact estimators (no variance) first.
Real sort_key(const Row& row) { return row.efficiency.seconds_to_1pct.value_or(kInfinity); }

std::string number(const std::optional<Real>& value) { return value ? fmt::format("{:.3g}", *value) : "-"; }

std::string ratio(const std::optional<Real>& value, const std::optional<Real>& base) {
  return value && base && *base > 0 ? fmt::format("{:.2f}x", *value / *base) : "-";
}

std::string group_of(const CellRecord& record) {
  const std::string light = transport_label(record.cell.transport);
  return fmt::format("{} | {} | {} | {}{}", to_string(record.cell.quantity), record.medium.label, record.majorant.label,
                     record.ray_set.label, light.empty() ? "" : " | " + light);
}

}  // namespace

Efficiency efficiency(const CellRecord& record) {
  Efficiency out;
  if (record.status != Status::ok || record.channel.empty()) return out;
  Real variance = 0, bias = 0, reference = 0;
  for (const ChannelRecord& channel : record.channel) {
    const auto best = channel.variance_theory ? channel.variance_theory : channel.variance;
    if (!best || !channel.reference) return out;
    variance += *best;
    reference += *channel.reference * *channel.reference;
    // Only estimators that do not claim to be unbiased have a floor; the others' measured bias is noise.
    if ((record.claims == "consistent" || record.claims == "biased") && channel.rmse)
      bias += std::max<Real>(0, *channel.rmse * *channel.rmse - *best / static_cast<Real>(record.cell.samples_per_ray));
    if (!channel.variance_theory && channel.kurtosis)
      out.relative_error = std::max(out.relative_error, std::sqrt(std::max<Real>(0, *channel.kurtosis - 1) /
                                                                  static_cast<Real>(std::max<std::uint64_t>(1, record.samples))));
  }
  const auto channels = static_cast<Real>(record.channel.size());
  variance /= channels;
  out.variance = variance;
  if (reference > 0) out.floor = std::sqrt(bias / reference);
  if (record.lookups_per_sample) out.variance_x_lookups = variance * *record.lookups_per_sample;
  if (record.time) {
    out.variance_x_ns = variance * record.time->ns_per_sample;
    constexpr Real kTarget = 0.01;
    const Real room = kTarget * kTarget * reference / channels - bias / channels;
    if (room > 0) out.seconds_to_1pct = std::max<Real>(1, variance / room) * record.time->ns_per_sample * 1e-9;
  }
  return out;
}

std::string compare_results(const std::vector<RunRecord>& runs, const std::string& baseline) {
  std::map<std::string, std::vector<Row>> groups;
  std::vector<std::string> order;
  std::vector<std::string> known;
  for (const RunRecord& run : runs)
    for (const CellRecord& record : run.cells) {
      if (record.status != Status::ok || !record.outputs.empty()) continue;
      std::vector<Row>& rows = groups[group_of(record)];
      if (rows.empty()) order.push_back(group_of(record));
      rows.push_back({&record, efficiency(record)});
      known.insert(known.end(), {tracker_label(record.cell), record.cell.estimator.type});
    }
  if (!baseline.empty() && std::find(known.begin(), known.end(), baseline) == known.end()) {
    const std::string near = nearest(baseline, known);
    throw InputError(fmt::format("--baseline: no cell of the results has the estimator \"{}\"{}", baseline,
                                 near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
  }

  std::string out;
  for (const std::string& name : order) {
    std::vector<Row>& rows = groups[name];
    std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return sort_key(a) < sort_key(b); });
    const auto is_base = [&](const Row& row) {
      return baseline.empty() ? row.record->claims == "unbiased"
                              : tracker_label(row.record->cell) == baseline || row.record->cell.estimator.type == baseline;
    };
    const auto base = std::find_if(rows.begin(), rows.end(), is_base);
    const Efficiency none, &reference = base == rows.end() ? none : base->efficiency;
    std::size_t width = 9;
    for (const Row& row : rows) width = std::max(width, tracker_label(row.record->cell).size());
    out += fmt::format("{}\n  {:<{}} {:>10} {:>10} {:>8} {:>10} {:>8} {:>10} {:>8} {:>9}\n", name, "estimator", width, "variance",
                       "var x look", "", "var x ns", "", "s to 1 %", "", "floor");
    for (const Row& row : rows) {
      const Efficiency& e = row.efficiency;
      const std::string error = e.relative_error > 0 ? fmt::format(" +-{:.1f}%", 196 * e.relative_error) : "";
      const bool floored = e.floor && *e.floor > 0 && row.record->claims != "unbiased" && row.record->claims != "exact";
      out += fmt::format(
          "  {:<{}} {:>10} {:>10} {:>8} {:>10} {:>8} {:>10} {:>8} {:>9}{}\n", tracker_label(row.record->cell), width,
          number(e.variance), number(e.variance_x_lookups), ratio(e.variance_x_lookups, reference.variance_x_lookups),
          number(e.variance_x_ns), ratio(e.variance_x_ns, reference.variance_x_ns),
          e.seconds_to_1pct  ? fmt::format("{:.3g}", *e.seconds_to_1pct)
          : row.record->time ? "never"
                             : "-",
          ratio(e.seconds_to_1pct, reference.seconds_to_1pct), floored ? fmt::format("{:.2g} %", 100 * *e.floor) : "", error);
    }
    out += "\n";
  }
  return out;
}

}  // namespace nullmark
