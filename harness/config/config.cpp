#include "harness/config/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <set>

#include "harness/config/cell_names.h"
#include "harness/config/cell_patterns.h"
#include "harness/config/component_reader.h"
#include "harness/config/experiment.h"
#include "harness/io/claims_json.h"
#include "harness/io/file_io.h"
#include "harness/io/spec_fields.h"
#include "harness/io/spec_json.h"
#include "harness/io/tables_json.h"
#include "harness/io/text.h"
#include "harness/model/distinct.h"

namespace nullmark {
namespace {

/// Lists what cells refer to, equal specifications once.
class PlanBuilder {
 public:
  explicit PlanBuilder(Plan& plan) : plan_(plan) {}

  void add(const ConfiguredCell& configured) {
    Cell cell = configured.cell;
    cell.estimator = *configured.estimator;
    cell.minus = configured.minus;
    cell.medium = media_.place_in(plan_.media, *configured.medium);
    if (!(*configured.medium)->optional && plan_.media[cell.medium]->optional)
      plan_.media[cell.medium].edit([](MediumSpec& medium) { medium.optional = false; });
    cell.majorant = majorants_.place_in(plan_.majorants, *configured.majorant);
    cell.rays = ray_sets_.place_in(plan_.ray_sets, *configured.rays);
    plan_.cells.push_back(std::move(cell));
  }

 private:
  Plan& plan_;
  Distinct media_, majorants_, ray_sets_;
};

bool same_statistics(const ConfiguredCell& a, const ConfiguredCell& b) {
  const auto agree = [&](const Axis& axis) { return axis.agree(a, b); };
  return a.cell.experiment == b.cell.experiment && std::all_of(axes().begin(), axes().end(), agree) &&
         a.cell.own_streams == b.cell.own_streams;
}

bool agree(const TimingPlan& a, const TimingPlan& b) {
  return a.enabled == b.enabled && a.repetitions == b.repetitions && a.seconds == b.seconds &&
         a.samples_per_traversal == b.samples_per_traversal;
}

/// One file, expanded, before cells have names.
struct DraftPlan {
  std::string file, name;
  TimingPlan timing;
  ErrorRates error_rates;
  std::vector<ConfiguredCell> cells;
  std::vector<std::string> experiments;
  Json json;  ///< for what refers to cells, which is read when they have names
  std::map<std::string, std::string> credits;
};

DraftPlan read_file(const ConfigSource& source, std::optional<std::uint64_t> seed) {
  DraftPlan plan;
  plan.json = parse_json(source.text, source.file);
  const Json& json = plan.json;
  const JsonNode top(json, source.file);
  if (json.is_object() && json.contains("cells"))
    throw InputError(source.file + ": is a results file; nullmark check, compare and report read it");
  top.expect_object();
  constexpr const char* kFromVersion1 =
      "version 1 is no longer read; rename \"gate\" to \"verdict\", and \"verdict\" at the top to \"error_rates\"";
  if (json.contains("$schema") && json["$schema"] == "nullmark/config/1")
    top["$schema"].fail(fmt::format("{}; and replace this key by \"{}\": \"{}\"", kFromVersion1, kVersionKey, kConfigVersion));
  if (!json.contains(kVersionKey)) top.fail(fmt::format("expected the key \"{}\": \"{}\"", kVersionKey, kConfigVersion));
  if (top[kVersionKey].string() == "config/1")
    top[kVersionKey].fail(fmt::format("{}; and write \"{}\"", kFromVersion1, kConfigVersion));
  if (top[kVersionKey].string() != kConfigVersion) top[kVersionKey].expected(fmt::format("\"{}\"", kConfigVersion));
  refuse_renamed(top, "verdict", "error_rates");
  top.expect_keys(
      {"$schema", kVersionKey, "name", "seed", "timing", "error_rates", "experiments", "tables", "claims", "credits"});

  plan.file = source.file;
  plan.name = top.has("name") ? printable(top["name"].string()) : std::filesystem::path(source.file).stem().string();
  if (top.has("timing")) plan.timing = read_closed<TimingPlan>(top["timing"]);
  if (top.has("error_rates")) plan.error_rates = read_closed<ErrorRates>(top["error_rates"]);
  std::uint64_t own_seed = 1;
  if (top.has("seed")) own_seed = top["seed"].unsigned_integer(0, std::numeric_limits<std::uint64_t>::max());
  std::vector<std::string>& experiments = plan.experiments;
  std::map<std::vector<std::string>, std::vector<std::size_t>> of_labels;
  for (const JsonNode& entry : top["experiments"].elements()) {
    for (ConfiguredCell& configured : read_experiment(entry, seed.value_or(own_seed))) {
      std::vector<std::size_t>& alike =
          of_labels[{configured.cell.experiment, (*configured.estimator)->label, (*configured.medium)->label,
                     (*configured.majorant)->label, (*configured.rays)->label}];
      const auto same = [&](std::size_t other) { return same_statistics(configured, plan.cells[other]); };
      if (std::any_of(alike.begin(), alike.end(), same)) continue;
      alike.push_back(plan.cells.size());
      plan.cells.push_back(std::move(configured));
    }
    if (plan.cells.size() > kMostCells)
      entry.fail(
          fmt::format("with the experiments before it, it makes more than {} cells; split them into several files", kMostCells));
    const std::string name = printable(entry["name"].string());
    if (std::find(experiments.begin(), experiments.end(), name) != experiments.end())
      entry["name"].fail(fmt::format("\"{}\" is the name of an earlier experiment; expected another", name));
    experiments.push_back(name);
  }
  if (plan.cells.empty()) top["experiments"].expected("at least one experiment");
  if (top.has("credits")) {
    top["credits"].expect_object();
    for (const auto& [name, text] : top["credits"].json().items()) plan.credits[name] = top["credits"][name].string();
  }
  return plan;
}

/// Puts the configuration's name in front of experiments whose names occur in other files too.
void tell_experiments_apart(std::vector<DraftPlan>& files) {
  std::map<std::string, std::set<std::size_t>> owners;
  for (std::size_t i = 0; i < files.size(); ++i)
    for (const ConfiguredCell& configured : files[i].cells) owners[configured.cell.experiment].insert(i);
  std::map<std::string, std::size_t> taken;
  for (std::size_t i = 0; i < files.size(); ++i)
    for (ConfiguredCell& configured : files[i].cells) {
      std::string& name = configured.cell.experiment;
      if (owners[name].size() > 1) name = fmt::format("{}.{}", files[i].name, name);
      if (const auto [at, added] = taken.emplace(name, i); !added && at->second != i)
        throw InputError(
            fmt::format("{}: experiment \"{}\" stands in {} as well; expected another \"name\" of the file or experiment",
                        files[i].file, name, files[at->second].file));
    }
}

/// Short enough for a heading.
std::string joint_name(const std::vector<DraftPlan>& files) {
  std::string name = files[0].name;
  if (files.size() > 3) return fmt::format("{} and {} more", name, files.size() - 1);
  for (std::size_t i = 1; i < files.size(); ++i) name += fmt::format("+{}", files[i].name);
  return name;
}

}  // namespace

Plan read_config(const std::string& text, const std::string& file, std::optional<std::uint64_t> seed) {
  return read_configs({{text, file}}, seed);
}

Plan read_configs(const std::vector<ConfigSource>& sources, std::optional<std::uint64_t> seed) {
  std::vector<DraftPlan> files;
  files.reserve(sources.size());
  for (const ConfigSource& source : sources) files.push_back(read_file(source, seed));
  if (files.empty()) throw InputError("found no configuration; expected at least one file");
  tell_experiments_apart(files);

  Plan plan;
  plan.timing = files.front().timing;
  plan.error_rates = files.front().error_rates;
  plan.name = joint_name(files);
  std::size_t cells = 0;
  for (const DraftPlan& file : files) cells += file.cells.size();
  plan.cells.reserve(cells);
  PlanBuilder builder(plan);
  for (const DraftPlan& file : files) {
    if (!agree(file.timing, plan.timing))
      throw InputError(fmt::format("{}: /timing: differs from that of {}; expected the same, or run the files one by one",
                                   file.file, files.front().file));
    if (!(file.error_rates == plan.error_rates))
      throw InputError(fmt::format("{}: /error_rates: differs from that of {}; expected the same, or run the files one by one",
                                   file.file, files.front().file));
    for (const ConfiguredCell& configured : file.cells) builder.add(configured);
    if (plan.cells.size() > kMostCells)
      throw InputError(
          fmt::format("{}: with the files before it, it makes more than {} cells; run them one by one", file.file, kMostCells));
    plan.credits.insert(file.credits.begin(), file.credits.end());
  }
  name_cells(plan);
  std::size_t first = 0;
  for (const DraftPlan& file : files) {
    const JsonNode top(file.json, file.file);
    const CellPatterns finder(plan, first, file.cells, file.experiments);
    if (top.has("tables"))
      for (Table& table : read_tables(top["tables"], finder)) plan.tables.push_back(std::move(table));
    if (top.has("claims")) read_claims(top["claims"], finder, plan.claims);
    first += file.cells.size();
  }
  plan.config_text = applied_config(plan);
  return plan;
}

std::vector<ConfigSource> load_configs(const std::vector<std::string>& paths) {
  namespace fs = std::filesystem;
  std::vector<ConfigSource> sources;
  const auto load = [&](const fs::path& path) { sources.push_back({read_file(path.string(), kLargestConfig), path.string()}); };
  for (const std::string& path : paths) {
    if (path == "-") {
      sources.push_back({read_stream(std::cin, "<stdin>", kLargestConfig), "<stdin>"});
    } else if (fs::is_directory(path)) {
      std::vector<fs::path> files;
      for (const auto& entry : fs::directory_iterator(path))
        if (entry.path().extension() == ".json" && entry.is_regular_file()) files.push_back(entry.path());
      if (files.empty()) throw InputError(path + ": found no *.json; expected configuration files");
      std::sort(files.begin(), files.end());
      for (const fs::path& file : files) load(file);
    } else {
      load(path);
    }
  }
  return sources;
}

}  // namespace nullmark
