#include "harness/io/spec_json.h"

#include <fmt/format.h>

#include "harness/io/claims_json.h"
#include "harness/io/spec_fields.h"
#include "harness/io/tables_json.h"
#include "harness/io/transport_json.h"
#include "harness/model/hash.h"
#include "harness/model/names.h"

namespace nullmark {
namespace {

std::string hexadecimal(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

void add_samples(Json& json, const Cell& cell) {
  if (cell.equal_lookups)
    json["equal_lookups"] = *cell.equal_lookups;
  else
    json["samples_per_ray"] = cell.samples_per_ray;
}

/// The keys that decide the statistics.
Json deciding_json(const Plan& plan, const Cell& cell) {
  Json json = {{"estimator", component_json(*cell.estimator)},
               {"medium", medium_json(*plan.media[cell.medium])},
               {"majorant", component_json(*plan.majorants[cell.majorant])},
               {"rays", component_json(*plan.ray_sets[cell.rays])},
               {"quantity", to_string(cell.quantity)},
               {"measurement", fields_json(cell.measurement)}};
  if (cell.minus) json["minus"] = component_json(**cell.minus);
  if (cell.transport != TransportSpec{}) json["transport"] = transport_json(cell.transport);
  if (cell.precision != Precision::float64) json["precision"] = to_string(cell.precision);
  if (!cell.lanes) json["lanes"] = false;
  add_samples(json, cell);
  json["seed"] = cell.seed;
  json["own_streams"] = cell.own_streams;
  return json;
}

/// All keys of a cell.
Json applied_json(const Plan& plan, const Cell& cell) {
  Json json = deciding_json(plan, cell);
  if (plan.media[cell.medium]->optional) json["medium"]["optional"] = true;
  json["images"] = cell.images;
  json["image_maximum"] = cell.image_maximum;
  json["verdict"] = fields_json(cell.verdict);
  if (cell.reference) json["reference"] = fields_json(*cell.reference);
  return json;
}

}  // namespace

Json parameters_json(const ParameterValues& values) {
  Json json = Json::object();
  for (const auto& [name, value] : values) std::visit([&, &key = name](const auto& held) { json[key] = held; }, value);
  return json;
}

Json component_json(const Component& component) {
  Json json = {{"type", component.type}};
  json.update(parameters_json(component.values));
  return json;
}

Json medium_json(const MediumSpec& medium) {
  Json json = component_json(medium.field);
  if (!medium.spectrum.empty()) json["spectrum"] = medium.spectrum;
  for (const MediumSpec& channel : medium.per_channel) json["media"].push_back(medium_json(channel));
  add_matter(json, medium);
  return json;
}

void add_matter(Json& json, const MediumSpec& medium) {
  if (!medium.albedo.empty()) json["albedo"] = medium.albedo;
  if (!medium.albedo_field.empty()) json["albedo"] = {{"field", medium_json(medium.albedo_field[0])}};
  if (medium.anisotropy != 0) json["anisotropy"] = medium.anisotropy;
  if (medium.emission.empty()) return;
  json["emission"] = {{"radiance", medium.emission}};
  if (!medium.emission_field.empty()) json["emission"]["field"] = medium_json(medium.emission_field[0]);
}

std::string cell_id(const Plan& plan, const Cell& cell) { return hexadecimal(fnv1a(deciding_json(plan, cell).dump())); }

std::string applied_config(const Plan& plan) {
  // Text for text: of many cells a JSON tree is three times as large.
  std::string text =
      fmt::format(R"({{"{}":"{}","name":{},"timing":{},"error_rates":{},"experiments":[)", kVersionKey, kConfigVersion,
                  Json(plan.name).dump(), fields_json(plan.timing).dump(), fields_json(plan.error_rates).dump());
  const std::string* experiment = nullptr;
  for (const Cell& cell : plan.cells) {
    const bool same = experiment && *experiment == cell.experiment;
    if (!same) text += fmt::format(R"({}{{"name":{},"include":[)", experiment ? "]}," : "", Json(cell.experiment).dump());
    experiment = &cell.experiment;
    text += (same ? "," : "") + applied_json(plan, cell).dump();
  }
  text += fmt::format(R"({}],"tables":{})", experiment ? "]}" : "", tables_json(plan.tables).dump());
  if (!plan.claims.empty()) text += fmt::format(R"(,"claims":{})", claims_json(plan.claims).dump());
  if (!plan.credits.empty()) text += fmt::format(R"(,"credits":{})", Json(plan.credits).dump());
  text += "}";
  text.shrink_to_fit();  // it stays as long as the run
  return text;
}

std::string config_hash(const std::string& config_text) { return hexadecimal(fnv1a(config_text)); }

}  // namespace nullmark
