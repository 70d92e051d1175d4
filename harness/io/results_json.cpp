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

std::string results_text(const RunRecord& run) {
  Json provenance = Json::object();
  for (const auto& [key, text] : run.provenance) provenance[key] = known_json(text);
  std::string text = fmt::format("{{\n\"{}\": \"{}\",\n\"name\": {},\n\"config_hash\": \"{}\",\n\"config\": {},\n", kVersionKey,
                                 RunRecord::kVersion, Json(run.name).dump(), config_hash(run.config_text),
                                 run.config_text.empty() ? "null" : run.config_text);
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
