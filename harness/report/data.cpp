#include "harness/report/data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "harness/analysis/check.h"
#include "harness/analysis/comparison.h"
#include "harness/analysis/expectation.h"
#include "harness/analysis/scaling.h"
#include "harness/config/cell_names.h"
#include "harness/io/results_json.h"
#include "harness/io/spec_json.h"
#include "harness/io/transport_json.h"
#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/report/claims_text.h"
#include "harness/report/images.h"
#include "harness/report/warnings.h"
#include "harness/run/provenance.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

using Places = std::map<const CellRecord*, std::size_t>;

Json interval(const Interval& x) {
  return {{"value", number_or_null(x.value)}, {"low", number_or_null(x.low)}, {"high", number_or_null(x.high)}};
}
Json interval(const std::optional<Interval>& x) { return x ? interval(*x) : Json(nullptr); }

Json place(const std::optional<std::size_t>& at) { return at ? Json(*at) : Json(nullptr); }

Json per_output(const CellRecord& record, std::optional<Real> ChannelRecord::*member) {
  Json list = Json::array();
  for (const ChannelRecord& channel : record.channel) list.push_back(number_or_null(channel.*member));
  return list;
}

Json time_row(const CellRecord& record) {
  if (!record.time) return nullptr;
  return {{"ns_per_sample", interval(median_interval(record.time->repetition_ns))},
          {"ns_per_lookup", number_or_null(record.time->ns_per_lookup)},
          {"floor_ratio", number_or_null(record.time->floor_ratio)},
          {"loop_ratio", number_or_null(record.time->loop_ratio)}};
}

Json verdict_json_of(const CellRecord& record) {
  if (!record.verdict) return nullptr;
  const VerdictRecord& verdict = *record.verdict;
  Real evidence = 0, epsilon = 0;
  for (const TestRecord& test : verdict.tests) {
    if (test.channel < 0) continue;
    evidence = std::max(evidence, test.log_e_fail);
    if (test.group < 0) epsilon = std::max(epsilon, test.epsilon);
  }
  return {{"epsilon", number_or_null(epsilon)},
          {"log_e_fail", number_or_null(evidence)},
          {"samples_per_ray", verdict.samples_per_ray}};
}

Json cost_json(const RankedCell& ranked) {
  if (!ranked.cost) return nullptr;
  const Cost& cost = *ranked.cost;
  Json seconds = Json::array();
  for (std::size_t i = 0; i < std::size(kTargets); ++i) {
    Json entry = ranked.seconds[i] ? interval(*ranked.seconds[i]) : Json{{"value", nullptr}, {"low", nullptr}, {"high", nullptr}};
    entry["error"] = kTargets[i];
    entry["amortised"] = ranked.amortised[i];
    entry["reached"] = ranked.seconds[i] && std::isfinite(ranked.seconds[i]->value);
    seconds.push_back(std::move(entry));
  }
  return {{"basis", cost.analytic ? "analytic" : "sample"},
          {"reference", number_or_null(cost.reference)},
          {"variance", interval(cost.variance)},
          {"variance_x_lookups", interval(cost.variance_x_lookups)},
          {"variance_x_ns", interval(cost.variance_x_ns)},
          {"floor", interval(cost.floor)},
          {"seconds", std::move(seconds)},
          {"pareto", ranked.pareto}};
}

/// Nanoseconds of one of `samples` samples that share a traversal; nothing where fewer were timed together than that, or others.
std::optional<Interval> sample_time(const Cost& cost, std::uint64_t samples) {
  for (const auto& [size, ns] : cost.ns_by_batch)
    if (size == samples) return ns;
  if (!cost.ns_by_batch.empty() && samples > cost.ns_by_batch.back().first) return cost.ns_by_batch.back().second;
  return std::nullopt;
}

/// Error and variance of means of 1, 2, 4, ... samples as measured, relative to the reference's root mean square; a mean square
/// over G groups has the relative error sqrt((kurtosis - 1) / G).
Json convergence_row(const CellRecord& record, const std::optional<Cost>& cost) {
  if (!cost || record.channel.empty()) return Json::array();
  Real excess = 0;
  for (const ChannelRecord& channel : record.channel) excess = std::max(excess, channel.kurtosis.value_or(3) - 3);
  Json list = Json::array();
  for (const ConvergenceRecord& step : record.convergence) {
    Real square = 0, variance = 0;
    bool known = step.rmse.size() == record.channel.size();
    for (std::size_t c = 0; known && c < step.rmse.size(); ++c) {
      known = step.rmse[c] && step.variance[c];
      if (!known) break;
      square += *step.rmse[c] * *step.rmse[c] / static_cast<Real>(step.rmse.size());
      variance += *step.variance[c] / static_cast<Real>(step.rmse.size());
    }
    if (!known) continue;
    const auto n = static_cast<Real>(step.samples);
    const Real groups = static_cast<Real>(record.rays) * std::floor(static_cast<Real>(record.cell.samples_per_ray) / n);
    const Real scatter = groups > 0 ? std::sqrt(std::max<Real>(0, 2 + excess / n) / groups) : kInfinity;
    const std::optional<Interval> ns = sample_time(*cost, step.samples);
    list.push_back(
        {{"samples", step.samples},
         {"lookups", number_or_null(record.lookups_per_sample ? std::optional(n * *record.lookups_per_sample) : std::nullopt)},
         {"seconds", ns ? interval(product(*ns, exactly(n * 1e-9))) : Json(nullptr)},
         {"rmse", interval(relative(std::sqrt(square) / cost->reference, scatter / 2))},
         {"variance", interval(relative(variance, scatter))}});
  }
  return list;
}

std::vector<std::string> output_names(const CellRecord& record) {
  if (!record.outputs.empty()) return record.outputs;
  if (record.channels == 1) return {""};
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(record.channels));
  for (int c = 0; c < record.channels; ++c) names.push_back(fmt::format("channel {}", c));
  return names;
}

std::vector<std::string> mark_names(const CellRecord& record) {
  std::vector<std::string> names;
  for (const Mark mark : marks_of(record)) names.emplace_back(mark_name(mark));
  return names;
}

Json cell_json_of(const CellRecord& record, std::size_t run, ReportImages& images, const std::string& file) {
  const Cell& cell = record.cell;
  Json parameters = Json::object();
  for (const auto& [name, value] : numeric_parameters(record)) parameters[name] = number_or_null(value);
  return {{"run", run},
          {"scene", nullptr},
          {"id", cell.id},
          {"name", cell.name},
          {"experiment", cell.experiment},
          {"estimator", tracker_label(cell)},
          {"type", cell.estimator.type},
          {"claims", record.claims},
          {"precision", to_string(cell.precision)},
          {"medium", record.medium.label},
          {"majorant", record.majorant.label},
          {"rays", record.ray_set.label},
          {"quantity", to_string(cell.quantity)},
          {"light", transport_label(cell.transport)},
          {"parameters", std::move(parameters)},
          {"outputs", output_names(record)},
          {"status", to_string(record.status)},
          {"reason", record.reason},
          {"word", verdict_word(kind_of(record))},
          {"marked_word", marked_word(record)},
          {"marks", mark_names(record)},
          {"finding", finding_of(record)},
          {"n_rays", record.rays},
          {"samples_per_ray", cell.samples_per_ray},
          {"seed", cell.seed},
          {"mean", per_output(record, &ChannelRecord::mean)},
          {"reference", per_output(record, &ChannelRecord::reference)},
          {"bias", per_output(record, &ChannelRecord::bias)},
          {"rmse", per_output(record, &ChannelRecord::rmse)},
          {"rmse_theory", per_output(record, &ChannelRecord::rmse_theory)},
          {"variance", per_output(record, &ChannelRecord::variance)},
          {"variance_theory", per_output(record, &ChannelRecord::variance_theory)},
          {"lookups", number_or_null(record.lookups_per_sample)},
          {"lookups_theory", number_or_null(record.lookups_theory)},
          {"null_collisions", number_or_null(record.null_collisions_per_sample)},
          {"violations", record.majorant_violations},
          {"largest_violation", number_or_null(record.largest_violation)},
          {"draws", number_or_null(record.draws_per_sample)},
          {"time", time_row(record)},
          {"verdict", verdict_json_of(record)},
          {"cost", nullptr},
          {"convergence", Json::array()},
          {"images", images.add(record, file)}};
}

const char* word(BreakEven::Kind kind) {
  switch (kind) {
    case BreakEven::Kind::first_sample:
      return "cheaper until its first sample";
    case BreakEven::Kind::never_cheaper:
      return "never cheaper";
    case BreakEven::Kind::no_floor_seen:
      return "no floor seen";
    case BreakEven::Kind::exact:
      return "exact but for rounding";
    case BreakEven::Kind::at:
      break;
  }
  return "at";
}

Json scene_json(const Comparison& comparison, const Places& places) {
  const auto cell = [&](std::size_t ranked) { return places.at(comparison.cells[ranked].record); };
  const auto cell_or_null = [&](const std::optional<std::size_t>& ranked) {
    return ranked ? Json(cell(*ranked)) : Json(nullptr);
  };
  Json ranking = Json::array(), break_even = Json::array();
  for (std::size_t i = 0; i < comparison.cells.size(); ++i) {
    const RankedCell& ranked = comparison.cells[i];
    ranking.push_back({{"cell", cell(i)},
                       {"label", ranked.label},
                       {"rank", place(ranked.rank)},
                       {"tied", ranked.tied},
                       {"relative", interval(ranked.relative)}});
    if (!ranked.break_even) continue;
    const bool at = ranked.break_even->kind == BreakEven::Kind::at;
    break_even.push_back({{"cell", cell(i)},
                          {"against", cell(*comparison.best_unbiased)},
                          {"kind", word(ranked.break_even->kind)},
                          {"seconds", at ? interval(ranked.break_even->seconds) : Json(nullptr)},
                          {"error", at ? interval(ranked.break_even->error) : Json(nullptr)}});
  }
  return {{"name", comparison.name},
          {"quantity", comparison.quantity},
          {"medium", comparison.medium},
          {"majorant", comparison.majorant},
          {"rays", comparison.rays},
          {"light", comparison.light},
          {"measurement", comparison.measurement},
          {"baseline", cell_or_null(comparison.baseline)},
          {"best_unbiased", cell_or_null(comparison.best_unbiased)},
          {"ranking", std::move(ranking)},
          {"break_even", std::move(break_even)}};
}

template <class T>
const T* under(const std::vector<std::pair<std::string, T>>& entries, const std::string& heading) {
  const auto at = std::find_if(entries.begin(), entries.end(), [&](const auto& entry) { return entry.first == heading; });
  return at == entries.end() ? nullptr : &at->second;
}

Json table_json(const Table& table, const CellsByName& cells, const Places& places) {
  std::vector<std::string> given, answered;
  bool theory = false;
  const auto note_headings = [](const auto& entries, std::vector<std::string>& headings) {
    for (const auto& [heading, entry] : entries)
      if (std::find(headings.begin(), headings.end(), heading) == headings.end()) headings.push_back(heading);
  };
  for (const TableRow& row : table.rows) {
    note_headings(row.given, given);
    note_headings(row.cells, answered);
    theory = theory || row.theory_of;
  }
  std::vector<std::string> columns = given;
  columns.insert(columns.end(), answered.begin(), answered.end());
  if (theory) columns.emplace_back("theory");

  Json rows = Json::array();
  for (const TableRow& row : table.rows) {
    Json values = Json::array(), of_cells = Json::array();
    const auto add = [&](const std::optional<Real>& value, const std::string* cell) {
      values.push_back(number_or_null(value));
      const auto at = cell ? cells.find(*cell) : cells.end();
      of_cells.push_back(at == cells.end() ? Json(nullptr) : Json(places.at(at->second)));
    };
    for (const std::string& heading : given) {
      const Real* value = under(row.given, heading);
      add(value ? std::optional(*value) : std::nullopt, nullptr);
    }
    for (const std::string& heading : answered) {
      const std::string* cell = under(row.cells, heading);
      add(cell ? row_value(cells, table, row, *cell, metric) : std::nullopt, cell);
    }
    if (theory) add(row.theory_of ? row_value(cells, table, row, *row.theory_of, metric_theory) : std::nullopt, nullptr);
    rows.push_back({{"label", row.label}, {"values", std::move(values)}, {"cells", std::move(of_cells)}, {"note", row.note}});
  }
  return {{"title", table.title}, {"metric", table.metric}, {"columns", columns}, {"rows", std::move(rows)}};
}

Json claim_json(const ClaimFinding& finding, const CellsByName& cells, const Places& places) {
  Json parts = Json::array();
  for (const PartFinding& part : finding.parts) {
    Json of_cells = Json::array();
    for (const std::string& name : part.part->cells)
      if (const auto at = cells.find(name); at != cells.end()) of_cells.push_back(places.at(at->second));
    parts.push_back({{"says", part.part->says},
                     {"finding", to_string(part.outcome)},
                     {"figures", figures_of(part)},
                     {"cells", std::move(of_cells)}});
  }
  return {{"id", finding.claim->id},     {"source", finding.claim->source},       {"claim", finding.claim->claim},
          {"note", finding.claim->note}, {"finding", to_string(finding.outcome)}, {"parts", std::move(parts)}};
}

Json matrix_json(const std::vector<Comparison>& all, const Places& places) {
  std::vector<std::string> rows;
  for (const Comparison& comparison : all)
    for (const RankedCell& ranked : comparison.cells)
      if (std::find(rows.begin(), rows.end(), ranked.label) == rows.end()) rows.push_back(ranked.label);
  std::sort(rows.begin(), rows.end());
  Json cells = Json::array(), columns = Json::array();
  for (std::size_t scene = 0; scene < all.size(); ++scene) columns.push_back({{"scene", scene}, {"label", all[scene].name}});
  for (const std::string& row : rows) {
    Json line = Json::array();
    for (const Comparison& comparison : all) {
      const auto at = std::find_if(comparison.cells.begin(), comparison.cells.end(),
                                   [&](const RankedCell& ranked) { return ranked.label == row; });
      line.push_back(at == comparison.cells.end() ? Json(nullptr) : Json(places.at(at->record)));
    }
    cells.push_back(std::move(line));
  }
  return {{"rows", rows}, {"columns", std::move(columns)}, {"cells", std::move(cells)}};
}

Json scaling_json(const std::vector<RunRecord>& runs, const Places& places) {
  Json list = Json::array();
  for (const RunRecord& run : runs)
    for (const ScalingSeries& series : scaling_series(run)) {
      Json points = Json::array();
      for (std::size_t i = 0; i < series.cells.size(); ++i) {
        const CellRecord& record = *series.cells[i];
        points.push_back({{"x", series.x[i]},
                          {"cell", places.at(&record)},
                          {"ns_per_sample", record.time ? interval(median_interval(record.time->repetition_ns)) : Json(nullptr)},
                          {"lookups", number_or_null(record.lookups_per_sample)}});
      }
      list.push_back({{"axis", series.axis},
                      {"estimator", series.tracker},
                      {"rest", series.rest},
                      {"points", std::move(points)},
                      {"exponent", interval(series.time)},
                      {"exponent_upper", interval(series.time_upper)},
                      {"exponent_lookups", interval(series.lookups)}});
    }
  return list;
}

std::string base_name(const CellRecord& record) {
  const auto file = record.medium.field.values.find("file");
  if (file == record.medium.field.values.end()) return "";
  const std::string* path = std::get_if<std::string>(&file->second);
  return path ? std::filesystem::path(*path).filename().string() : "";
}

/// Who made the volumes that the run shows.
std::set<std::string> credits(const RunRecord& run) {
  const Json config = run.config_text.empty() ? Json::object() : known_json(run.config_text);
  std::set<std::string> lines;
  for (const CellRecord& record : run.cells) {
    const std::string file = base_name(record);
    if (file.empty()) continue;
    const Json given = config.value("credits", Json::object());
    lines.insert(
        fmt::format("{}: {}", file, given.contains(file) ? given[file].get<std::string>() : "author and licence not given"));
  }
  return lines;
}

/// The command that made the results, as a shell takes it, but for the folder of the program.
std::string command_line(const Json& provenance) {
  std::string line = "nullmark";
  const Json words = provenance.value("command_line", Json::array());
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::string word = words[i].is_string() ? words[i].get<std::string>() : words[i].dump();
    const bool plain = !word.empty() && word.find_first_of(" '\"$`\\&|;<>()*?[]{}#~!\n") == std::string::npos;
    std::string quoted;
    for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
    line += plain ? fmt::format(" {}", word) : fmt::format(" '{}'", quoted);
  }
  return line;
}

Json run_json(const RunRecord& run, const Summary& summary, const std::string& file) {
  Json provenance = Json::object();
  for (const auto& [key, text] : run.provenance) provenance[key] = known_json(text);
  const std::string name = std::filesystem::path(file).filename().string();
  return {{"name", run.name},
          {"file", name},
          {"version", measured_by(run)},
          {"remarks", Json::array()},
          {"config_hash", config_hash(run.config_text)},
          {"commands", {command_line(provenance), "nullmark check " + name, "nullmark compare " + name}},
          {"provenance", std::move(provenance)},
          {"verdicts",
           {{"pass", summary.pass},
            {"fail", summary.fail},
            {"expected_open", summary.expected_open},
            {"unexpected_open", summary.unexpected_open},
            {"violated", summary.violated},
            {"errors", summary.errors},
            {"not_run", summary.not_run},
            {"unclaimed", summary.unclaimed}}}};
}

}  // namespace

ReportData report_data(std::vector<RunRecord> runs, const std::vector<std::string>& files, const std::string& baseline,
                       const std::string& command) {
  ReportData data;
  Json& json = data.json;
  ReportImages images;
  Places places;
  std::string title;
  std::set<std::string> shown;
  json["runs"] = Json::array();
  json["cells"] = Json::array();
  json["tables"] = Json::array();
  json["claims"] = Json::array();
  for (std::size_t run = 0; run < runs.size(); ++run) {
    title += (title.empty() ? "" : " + ") + runs[run].name;
    const Summary summary = summarise(runs[run]);
    json["runs"].push_back(run_json(runs[run], summary, files[run]));
    shown.merge(credits(runs[run]));
    for (const CellRecord& record : runs[run].cells) {
      places[&record] = json["cells"].size();
      json["cells"].push_back(cell_json_of(record, run, images, files[run]));
    }
    const CellsByName cells = cells_by_name(runs[run]);
    for (const Table& table : runs[run].tables) json["tables"].push_back(table_json(table, cells, places));
    for (const ClaimFinding& finding : summary.findings) json["claims"].push_back(claim_json(finding, cells, places));
  }
  const std::vector<Comparison> all = comparisons(runs, baseline);
  json["scenes"] = Json::array();
  json["paired"] = Json::array();
  json["unpaired"] = Json::array();
  for (std::size_t scene = 0; scene < all.size(); ++scene) {
    json["scenes"].push_back(scene_json(all[scene], places));
    for (const RankedCell& ranked : all[scene].cells) {
      Json& cell = json["cells"][places.at(ranked.record)];
      cell["scene"] = scene;
      cell["cost"] = cost_json(ranked);
      cell["convergence"] = convergence_row(*ranked.record, ranked.cost);
    }
    for (const Pairing& pairing : all[scene].pairings)
      json["paired"].push_back({{"scene", scene},
                                {"cell", places.at(all[scene].cells[pairing.ranked].record)},
                                {"against", places.at(all[scene].cells[pairing.against].record)},
                                {"ratio", interval(pairing.ratio)},
                                {"unpaired", interval(pairing.unpaired)},
                                {"samples", pairing.samples},
                                {"of_the_means", interval(pairing.of_the_means)}});
    for (const Unpaired& one : all[scene].unpaired)
      json["unpaired"].push_back(
          {{"scene", scene}, {"cell", places.at(all[scene].cells[one.ranked].record)}, {"reason", one.reason}});
  }
  json["title"] = title;
  json["version"] = this_version();
  json["command"] = command;
  json["credits"] = shown;
  json["matrix"] = matrix_json(all, places);
  json["scaling"] = scaling_json(runs, places);
  json["images"] = images.json();
  for (std::size_t run = 0; run < runs.size(); ++run) {
    if (const auto remark = version_remark(runs[run])) data.warnings.push_back(files[run] + ": " + *remark);
    const auto missing = images.missing().find(files[run]);
    if (missing == images.missing().end()) continue;
    const std::string remedy =
        fmt::format("keep {} beside {}, or make both again: {}", missing->second.folder,
                    json["runs"][run]["file"].get<std::string>(), json["runs"][run]["commands"][0].get<std::string>());
    json["runs"][run]["remarks"].push_back("its pictures are missing; " + remedy);
    data.warnings.push_back(fmt::format("{}: its pictures are left out: {}; {}", files[run], missing->second.reason, remedy));
  }
  return data;
}

}  // namespace nullmark
