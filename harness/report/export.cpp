#include "harness/report/export.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <set>

#include "harness/io/results_json.h"
#include "harness/io/spec_json.h"
#include "harness/model/cost.h"
#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/report/junit.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

Json provenance_value(const RunRecord& run, const std::string& key) {
  const auto at = run.provenance.find(key);
  return at == run.provenance.end() ? Json(nullptr) : known_json(at->second);
}

/// Estimator first, so that one can be filtered against another.
std::string benchmark_name(const Cell& cell) {
  const std::string prefix = cell.experiment + "/";
  if (cell.name.rfind(prefix, 0) != 0) return cell.name;
  return fmt::format("{}/experiment:{}", cell.name.substr(prefix.size()), cell.experiment);
}

std::string google_benchmark(const RunRecord& run, const std::string& file) {
  const Json cpu = provenance_value(run, "cpu"), compiler = provenance_value(run, "compiler"),
             start = provenance_value(run, "start");
  const bool debug = compiler.is_object() && compiler.value("build_type", "") == "Debug";
  Json rows = Json::array();
  int family = 0;
  for (const CellRecord& record : run.cells) {
    if (!record.time) continue;
    const std::vector<Real>& repetitions = record.time->repetition_ns;
    const std::string name = benchmark_name(record.cell);
    for (std::size_t i = 0; i < repetitions.size(); ++i) {
      Json row = {{"name", name},
                  {"family_index", family},
                  {"per_family_instance_index", 0},
                  {"run_name", name},
                  {"run_type", "iteration"},
                  {"repetitions", repetitions.size()},
                  {"repetition_index", i},
                  {"threads", record.time->threads},
                  // A repetition's average is what was recorded.
                  {"iterations", 1},
                  {"real_time", repetitions[i]},
                  {"cpu_time", repetitions[i]},
                  {"time_unit", "ns"}};
      if (const auto lookups = record.lookups_per_sample) row["lookups"] = *lookups;
      if (const auto rmse = metric(record, "rmse")) row["rmse"] = *rmse;
      if (const auto variance = metric(record, "variance")) row["variance"] = *variance;
      row["label"] = record.cell.id;
      rows.push_back(std::move(row));
    }
    ++family;
  }
  const Json json = {{"context",
                      {{"date", start.is_string() ? start : Json("")},
                       {"host_name", ""},
                       {"executable", file},
                       {"num_cpus", cpu.is_object() ? cpu.value("cores", 1) : 1},
                       {"mhz_per_cpu", 0},
                       {"cpu_scaling_enabled", false},
                       {"caches", Json::array()},
                       {"load_avg", Json::array()},
                       {"library_build_type", debug ? "debug" : "release"},
                       {"json_schema_version", 1}}},
                     {"benchmarks", std::move(rows)}};
  return json.dump(2) + "\n";
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string csv_number(const std::optional<Real>& number) { return number ? fmt::format("{}", *number) : ""; }

/// Heading and content of a row, in order.
using Row = std::vector<std::pair<std::string, std::string>>;

/// Of the components of a cell, by `estimator.NAME`, `medium.NAME`, `majorant.NAME` and `rays.NAME`.
std::map<std::string, std::string> csv_parameters(const CellRecord& record) {
  std::map<std::string, std::string> parameters;
  for (const auto& [part, component] : {std::pair("estimator", &*record.cell.estimator),
                                        {"medium", &record.medium->field},
                                        {"majorant", &*record.majorant},
                                        {"rays", &*record.ray_set}}) {
    const Json json = parameters_json(component->values);
    for (const auto& [name, value] : json.items())
      parameters[fmt::format("{}.{}", part, name)] = value.is_string() ? value.get<std::string>() : value.dump();
  }
  return parameters;
}

Row csv_row(const CellRecord& record, std::size_t c) {
  const Cell& cell = record.cell;
  const ChannelRecord channel = c < record.channel.size() ? record.channel[c] : ChannelRecord{};
  const bool sampled = c < record.channel.size();
  const std::optional<Cost> cost = cost_of(record);
  const std::optional<Interval> seconds = cost ? seconds_to(*cost, 0.01) : std::nullopt;
  const auto end_of_seconds = [&](Real Interval::*end) { return seconds ? csv_number((*seconds).*end) : std::string(); };
  return {{"id", cell.id},
          {"name", cell.name},
          {"experiment", cell.experiment},
          {"estimator", cell.estimator->label},
          {"minus", cell.minus ? (*cell.minus)->label : ""},
          {"medium", record.medium->label},
          {"majorant", record.majorant->label},
          {"ray_set", record.ray_set->label},
          {"quantity", to_string(cell.quantity)},
          {"precision", to_string(cell.precision)},
          {"channel", fmt::to_string(c)},
          {"rays", fmt::to_string(record.rays)},
          {"samples_per_ray", fmt::to_string(cell.samples_per_ray)},
          {"seed", fmt::to_string(cell.seed)},
          {"status", to_string(record.status)},
          {"reason", record.reason},
          {"mean", csv_number(channel.mean)},
          {"reference", csv_number(channel.reference)},
          {"reference_error", csv_number(channel.reference_error)},
          {"bias", csv_number(channel.bias)},
          {"rmse", csv_number(channel.rmse)},
          {"rmse_theory", csv_number(channel.rmse_theory)},
          {"variance", csv_number(channel.variance)},
          {"variance_theory", csv_number(channel.variance_theory)},
          {"relative_variance", csv_number(channel.relative_variance)},
          {"kurtosis", csv_number(channel.kurtosis)},
          {"lookups_per_sample", csv_number(record.lookups_per_sample)},
          {"lookups_theory", csv_number(record.lookups_theory)},
          {"null_collisions_per_sample", csv_number(record.null_collisions_per_sample)},
          {"rng_draws_per_sample", csv_number(record.draws_per_sample)},
          {"majorant_violations", fmt::to_string(record.majorant_violations)},
          {"largest_sample", csv_number(record.largest_sample)},
          {"nonfinite", fmt::to_string(record.nonfinite)},
          {"ns_per_sample", csv_number(metric(record, "ns_per_sample"))},
          {"ns_per_sample_alone", csv_number(metric(record, "ns_per_sample_alone"))},
          {"ns_per_lookup", csv_number(metric(record, "ns_per_lookup"))},
          {"variance_x_lookups", csv_number(sampled ? variance_x_lookups(record, c) : std::nullopt)},
          {"variance_x_ns", csv_number(sampled ? variance_x_ns(record, c) : std::nullopt)},
          {"seconds_to_1_percent", end_of_seconds(&Interval::value)},
          {"seconds_to_1_percent_low", end_of_seconds(&Interval::low)},
          {"seconds_to_1_percent_high", end_of_seconds(&Interval::high)},
          {"claims", record.claims},
          {"verdict", verdict_word(kind_of(record))},
          {"marks", fmt::format("{}", fmt::join(mark_texts(record), ", "))},
          {"finding", finding_of(record)}};
}

std::string csv(const RunRecord& run) {
  std::string text;
  const auto add_line = [&](const Row& row, bool heading) {
    for (std::size_t i = 0; i < row.size(); ++i)
      text += fmt::format("{}{}", i > 0 ? "," : "", csv_field(heading ? row[i].first : row[i].second));
    text += "\r\n";
  };
  std::set<std::string> names;
  for (const CellRecord& record : run.cells)
    for (const auto& [name, value] : csv_parameters(record)) names.insert(name);
  const auto whole = [&](const CellRecord& record, std::size_t channel) {
    Row row = csv_row(record, channel);
    std::map<std::string, std::string> parameters = csv_parameters(record);
    // The verdict's words stay last.
    for (const std::string& name : names) row.emplace(row.end() - 3, name, parameters[name]);
    return row;
  };
  add_line(whole(CellRecord{}, 0), true);
  for (const CellRecord& record : run.cells)
    for (std::size_t c = 0; c < static_cast<std::size_t>(record.channels); ++c) add_line(whole(record, c), false);
  return text;
}

std::string jsonl(const RunRecord& run) {
  std::string text;
  for (const CellRecord& record : run.cells) {
    Json json = cell_json(record);
    json["word"] = verdict_word(kind_of(record));
    json["marks"] = mark_texts(record);
    json["finding"] = finding_of(record);
    text += json.dump() + "\n";
  }
  return text;
}

}  // namespace

const std::vector<std::string>& export_formats() {
  static const std::vector<std::string> kFormats = {"google-benchmark", "csv", "jsonl", "junit"};
  return kFormats;
}

std::string export_beginning(const std::string& format) {
  if (format == "google-benchmark") return "{\n  \"context\": {";
  if (format == "csv") return "id,name,experiment,";
  if (format == "jsonl") return "{\"id\":\"";
  return kJunitBeginning;
}

std::string export_results(const RunRecord& run, const std::string& format, const std::string& file) {
  if (format == "google-benchmark") return google_benchmark(run, file);
  if (format == "csv") return csv(run);
  if (format == "jsonl") return jsonl(run);
  return junit(run, file);
}

}  // namespace nullmark
