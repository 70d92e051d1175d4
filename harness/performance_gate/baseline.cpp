#include "harness/performance_gate/baseline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <set>

#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/results_json.h"
#include "harness/io/spec_json.h"
#include "harness/model/hash.h"

namespace nullmark {
namespace {

constexpr int kSchema = 1;
constexpr const char* kSchemaKey = "nullmark_baseline";

/// Of results' provenance, as scripts/count-instructions writes it, and of baselines.
constexpr const char* kStartUpKey = "start_up_instructions";

/// Refreshes that a history remembers.
constexpr std::size_t kHistory = 20;

/// "gcc 12.2.0" to "gcc 12"
std::string without_minor(const std::string& version) { return version.substr(0, version.find('.', version.find(' '))); }

std::string setting_of(const CellRecord& record) {
  const Json cell = cell_json(record);
  Json setting = Json::object();
  for (const char* key : {"estimator", "medium", "majorant", "ray_set", "quantity", "measurement", "transport"})
    setting[key] = cell[key];
  // What the structure came out as is a result.
  for (const char* key : {"cells", "nodes", "bytes"}) setting["majorant"].erase(key);
  return fmt::format("{:016x}", fnv1a(setting.dump()));
}

/// Null where the provenance does not say.
Json provenance_of(const RunRecord& run, const char* key) {
  const auto at = run.provenance.find(key);
  return at == run.provenance.end() ? Json() : known_json(at->second);
}

/// Hash of a configuration as a run writes it, cell by cell, without the cells' seeds: another seed has the same expectations.
std::string seedless_hash(const std::string& config_text) {
  Json config = known_json(config_text);
  if (!config.is_object() || !config.contains("experiments")) return config_hash(config_text);
  for (Json& experiment : config["experiments"])
    if (experiment.is_object() && experiment.contains("include"))
      for (Json& cell : experiment["include"])
        if (cell.is_object()) cell.erase("seed");
  return config_hash(config.dump());
}

BuildKey build_of(const RunRecord& run) {
  const auto json = [&](const char* key) { return provenance_of(run, key); };
  const auto text = [](const Json& object, const char* key) {
    return object.is_object() && object.contains(key) && object[key].is_string() ? object[key].get<std::string>() : std::string();
  };
  const Json compiler = json("compiler"), target = json("target"), libc = json("libc");
  BuildKey build;
  build.compiler = without_minor(text(compiler, "name"));
  build.flags = text(compiler, "flags");
  build.march = text(target, "march");
  build.simd = text(target, "simd");
  build.libc = libc.is_string() ? libc.get<std::string>() : "";
  if (build.march == "native") build.cpu = text(json("cpu"), "model");
  return build;
}

void refuse_repeated_names(const Counts& counts) {
  std::set<std::string> names;
  for (const CellCounts& cell : counts.cells)
    if (!names.insert(cell.name).second)
      throw InputError(fmt::format("{}: cell \"{}\" is there twice; expected every name once", counts.source, cell.name));
}

CellCounts read_cell_counts(const JsonNode& node) {
  CellCounts cell;
  const auto whole = [&](const char* key) { return node[key].unsigned_integer(0); };
  const auto real = [&](const char* key) { return node.has(key) ? std::optional(node[key].number()) : std::nullopt; };
  cell.name = node["name"].string();
  cell.id = node["id"].string();
  cell.setting = node["setting"].string();
  cell.samples = node["samples"].unsigned_integer(1);
  cell.lookups = whole("lookups");
  cell.draws = whole("draws");
  cell.null_collisions = whole("null_collisions");
  cell.majorant_violations = whole("majorant_violations");
  cell.lookups_variance = real("lookups_variance");
  cell.lookups_theory = real("lookups_theory");
  if (node.has("instructions")) cell.instructions = whole("instructions");
  if (node.has("last_level_misses")) cell.misses = whole("last_level_misses");
  if (node.has("instruction_history"))
    for (const JsonNode& change : node["instruction_history"].elements()) cell.instruction_history.push_back(change.number());
  return cell;
}

Counts read_baseline(const JsonNode& top) {
  if (top[kSchemaKey].unsigned_integer(0) != kSchema)
    top[kSchemaKey].expected(fmt::format("{}, the schema this program reads", kSchema));
  Counts counts;
  counts.source = top.file();
  counts.baseline = true;
  counts.name = top["name"].string();
  counts.config_hash = top["config_hash"].string();
  const JsonNode build = top["build"];
  for (const auto& [key, member] : {std::pair{"compiler", &BuildKey::compiler},
                                    {"flags", &BuildKey::flags},
                                    {"march", &BuildKey::march},
                                    {"simd", &BuildKey::simd},
                                    {"libc", &BuildKey::libc},
                                    {"cpu", &BuildKey::cpu}})
    counts.build.*member = build[key].string();
  if (top.has(kStartUpKey)) counts.start_up = top[kStartUpKey].unsigned_integer(0);
  for (const JsonNode& cell : top["cells"].elements()) counts.cells.push_back(read_cell_counts(cell));
  return counts;
}

Json cell_counts_json(const CellCounts& cell) {
  Json json = {{"name", cell.name},
               {"id", cell.id},
               {"setting", cell.setting},
               {"samples", cell.samples},
               {"lookups", cell.lookups},
               {"draws", cell.draws},
               {"null_collisions", cell.null_collisions},
               {"majorant_violations", cell.majorant_violations}};
  if (cell.lookups_variance) json["lookups_variance"] = *cell.lookups_variance;
  if (cell.lookups_theory) json["lookups_theory"] = *cell.lookups_theory;
  if (cell.instructions) json["instructions"] = *cell.instructions;
  if (cell.misses) json["last_level_misses"] = *cell.misses;
  if (!cell.instruction_history.empty()) json["instruction_history"] = cell.instruction_history;
  return json;
}

bool is_json(const std::filesystem::path& path) { return path.extension() == ".json"; }

/// Throws InputError where the baseline of the same configuration has what the new counts lack.
void refuse_losses(const Counts& before, const Counts& after) {
  if (before.config_hash != after.config_hash) return;
  std::map<std::string, const CellCounts*> later;
  for (const CellCounts& cell : after.cells) later.emplace(cell.name, &cell);
  for (const CellCounts& old : before.cells) {
    const auto at = later.find(old.name);
    if (at == later.end())
      throw InputError(
          fmt::format("{}: has no cell \"{}\", which the baseline has; run the whole configuration", after.source, old.name));
    const auto refuse = [&](const char* what) {
      throw InputError(fmt::format("{}: has no {} of \"{}\", which the baseline has; scripts/count-instructions counts them",
                                   after.source, what, old.name));
    };
    if (old.instructions && !at->second->instructions) refuse("instructions");
    if (old.misses && !at->second->misses) refuse("cache misses");
  }
  if (before.start_up && !after.start_up)
    throw InputError(after.source +
                     ": has no instructions of a start, which the baseline has; scripts/count-instructions counts them");
}

}  // namespace

Counts counts_of(const RunRecord& run, const std::string& file) {
  Counts counts;
  counts.source = file;
  counts.name = run.name;
  counts.config_hash = seedless_hash(run.config_text);
  counts.build = build_of(run);
  for (const char* selection : {"filter", "covering", "shard"}) counts.partial |= run.provenance.contains(selection);
  if (const Json start_up = provenance_of(run, kStartUpKey); start_up.is_number_unsigned())
    counts.start_up = start_up.get<std::uint64_t>();
  for (const CellRecord& record : run.cells) {
    if (record.status != Status::ok || record.samples == 0) continue;
    CellCounts cell;
    cell.name = record.cell.name;
    cell.id = record.cell.id;
    cell.setting = setting_of(record);
    cell.samples = record.samples;
    cell.lookups = record.lookups;
    cell.draws = record.draws;
    // Exact: the record holds the total over the samples, correctly rounded.
    cell.null_collisions = static_cast<std::uint64_t>(
        std::llround(record.null_collisions_per_sample.value_or(0) * static_cast<Real>(record.samples)));
    cell.majorant_violations = record.majorant_violations;
    cell.lookups_variance = record.lookups_variance;
    cell.lookups_theory = record.lookups_theory;
    cell.instructions = record.instructions;
    cell.misses = record.last_level_misses;
    counts.cells.push_back(std::move(cell));
  }
  refuse_repeated_names(counts);
  return counts;
}

Counts read_counts(const std::string& file) {
  const std::string text = read_file(file);
  const Json json = parse_json(text, file);
  const JsonNode top(json, file);
  top.expect_object();
  if (!top.has(kSchemaKey)) return counts_of(read_results(text, file), file);
  Counts counts = read_baseline(top);
  refuse_repeated_names(counts);
  return counts;
}

std::optional<Counts> find_baseline(const std::string& folder, const Counts& of, std::string& remedy) {
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_directory(folder))
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      if (is_json(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::string others;
  for (const std::filesystem::path& file : files) {
    Counts counts = read_counts(file.string());
    if (counts.name == of.name && counts.config_hash == of.config_hash && counts.build == of.build) return counts;
    const bool same_name = counts.name == of.name;
    others += fmt::format("{}{} ({})", others.empty() ? "; there are " : ", ", file.filename().string(),
                          !same_name                 ? "another configuration"
                          : counts.build == of.build ? "the configuration has changed since"
                                                     : "another build");
  }
  remedy = fmt::format("{}: no baseline of configuration {} ({}) and {}{}; --update makes one", folder, of.name, of.config_hash,
                       of.build.text(), others);
  return std::nullopt;
}

std::string baseline_file_name(const Counts& counts) {
  const BuildKey& build = counts.build;
  std::string name = fmt::format("{}.{}.{}.", counts.name.empty() ? "unnamed" : counts.name, build.compiler, build.march);
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-' && c != '_') c = '-';
  const std::uint64_t hash =
      fnv1a(fmt::format("{}\n{}\n{}\n{}\n{}\n{}", build.compiler, build.flags, build.march, build.simd, build.libc, build.cpu));
  return fmt::format("{}{:08x}.json", name, static_cast<std::uint32_t>(hash));
}

std::string baseline_text(const Counts& counts) {
  const BuildKey& build = counts.build;
  const Json key = {{"compiler", build.compiler}, {"march", build.march}, {"simd", build.simd},
                    {"libc", build.libc},         {"cpu", build.cpu},     {"flags", build.flags}};
  std::string text = fmt::format("{{\n\"{}\": {},\n\"name\": {},\n\"config_hash\": \"{}\",\n\"build\": {},\n", kSchemaKey,
                                 kSchema, Json(counts.name).dump(), counts.config_hash, key.dump());
  if (counts.start_up) text += fmt::format("\"{}\": {},\n", kStartUpKey, *counts.start_up);
  text += "\"cells\": [";
  for (std::size_t i = 0; i < counts.cells.size(); ++i)
    text += fmt::format("{}\n{}", i == 0 ? "" : ",", cell_counts_json(counts.cells[i]).dump());
  return text + "\n]\n}\n";
}

Counts refreshed(const Counts& before, Counts after) {
  refuse_losses(before, after);
  std::map<std::string, CellCounts*> later;
  for (CellCounts& cell : after.cells) later.emplace(cell.name, &cell);
  for (const CellCounts& old : before.cells) {
    const auto at = later.find(old.name);
    if (at == later.end()) continue;
    CellCounts& fresh = *at->second;
    if (!old.instructions || old.samples == 0 || !fresh.instructions) continue;
    if (old.id != fresh.id) continue;
    const Real change = std::abs(static_cast<Real>(*fresh.instructions) / static_cast<Real>(*old.instructions) - 1);
    if (!(change <= instruction_threshold(old.instruction_history))) continue;
    fresh.instruction_history = old.instruction_history;
    fresh.instruction_history.push_back(change);
    if (fresh.instruction_history.size() > kHistory) fresh.instruction_history.erase(fresh.instruction_history.begin());
  }
  return after;
}

}  // namespace nullmark
