#include "harness/report/data.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "harness/analysis/check.h"
#include "harness/analysis/comparison.h"
#include "harness/analysis/history.h"
#include "harness/analysis/scaling.h"
#include "harness/analysis/table_values.h"
#include "harness/config/cell_names.h"
#include "harness/io/results_json.h"
#include "harness/io/spec_json.h"
#include "harness/io/transport_json.h"
#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/report/cell_data.h"
#include "harness/report/claims_text.h"
#include "harness/report/history_text.h"
#include "harness/report/images.h"
#include "harness/report/warnings.h"
#include "harness/run/provenance.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

using Places = std::map<const CellRecord*, std::size_t>;

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
                       {"split", ranked.split},
                       {"relative", interval(ranked.relative)}});
    if (!ranked.break_even) continue;
    const bool at = ranked.break_even->kind == BreakEven::Kind::at;
    break_even.push_back({{"cell", cell(i)},
                          {"against", cell(*comparison.best_unbiased)},
                          {"kind", to_string(ranked.break_even->kind)},
                          {"seconds", at ? interval(ranked.break_even->seconds) : Json(nullptr)},
                          {"error", at ? interval(ranked.break_even->error) : Json(nullptr)},
                          {"proven", !break_even_is_unproven(comparison, ranked)}});
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
          {"unproven", unproven_note(comparison)},
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
  return {
      {"title", table.title}, {"metric", table.metric}, {"columns", columns}, {"given", given.size()}, {"rows", std::move(rows)}};
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
  return {{"id", finding.claim->id},     {"source", finding.claim->source},     {"claim", finding.claim->claim},
          {"note", finding.claim->note}, {"required", finding.claim->required}, {"finding", to_string(finding.outcome)},
          {"parts", std::move(parts)}};
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
                          {"lookups", number_or_null(record.lookups_per_sample)},
                          {"relative_variance", number_or_null(scaled_variance(record))}});
      }
      list.push_back({{"axis", series.axis},
                      {"estimator", series.tracker},
                      {"rest", series.rest},
                      {"points", std::move(points)},
                      {"exponent", interval(series.time)},
                      {"exponent_upper", interval(series.time_upper)},
                      {"exponent_lookups", interval(series.lookups)},
                      {"exponent_variance", interval(series.variance)}});
    }
  return list;
}

std::string base_name(const CellRecord& record) {
  const auto file = record.medium->field.values.find("file");
  if (file == record.medium->field.values.end()) return "";
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

/// The name of the program that made the results: that of a plug-in knows its trackers.
std::string program_of(const Json& provenance) {
  const Json words = provenance.value("command_line", Json::array());
  const bool told = !words.empty() && words[0].is_string();
  const std::string name = told ? std::filesystem::path(words[0].get<std::string>()).filename().string() : "";
  return name.empty() ? "nullmark" : name;
}

/// The command that made the results, as a shell takes it, but for the folder of the program.
std::string command_line(const Json& provenance) {
  std::string line = program_of(provenance);
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

/// How to get results again.  Of merged ones: the commands of their parts, and the merge.
Json commands_of(const Json& provenance, const std::string& name) {
  const std::string program = program_of(provenance);
  Json commands = Json::array();
  const Json parts = provenance.value("parts", Json::array());
  for (const Json& part : parts)
    if (const std::string line = command_line(part); std::find(commands.begin(), commands.end(), line) == commands.end())
      commands.push_back(line);
  if (parts.empty())
    commands.push_back(command_line(provenance));
  else
    commands.push_back(fmt::format("{} merge PART... -o {}  # the results of the commands above", program, name));
  commands.push_back(program + " check " + name);
  commands.push_back(program + " compare " + name);
  return commands;
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
          {"commands", commands_of(provenance, name)},
          {"provenance", std::move(provenance)},
          {"verdicts",
           {{"pass", summary.pass},
            {"fail", summary.fail},
            {"expected_open", summary.expected_open},
            {"unexpected_open", summary.unexpected_open},
            {"violated", summary.violated},
            {"errors", summary.errors},
            {"not_run", summary.not_run},
            {"untested", summary.untested}}}};
}

/// Scenes, what their cells cost, and the pairs of cells on the same random streams.
void add_comparisons(const std::vector<Comparison>& all, const Places& places, Json& json) {
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
}

/// Null where the results are no series of one configuration.
Json history_or_null(const std::vector<RunRecord>& runs, const std::vector<std::string>& files) {
  if (runs.size() < 2) return nullptr;
  try {
    const History history = history_of(runs, files);
    return history.steps.empty() ? Json(nullptr) : history_json(history);
  } catch (const InputError&) {
    return nullptr;
  }
}

}  // namespace

ReportData report_data(std::vector<RunRecord> runs, const std::vector<std::string>& files, const std::string& baseline,
                       const std::string& command) {
  ReportData data;
  Json& json = data.json;
  ReportImages images;
  Places places;
  std::vector<std::string> names;
  std::set<std::string> shown;
  json["runs"] = Json::array();
  json["cells"] = Json::array();
  json["tables"] = Json::array();
  json["claims"] = Json::array();
  for (std::size_t run = 0; run < runs.size(); ++run) {
    if (std::find(names.begin(), names.end(), runs[run].name) == names.end()) names.push_back(runs[run].name);
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
  add_comparisons(all, places, json);
  json["title"] = fmt::format("{}", fmt::join(names, " + "));
  json["version"] = this_version();
  json["command"] = command;
  json["credits"] = shown;
  json["matrix"] = matrix_json(all, places);
  json["scaling"] = scaling_json(runs, places);
  json["images"] = images.json();
  json["history"] = history_or_null(runs, files);
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
