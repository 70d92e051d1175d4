#include "harness/io/results_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/io/claims_json.h"
#include "harness/io/spec_json.h"
#include "harness/io/tables_json.h"
#include "harness/io/transport_json.h"
#include "harness/io/verdict_json.h"
#include "harness/model/cost.h"
#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/registry/components.h"

namespace nullmark {
namespace {

constexpr Real kNotANumber = std::numeric_limits<Real>::quiet_NaN();

int outputs_of(const CellRecord& record) {
  return record.outputs.empty() ? record.channels : static_cast<int>(record.outputs.size());
}

Json reals(const std::vector<std::optional<Real>>& values, int outputs) {
  if (outputs == 1) return values.empty() ? Json(nullptr) : number_or_null(values[0]);
  Json list = Json::array();
  for (const std::optional<Real>& value : values) list.push_back(number_or_null(value));
  return list.empty() ? Json(nullptr) : list;
}

/// A number, or a list of one per channel; null where the cell was not sampled.
template <class Get>
Json per_channel(const CellRecord& record, const Get& get) {
  std::vector<std::optional<Real>> values;
  for (std::size_t c = 0; c < record.channel.size(); ++c) values.push_back(get(c));
  return reals(values, outputs_of(record));
}

Json field(const CellRecord& record, std::optional<Real> ChannelRecord::*member) {
  return per_channel(record, [&](std::size_t c) { return record.channel[c].*member; });
}

Json typed(const Component& component) {
  return {{"type", component.type}, {"params", parameters_json(component.values)}, {"label", component.label}};
}

Json typed(const MediumSpec& medium) {
  Json json = {{"type", medium.field.type}, {"params", parameters_json(medium.field.values)}, {"label", medium.label}};
  if (!medium.spectrum.empty()) json["spectrum"] = medium.spectrum;
  for (const MediumSpec& channel : medium.per_channel) json["media"].push_back(typed(channel));
  add_matter(json, medium);
  if (!medium.emission_field.empty()) json["emission"]["field"] = typed(medium.emission_field[0]);
  if (medium.optional) json["optional"] = true;
  return json;
}

Json time_json(const CellRecord& record) {
  if (!record.time) return nullptr;
  const TimeRecord& time = *record.time;
  Json repetitions = Json::array();
  for (const Real ns : time.repetition_ns) repetitions.push_back(number_or_null(ns));
  Json batches = Json::array();
  for (const BatchTime& batch : time.batches)
    batches.push_back({{"samples_per_traversal", batch.samples_per_traversal},
                       {"ns_per_sample", number_or_null(batch.ns_per_sample)},
                       {"mad", number_or_null(batch.mad)}});
  const std::optional<Cost> cost = cost_of(record);
  const std::optional<Interval> to_one_percent = cost ? seconds_to(*cost, 0.01) : std::nullopt;
  return {{"ns_per_sample", number_or_null(time.ns_per_sample)},
          {"ns_per_lookup", number_or_null(time.ns_per_lookup)},
          {"floor_ratio", number_or_null(time.floor_ratio)},
          {"memory_ratio", time.memory_ratio > 0 ? number_or_null(time.memory_ratio) : Json()},
          {"loop_ratio", number_or_null(time.loop_ratio)},
          {"repetitions", time.repetitions},
          {"mad", number_or_null(time.mad)},
          {"waiting", number_or_null(time.waiting)},
          {"threads", time.threads},
          {"traversal_included", true},
          {"samples_per_traversal", time.samples_per_traversal},
          {"batches", std::move(batches)},
          {"repetition_ns", std::move(repetitions)},
          {"majorant_build_seconds", number_or_null(time.majorant_build_seconds)},
          {"variance_x_ns", per_channel(record, [&](std::size_t c) { return variance_x_ns(record, c); })},
          {"seconds_to_1pct", number_or_null(to_one_percent ? std::optional(to_one_percent->value) : std::nullopt)}};
}

Json convergence_json(const CellRecord& record) {
  Json list = Json::array();
  for (const ConvergenceRecord& step : record.convergence)
    list.push_back({{"samples", step.samples},
                    {"rmse", reals(step.rmse, outputs_of(record))},
                    {"variance", reals(step.variance, outputs_of(record))}});
  return list;
}

std::optional<Real> optional_real(const Place& place) {
  if (place.json().is_null()) return std::nullopt;
  return place.number();
}

std::optional<Real> optional_real(const Place& object, const char* key) {
  return object.has(key) ? optional_real(object[key]) : std::nullopt;
}

Real real_or_nan(const Place& object, const char* key) { return optional_real(object, key).value_or(kNotANumber); }

std::uint64_t count(const Place& object, const char* key) { return object.has(key) ? object[key].unsigned_integer(0) : 0; }

std::string string_or_empty(const Place& object, const char* key) {
  return object.has(key) && !object[key].json().is_null() ? object[key].string() : "";
}

/// The inverse of `reals` for a sampled cell.
std::vector<std::optional<Real>> read_reals(const Place& object, const char* key, int outputs) {
  const auto size = static_cast<std::size_t>(outputs);
  if (!object.has(key) || object[key].json().is_null()) return std::vector<std::optional<Real>>(size);
  const Place place = object[key];
  if (outputs == 1) return {optional_real(place)};
  if (!place.json().is_array() || place.json().size() != size) place.expected(fmt::format("a list of {} numbers", outputs));
  std::vector<std::optional<Real>> values;
  for (const Place& element : place.elements()) values.push_back(optional_real(element));
  return values;
}

/// A point and a list of three numbers look alike in JSON; only the registry can tell.
bool is_point(ComponentKind kind, const std::string& type, const std::string& parameter) {
  try {
    for (const ParameterInfo& info : parameters_of(kind, type))
      if (info.name == parameter) return std::holds_alternative<std::array<Real, 3>>(info.default_value);
  } catch (const ParameterError&) {
    // Results of plug-ins that are not linked in can be read all the same.
  }
  return false;
}

ParameterValues read_parameters(ComponentKind kind, const std::string& type, const Place& place) {
  place.expect_object();
  ParameterValues values;
  for (const auto& [name, json] : place.json().items()) {
    const Place value = place[name];
    if (json.is_boolean()) {
      values[name] = json.get<bool>();
    } else if (json.is_number_float()) {
      values[name] = json.get<Real>();
    } else if (json.is_number()) {
      values[name] = static_cast<int>(value.integer(std::numeric_limits<int>::min(), std::numeric_limits<int>::max()));
    } else if (json.is_array()) {
      std::vector<Real> numbers;
      for (const Place& element : value.elements()) numbers.push_back(element.number());
      if (numbers.size() == 3 && is_point(kind, type, name))
        values[name] = std::array{numbers[0], numbers[1], numbers[2]};
      else
        values[name] = std::move(numbers);
    } else {
      values[name] = value.string();
    }
  }
  return values;
}

Component read_component(ComponentKind kind, const Place& place) {
  Component component;
  component.type = place["type"].string();
  component.values = read_parameters(kind, component.type, place["params"]);
  component.label = place["label"].string();
  component.pointer = place.where();
  return component;
}

MediumSpec read_medium(const Place& place) {
  MediumSpec medium;
  medium.field = read_component(ComponentKind::medium, place);
  medium.label = medium.field.label;
  if (place.has("spectrum"))
    for (const Place& factor : place["spectrum"].elements()) medium.spectrum.push_back(factor.number());
  if (place.has("media"))
    for (const Place& channel : place["media"].elements()) medium.per_channel.push_back(read_medium(channel));
  if (place.has("albedo")) medium.albedo = read_per_channel(place["albedo"], 1);
  if (place.has("anisotropy")) medium.anisotropy = place["anisotropy"].number();
  if (place.has("emission")) {
    medium.emission = read_per_channel(place["emission"]["radiance"], kInfinity);
    if (place["emission"].has("field")) medium.emission_field.push_back(read_medium(place["emission"]["field"]));
  }
  if (place.has("optional")) medium.optional = place["optional"].boolean();
  return medium;
}

TimeRecord read_time(const Place& place) {
  place.expect_object();
  TimeRecord time;
  time.ns_per_sample = real_or_nan(place, "ns_per_sample");
  time.ns_per_lookup = real_or_nan(place, "ns_per_lookup");
  time.floor_ratio = real_or_nan(place, "floor_ratio");
  if (place.has("memory_ratio")) time.memory_ratio = optional_real(place, "memory_ratio").value_or(0);
  time.loop_ratio = real_or_nan(place, "loop_ratio");
  time.mad = real_or_nan(place, "mad");
  time.waiting = optional_real(place, "waiting");
  time.repetitions = static_cast<int>(place["repetitions"].integer(0, std::numeric_limits<int>::max()));
  time.threads = static_cast<int>(place["threads"].integer(0, std::numeric_limits<int>::max()));
  time.samples_per_traversal = count(place, "samples_per_traversal");
  if (place.has("batches"))
    for (const Place& batch : place["batches"].elements())
      time.batches.push_back(
          {batch["samples_per_traversal"].unsigned_integer(1), real_or_nan(batch, "ns_per_sample"), real_or_nan(batch, "mad")});
  time.majorant_build_seconds = real_or_nan(place, "majorant_build_seconds");
  if (place.has("repetition_ns"))
    for (const Place& ns : place["repetition_ns"].elements())
      time.repetition_ns.push_back(optional_real(ns).value_or(kNotANumber));
  return time;
}

void read_statistics(const Place& place, CellRecord& record) {
  record.channel.resize(static_cast<std::size_t>(outputs_of(record)));
  const auto read = [&](const Place& object, const char* key, std::optional<Real> ChannelRecord::*member) {
    const std::vector<std::optional<Real>> values = read_reals(object, key, outputs_of(record));
    for (std::size_t c = 0; c < values.size(); ++c) record.channel[c].*member = values[c];
  };
  read(place, "mean", &ChannelRecord::mean);
  read(place, "bias", &ChannelRecord::bias);
  read(place, "bias_theory", &ChannelRecord::bias_theory);
  read(place, "rmse", &ChannelRecord::rmse);
  read(place, "rmse_theory", &ChannelRecord::rmse_theory);
  read(place, "variance", &ChannelRecord::variance);
  read(place, "variance_theory", &ChannelRecord::variance_theory);
  read(place, "relative_variance", &ChannelRecord::relative_variance);
  read(place, "kurtosis", &ChannelRecord::kurtosis);
  read(place["reference"], "value", &ChannelRecord::reference);
  read(place["reference"], "error", &ChannelRecord::reference_error);
  read(place["reference"], "rms", &ChannelRecord::reference_rms);
}

}  // namespace

Json cell_json(const CellRecord& record) {
  const Cell& cell = record.cell;
  Json estimator = typed(cell.estimator);
  estimator["claims"] = record.claims;
  estimator["range"] = record.range;
  if (record.order) estimator["order"] = *record.order;
  if (record.given_depth) estimator["given_depth"] = true;
  Json medium = typed(record.medium);
  medium["hash"] = record.medium_hash;
  Json majorant = typed(record.majorant);
  if (record.structure) {
    majorant["cells"] = record.structure->cells;
    majorant["nodes"] = record.structure->nodes;
    majorant["bytes"] = record.structure->bytes;
  }

  Json json = {{"id", cell.id},
               {"name", cell.name},
               {"experiment", cell.experiment},
               {"estimator", std::move(estimator)},
               {"medium", std::move(medium)},
               {"majorant", std::move(majorant)},
               {"ray_set", typed(record.ray_set)},
               {"quantity", to_string(cell.quantity)},
               {"precision", to_string(cell.precision)},
               {"measurement", measurement_json(cell.measurement)},
               {"transport", transport_json(cell.transport)},
               {"channels", record.channels},
               {"outputs", record.outputs},
               {"effects", record.effects},
               {"rays", record.rays},
               {"samples_per_ray", cell.samples_per_ray}};
  if (cell.equal_lookups) json["equal_lookups"] = *cell.equal_lookups;
  json.update(Json{
      {"samples", record.samples}, {"seed", cell.seed}, {"own_streams", cell.own_streams}, {"status", to_string(record.status)}});
  if (!record.reason.empty()) json["reason"] = record.reason;
  if (record.reliance) json["reliance"] = number_or_null(record.reliance);
  json.update(Json{
      {"mean", field(record, &ChannelRecord::mean)},
      {"reference",
       {{"value", field(record, &ChannelRecord::reference)},
        {"error", field(record, &ChannelRecord::reference_error)},
        {"rms", field(record, &ChannelRecord::reference_rms)},
        {"method", record.reference_method}}},
      {"bias", field(record, &ChannelRecord::bias)},
      {"bias_theory", field(record, &ChannelRecord::bias_theory)},
      {"rmse", field(record, &ChannelRecord::rmse)},
      {"rmse_theory", field(record, &ChannelRecord::rmse_theory)},
      {"variance", field(record, &ChannelRecord::variance)},
      {"variance_theory", field(record, &ChannelRecord::variance_theory)},
      {"variance_basis", record.variance_basis},
      {"relative_variance", field(record, &ChannelRecord::relative_variance)},
      {"kurtosis", field(record, &ChannelRecord::kurtosis)},
      {"lookups_per_sample", number_or_null(record.lookups_per_sample)},
      {"lookups_theory", number_or_null(record.lookups_theory)},
      {"null_collisions_per_sample", number_or_null(record.null_collisions_per_sample)},
      {"rng_draws_per_sample", number_or_null(record.draws_per_sample)},
      {"lookups", record.lookups},
      {"rng_draws", record.draws},
      {"lookups_variance", number_or_null(record.lookups_variance)},
      {"squared_error_blocks", record.squared_error_blocks},
      {"majorant_violations", record.majorant_violations},
      {"largest_violation", number_or_null(record.largest_violation)},
      {"largest_sample", number_or_null(record.largest_sample)},
      {"nonfinite", record.nonfinite},
      {"verdict", record.verdict ? verdict_json(*record.verdict) : Json(nullptr)},
      {"time", time_json(record)},
      {"efficiency", {{"variance_x_lookups", per_channel(record, [&](std::size_t c) { return variance_x_lookups(record, c); })}}},
      {"convergence", convergence_json(record)},
      {"image_maximum", number_or_null(cell.image_maximum)}});
  if (record.instructions) json["instructions"] = *record.instructions;
  if (cell.images) json["images"] = record.images;
  return json;
}

CellRecord read_cell(const Place& place) {
  place.expect_object();
  CellRecord record;
  Cell& cell = record.cell;
  cell.id = place["id"].string();
  cell.name = place["name"].string();
  cell.experiment = place["experiment"].string();
  cell.estimator = read_component(ComponentKind::estimator, place["estimator"]);
  record.claims = place["estimator"]["claims"].string();
  record.range = place["estimator"]["range"].string();
  record.order = optional_real(place["estimator"], "order");
  if (place["estimator"].has("given_depth")) record.given_depth = place["estimator"]["given_depth"].boolean();
  record.reliance = optional_real(place, "reliance");
  record.medium = read_medium(place["medium"]);
  record.medium_hash = string_or_empty(place["medium"], "hash");
  record.majorant = read_component(ComponentKind::majorant, place["majorant"]);
  if (place["majorant"].has("cells"))
    record.structure =
        StructureSize{count(place["majorant"], "cells"), count(place["majorant"], "nodes"), count(place["majorant"], "bytes")};
  record.ray_set = read_component(ComponentKind::ray_set, place["ray_set"]);
  cell.quantity = *quantity_named(place["quantity"].one_of(quantity_names(), "quantity"));
  if (place.has("precision")) cell.precision = precision_named(place["precision"].one_of(precision_names(), "precision"));
  cell.measurement.clamp = place["measurement"]["clamp"].boolean();
  cell.measurement.quantise_bits = static_cast<int>(place["measurement"]["quantise_bits"].integer(0, 31));
  if (place.has("transport")) cell.transport = read_transport(place["transport"]);
  record.channels = static_cast<int>(place["channels"].integer(1, kMaxChannels));
  if (place.has("outputs"))
    for (const Place& output : place["outputs"].elements()) record.outputs.push_back(output.string());
  record.effects.clear();
  for (const Place& effect : place["effects"].elements()) record.effects.push_back(effect.string());
  record.rays = place["rays"].unsigned_integer(0);
  cell.samples_per_ray = place["samples_per_ray"].unsigned_integer(0);
  cell.equal_lookups = optional_real(place, "equal_lookups");
  record.samples = place["samples"].unsigned_integer(0);
  cell.seed = place["seed"].unsigned_integer(0);
  cell.own_streams = place["own_streams"].boolean();
  const std::string status = place["status"].one_of(status_names(), "status");
  record.status = static_cast<Status>(std::find(status_names().begin(), status_names().end(), status) - status_names().begin());
  record.reason = string_or_empty(place, "reason");
  record.reference_method = string_or_empty(place["reference"], "method");
  record.variance_basis = string_or_empty(place, "variance_basis");
  if (record.samples > 0) read_statistics(place, record);
  record.lookups_per_sample = optional_real(place, "lookups_per_sample");
  record.lookups_theory = optional_real(place, "lookups_theory");
  record.null_collisions_per_sample = optional_real(place, "null_collisions_per_sample");
  record.draws_per_sample = optional_real(place, "rng_draws_per_sample");
  record.lookups = count(place, "lookups");
  record.draws = count(place, "rng_draws");
  record.lookups_variance = optional_real(place, "lookups_variance");
  if (place.has("squared_error_blocks"))
    for (const Place& block : place["squared_error_blocks"].elements()) record.squared_error_blocks.push_back(block.number());
  if (place.has("instructions")) record.instructions = count(place, "instructions");
  record.majorant_violations = count(place, "majorant_violations");
  record.largest_violation = optional_real(place, "largest_violation");
  record.largest_sample = optional_real(place, "largest_sample");
  record.nonfinite = count(place, "nonfinite");
  if (place.has("verdict") && !place["verdict"].json().is_null()) record.verdict = read_verdict(place["verdict"]);
  if (place.has("time") && !place["time"].json().is_null()) record.time = read_time(place["time"]);
  if (place.has("convergence"))
    for (const Place& step : place["convergence"].elements())
      record.convergence.push_back({step["samples"].unsigned_integer(0), read_reals(step, "rmse", outputs_of(record)),
                                    read_reals(step, "variance", outputs_of(record))});
  cell.image_maximum = optional_real(place, "image_maximum").value_or(1);
  cell.images = place.has("images");
  if (cell.images) {
    place["images"].expect_object();
    for (const auto& [kind, path] : place["images"].json().items()) record.images[kind] = place["images"][kind].string();
  }
  return record;
}

std::string results_text(const RunRecord& run) {
  Json provenance = Json::object();
  for (const auto& [key, text] : run.provenance) provenance[key] = known_json(text);
  std::string text =
      fmt::format("{{\n\"nullmark_schema\": {},\n\"name\": {},\n\"config_hash\": \"{}\",\n\"config\": {},\n", RunRecord::kSchema,
                  Json(run.name).dump(), config_hash(run.config_text), run.config_text.empty() ? "null" : run.config_text);
  text += fmt::format("\"provenance\": {},\n\"cells\": [", provenance.dump());
  for (std::size_t i = 0; i < run.cells.size(); ++i) {
    text += i == 0 ? "\n" : ",\n";
    text += cell_json(run.cells[i]).dump();
  }
  text += fmt::format("\n],\n\"tables\": {}", tables_json(run.tables).dump());
  if (!run.claims.empty()) text += fmt::format(",\n\"claims\": {}", claims_json(run.claims).dump());
  text += "\n}\n";
  return text;
}

RunRecord read_results(const std::string& text, const std::string& file) {
  const auto no_results = [&] { return InputError(file + ": is no results file of nullmark; `nullmark run` writes them"); };
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && text[first] != '{') throw no_results();
  const Json json = parse_json(text, file);
  const Place top(json, file);
  if (json.contains("$schema") && json["$schema"] == kConfigSchema)
    throw InputError(file + ": is a configuration; `nullmark run` it first");
  if (!top.has("nullmark_schema")) throw no_results();
  if (const Place schema = top["nullmark_schema"];
      !json["nullmark_schema"].is_number_integer() || json["nullmark_schema"] != RunRecord::kSchema)
    schema.expected(fmt::format("{}, the schema this program reads", RunRecord::kSchema));
  RunRecord run;
  run.name = top["name"].string();
  if (!top["config"].json().is_null()) run.config_text = top["config"].json().dump();
  top["provenance"].expect_object();
  for (const auto& [key, value] : top["provenance"].json().items()) run.provenance[key] = value.dump();
  for (const Place& cell : top["cells"].elements()) run.cells.push_back(read_cell(cell));
  if (top.has("tables")) run.tables = read_tables(top["tables"], CellReader());
  if (top.has("claims")) read_claims(top["claims"], CellReader(), run.claims);
  return run;
}

std::string statistics_text(const RunRecord& run) {
  std::string text;
  for (const CellRecord& record : run.cells) {
    Json json = cell_json(record);
    json.erase("time");
    json.erase("instructions");
    json.erase("images");
    text += json.dump() + "\n";
  }
  return text;
}

}  // namespace nullmark
