#include "harness/io/results_json.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "harness/io/claims_json.h"
#include "harness/io/consistency.h"
#include "harness/io/spec_json.h"
#include "harness/io/tables_json.h"
#include "harness/io/text.h"
#include "harness/model/distinct.h"

namespace nullmark {
namespace {

/// What cells have in common, equal specifications once, with labels that can be printed.
template <class Spec>
class SharedSpecs {
 public:
  void share(Shared<Spec>& spec) {
    Shared<Spec>& one = list_[distinct_.place_in(list_, spec)];
    if (printable(one->label) != one->label) one.edit([](Spec& held) { held.label = printable(held.label); });
    spec = one;
  }

 private:
  Distinct distinct_;  ///< by labels as the file has them
  std::vector<Shared<Spec>> list_;
};

/// The JSON of a results file.  Throws InputError, with a remedy, where it is damaged.
Json results_json(const std::string& text, const std::string& file) {
  try {
    return parse_json(text, file);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}; copy the results again, or run their configuration again", error.what()));
  }
}

}  // namespace

void write_results(const RunRecord& run, const TextSink& to) {
  Json provenance = Json::object();
  for (const auto& [key, text] : run.provenance) provenance[key] = known_json(text);
  to(fmt::format("{{\n\"{}\": \"{}\",\n\"name\": {},\n\"config_hash\": \"{}\",\n\"config\": ", kVersionKey, RunRecord::kVersion,
                 Json(run.name).dump(), config_hash(run.config_text)));
  to(run.config_text.empty() ? "null" : run.config_text);
  to(fmt::format(",\n\"provenance\": {},\n\"cells\": [", provenance.dump()));
  // Written on one thread, ten thousand cells take longer than a hundredth of their sampling.
  constexpr std::size_t kTogether = 256;
  std::array<std::string, kTogether> texts;
  for (std::size_t first = 0; first < run.cells.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, run.cells.size() - first);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { texts[i] = cell_json(run.cells[first + i]).dump(); });
    for (std::size_t i = 0; i < count; ++i) to((first + i == 0 ? "\n" : ",\n") + texts[i]);
  }
  to(fmt::format("\n],\n\"tables\": {}", tables_json(run.tables).dump()));
  if (!run.claims.empty()) to(fmt::format(",\n\"claims\": {}", claims_json(run.claims).dump()));
  to("\n}\n");
}

void write_results(const RunRecord& run, const std::string& path) {
  write_atomically(path, [&](const TextSink& to) { write_results(run, to); });
}

std::string results_text(const RunRecord& run) {
  std::string text;
  write_results(run, [&](std::string_view part) { text += part; });
  return text;
}

std::string statistics_text(const RunRecord& run) {
  std::string text;
  for (const CellRecord& record : run.cells) {
    Json json = cell_json(record);
    json.erase("time");
    json.erase("instructions");
    json.erase("last_level_misses");
    json.erase("images");
    json.erase("build");
    text += json.dump() + "\n";
  }
  return text;
}

namespace {

/// ", such as FOLDER/a.json": the first of the folder's files that may be results.
std::string example_in(const std::string& folder) {
  std::error_code error;
  std::string first;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (const std::string path = entry.path().string(); path.ends_with(".json") || path.ends_with(".json.gz"))
      if (first.empty() || path < first) first = path;
  return first.empty() ? "" : ", such as " + first;
}

}  // namespace

RunRecord read_results_file(const std::string& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    throw InputError(fmt::format("{}: is a folder; expected a results file{}", file, example_in(file)));
  if (std::filesystem::status(file, error).type() == std::filesystem::file_type::not_found)
    throw InputError(fmt::format("{}: no such file; `nullmark run CONFIG -o {}` writes it", file, file));
  return read_results(read_file(file), file);
}

RunRecord read_results(const std::string& text, const std::string& file) {
  const auto no_results = [&] { return InputError(file + ": is not a results file of nullmark; `nullmark run` writes them"); };
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && text[first] != '{') throw no_results();
  const Json json = results_json(text, file);
  const JsonNode top(json, file);
  if (json.contains("experiments")) throw InputError(file + ": is a configuration; `nullmark run` it first");
  if (json.contains("nullmark_schema"))
    throw InputError(fmt::format("{}: are results of version 1; this program reads \"{}\": \"{}\": run their configuration again",
                                 file, kVersionKey, RunRecord::kVersion));
  if (!top.has(kVersionKey)) throw no_results();
  if (json[kVersionKey] != RunRecord::kVersion)
    top[kVersionKey].expected(fmt::format("\"{}\", the version this program reads", RunRecord::kVersion));
  RunRecord run;
  run.name = printable(top["name"].string());
  if (!top["config"].json().is_null()) run.config_text = top["config"].json().dump();
  top["provenance"].expect_object();
  for (const auto& [key, value] : top["provenance"].json().items()) run.provenance[key] = value.dump();
  if (top.has("config_hash") && !run.config_text.empty() && top["config_hash"].string() != config_hash(run.config_text))
    top["config_hash"].fail(
        "does not fit the configuration in the file; the file was changed, or is damaged: make the results again");
  if (const std::size_t cells = top["cells"].json().size(); cells > kMostCells)
    top["cells"].fail(fmt::format("found {} cells; expected at most {}", cells, kMostCells));
  std::set<std::string> seen;
  SharedSpecs<Component> trackers, majorants, ray_sets;
  SharedSpecs<MediumSpec> media;
  for (const JsonNode& cell : top["cells"].elements()) {
    run.cells.push_back(read_cell(cell));
    CellRecord& record = run.cells.back();
    expect_consistent(record, cell);
    for (std::string* name : {&record.cell.name, &record.cell.experiment}) *name = printable(*name);
    trackers.share(record.cell.estimator);
    media.share(record.medium);
    majorants.share(record.majorant);
    ray_sets.share(record.ray_set);
    record.reason = one_line(record.reason);
    if (!seen.insert(record.cell.name).second)
      cell.fail(fmt::format("found \"{}\" a second time; expected each cell once", record.cell.name));
  }
  if (top.has("tables")) run.tables = read_tables(top["tables"], CellReader());
  if (top.has("claims")) read_claims(top["claims"], CellReader(), run.claims);
  return run;
}

}  // namespace nullmark
