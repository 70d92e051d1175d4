#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "harness/io/claims_json.h"
#include "harness/io/results_json.h"
#include "harness/io/spec_json.h"
#include "harness/io/tables_json.h"
#include "harness/io/transport_json.h"
#include "harness/io/verdict_json.h"
#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/registry/components.h"

namespace nullmark {
namespace {

constexpr Real kNotANumber = std::numeric_limits<Real>::quiet_NaN();

std::optional<Real> optional_real(const JsonNode& node) {
  if (node.json().is_null()) return std::nullopt;
  return node.number();
}

std::optional<Real> optional_real(const JsonNode& object, const char* key) {
  return object.has(key) ? optional_real(object[key]) : std::nullopt;
}

Real real_or_nan(const JsonNode& object, const char* key) { return optional_real(object, key).value_or(kNotANumber); }

std::uint64_t count(const JsonNode& object, const char* key) { return object.has(key) ? object[key].unsigned_integer(0) : 0; }

std::string string_or_empty(const JsonNode& object, const char* key) {
  return object.has(key) && !object[key].json().is_null() ? object[key].string() : "";
}

/// The inverse of `reals` for a sampled cell.
std::vector<std::optional<Real>> read_reals(const JsonNode& object, const char* key, int outputs) {
  const auto size = static_cast<std::size_t>(outputs);
  if (!object.has(key) || object[key].json().is_null()) return std::vector<std::optional<Real>>(size);
  const JsonNode node = object[key];
  if (outputs == 1) return {optional_real(node)};
  if (!node.json().is_array() || node.json().size() != size) node.expected(fmt::format("a list of {} numbers", outputs));
  std::vector<std::optional<Real>> values;
  for (const JsonNode& element : node.elements()) values.push_back(optional_real(element));
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

ParameterValues read_parameters(ComponentKind kind, const std::string& type, const JsonNode& node) {
  node.expect_object();
  ParameterValues values;
  for (const auto& [name, json] : node.json().items()) {
    const JsonNode value = node[name];
    if (json.is_boolean()) {
      values[name] = json.get<bool>();
    } else if (json.is_number_float()) {
      values[name] = json.get<Real>();
    } else if (json.is_number()) {
      values[name] = static_cast<int>(value.integer(std::numeric_limits<int>::min(), std::numeric_limits<int>::max()));
    } else if (json.is_array()) {
      std::vector<Real> numbers;
      for (const JsonNode& element : value.elements()) numbers.push_back(element.number());
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

Component read_component(ComponentKind kind, const JsonNode& node) {
  Component component;
  component.type = node["type"].string();
  component.values = read_parameters(kind, component.type, node["params"]);
  component.label = node["label"].string();
  component.pointer = node.where();
  return component;
}

MediumSpec read_medium(const JsonNode& node) {
  MediumSpec medium;
  medium.field = read_component(ComponentKind::medium, node);
  medium.label = medium.field.label;
  if (node.has("spectrum"))
    for (const JsonNode& factor : node["spectrum"].elements()) medium.spectrum.push_back(factor.number());
  if (node.has("media"))
    for (const JsonNode& channel : node["media"].elements()) medium.per_channel.push_back(read_medium(channel));
  if (node.has("albedo")) medium.albedo = read_per_channel(node["albedo"], 1);
  if (node.has("anisotropy")) medium.anisotropy = node["anisotropy"].number();
  if (node.has("emission")) {
    medium.emission = read_per_channel(node["emission"]["radiance"], kInfinity);
    if (node["emission"].has("field")) medium.emission_field.push_back(read_medium(node["emission"]["field"]));
  }
  if (node.has("optional")) medium.optional = node["optional"].boolean();
  return medium;
}

TimeRecord read_time(const JsonNode& node) {
  node.expect_object();
  TimeRecord time;
  time.ns_per_sample = real_or_nan(node, "ns_per_sample");
  time.ns_per_lookup = real_or_nan(node, "ns_per_lookup");
  time.floor_ratio = real_or_nan(node, "floor_ratio");
  if (node.has("memory_ratio")) time.memory_ratio = optional_real(node, "memory_ratio").value_or(0);
  time.loop_ratio = real_or_nan(node, "loop_ratio");
  time.mad = real_or_nan(node, "mad");
  time.waiting = optional_real(node, "waiting");
  time.repetitions = static_cast<int>(node["repetitions"].integer(0, std::numeric_limits<int>::max()));
  time.threads = static_cast<int>(node["threads"].integer(0, std::numeric_limits<int>::max()));
  time.samples_per_traversal = count(node, "samples_per_traversal");
  if (node.has("batches"))
    for (const JsonNode& batch : node["batches"].elements())
      time.batches.push_back(
          {batch["samples_per_traversal"].unsigned_integer(1), real_or_nan(batch, "ns_per_sample"), real_or_nan(batch, "mad")});
  time.majorant_build_seconds = real_or_nan(node, "majorant_build_seconds");
  if (node.has("repetition_ns"))
    for (const JsonNode& ns : node["repetition_ns"].elements())
      time.repetition_ns.push_back(optional_real(ns).value_or(kNotANumber));
  return time;
}

void read_statistics(const JsonNode& node, CellRecord& record) {
  record.channel.resize(static_cast<std::size_t>(outputs_of(record)));
  const auto read = [&](const JsonNode& object, const char* key, std::optional<Real> ChannelRecord::*member) {
    const std::vector<std::optional<Real>> values = read_reals(object, key, outputs_of(record));
    for (std::size_t c = 0; c < values.size(); ++c) record.channel[c].*member = values[c];
  };
  read(node, "mean", &ChannelRecord::mean);
  read(node, "bias", &ChannelRecord::bias);
  read(node, "bias_theory", &ChannelRecord::bias_theory);
  read(node, "rmse", &ChannelRecord::rmse);
  read(node, "rmse_theory", &ChannelRecord::rmse_theory);
  read(node, "variance", &ChannelRecord::variance);
  read(node, "variance_theory", &ChannelRecord::variance_theory);
  read(node, "relative_variance", &ChannelRecord::relative_variance);
  read(node, "kurtosis", &ChannelRecord::kurtosis);
  read(node["reference"], "value", &ChannelRecord::reference);
  read(node["reference"], "error", &ChannelRecord::reference_error);
  read(node["reference"], "rms", &ChannelRecord::reference_rms);
}

}  // namespace

CellRecord read_cell(const JsonNode& node) {
  node.expect_object();
  CellRecord record;
  Cell& cell = record.cell;
  cell.id = node["id"].string();
  cell.name = node["name"].string();
  cell.experiment = node["experiment"].string();
  cell.estimator = read_component(ComponentKind::estimator, node["estimator"]);
  record.claims = node["estimator"]["claims"].string();
  record.range = node["estimator"]["range"].string();
  record.order = optional_real(node["estimator"], "order");
  if (node["estimator"].has("given_depth")) record.given_depth = node["estimator"]["given_depth"].boolean();
  record.reliance = optional_real(node, "reliance");
  record.medium = read_medium(node["medium"]);
  record.medium_hash = string_or_empty(node["medium"], "hash");
  record.majorant = read_component(ComponentKind::majorant, node["majorant"]);
  if (node["majorant"].has("cells"))
    record.structure =
        StructureSize{count(node["majorant"], "cells"), count(node["majorant"], "nodes"), count(node["majorant"], "bytes")};
  record.ray_set = read_component(ComponentKind::ray_set, node["ray_set"]);
  cell.quantity = *quantity_named(node["quantity"].one_of(quantity_names(), "quantity"));
  if (node.has("precision")) cell.precision = precision_named(node["precision"].one_of(precision_names(), "precision"));
  cell.measurement.clamp = node["measurement"]["clamp"].boolean();
  cell.measurement.quantise_bits = static_cast<int>(node["measurement"]["quantise_bits"].integer(0, 31));
  if (node.has("transport")) cell.transport = read_transport(node["transport"]);
  record.channels = static_cast<int>(node["channels"].integer(1, kMaxChannels));
  if (node.has("outputs"))
    for (const JsonNode& output : node["outputs"].elements()) record.outputs.push_back(output.string());
  record.effects.clear();
  for (const JsonNode& effect : node["effects"].elements()) record.effects.push_back(effect.string());
  record.rays = node["rays"].unsigned_integer(0);
  cell.samples_per_ray = node["samples_per_ray"].unsigned_integer(0);
  cell.equal_lookups = optional_real(node, "equal_lookups");
  record.samples = node["samples"].unsigned_integer(0);
  cell.seed = node["seed"].unsigned_integer(0);
  cell.own_streams = node["own_streams"].boolean();
  const std::string status = node["status"].one_of(status_names(), "status");
  record.status = static_cast<Status>(std::find(status_names().begin(), status_names().end(), status) - status_names().begin());
  record.reason = string_or_empty(node, "reason");
  record.reference_method = string_or_empty(node["reference"], "method");
  record.variance_basis = string_or_empty(node, "variance_basis");
  if (record.samples > 0) read_statistics(node, record);
  record.lookups_per_sample = optional_real(node, "lookups_per_sample");
  record.lookups_theory = optional_real(node, "lookups_theory");
  record.null_collisions_per_sample = optional_real(node, "null_collisions_per_sample");
  record.draws_per_sample = optional_real(node, "rng_draws_per_sample");
  record.lookups = count(node, "lookups");
  record.draws = count(node, "rng_draws");
  record.lookups_variance = optional_real(node, "lookups_variance");
  if (node.has("squared_error_blocks"))
    for (const JsonNode& block : node["squared_error_blocks"].elements()) record.squared_error_blocks.push_back(block.number());
  if (node.has("instructions")) record.instructions = count(node, "instructions");
  record.majorant_violations = count(node, "majorant_violations");
  record.largest_violation = optional_real(node, "largest_violation");
  record.largest_sample = optional_real(node, "largest_sample");
  record.nonfinite = count(node, "nonfinite");
  if (node.has("verdict") && !node["verdict"].json().is_null()) record.verdict = read_verdict(node["verdict"]);
  if (node.has("time") && !node["time"].json().is_null()) record.time = read_time(node["time"]);
  if (node.has("convergence"))
    for (const JsonNode& step : node["convergence"].elements())
      record.convergence.push_back({step["samples"].unsigned_integer(0), read_reals(step, "rmse", outputs_of(record)),
                                    read_reals(step, "variance", outputs_of(record))});
  cell.image_maximum = optional_real(node, "image_maximum").value_or(1);
  cell.images = node.has("images");
  if (cell.images) {
    node["images"].expect_object();
    for (const auto& [kind, path] : node["images"].json().items()) record.images[kind] = node["images"][kind].string();
  }
  return record;
}

RunRecord read_results(const std::string& text, const std::string& file) {
  const auto no_results = [&] { return InputError(file + ": is not a results file of nullmark; `nullmark run` writes them"); };
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && text[first] != '{') throw no_results();
  const Json json = parse_json(text, file);
  const JsonNode top(json, file);
  if (json.contains("experiments")) throw InputError(file + ": is a configuration; `nullmark run` it first");
  if (json.contains("nullmark_schema"))
    throw InputError(fmt::format("{}: are results of version 1; this program reads \"{}\": \"{}\": run their configuration again",
                                 file, kVersionKey, RunRecord::kVersion));
  if (!top.has(kVersionKey)) throw no_results();
  if (json[kVersionKey] != RunRecord::kVersion)
    top[kVersionKey].expected(fmt::format("\"{}\", the version this program reads", RunRecord::kVersion));
  RunRecord run;
  run.name = top["name"].string();
  if (!top["config"].json().is_null()) run.config_text = top["config"].json().dump();
  top["provenance"].expect_object();
  for (const auto& [key, value] : top["provenance"].json().items()) run.provenance[key] = value.dump();
  for (const JsonNode& cell : top["cells"].elements()) run.cells.push_back(read_cell(cell));
  if (top.has("tables")) run.tables = read_tables(top["tables"], CellReader());
  if (top.has("claims")) read_claims(top["claims"], CellReader(), run.claims);
  return run;
}

}  // namespace nullmark
