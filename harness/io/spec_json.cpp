#include "harness/io/spec_json.h"

#include <fmt/format.h>

#include "harness/io/cell_texts.h"
#include "harness/io/claims_json.h"
#include "harness/io/spec_fields.h"
#include "harness/io/tables_json.h"
#include "harness/model/hash.h"

namespace nullmark {

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

std::string applied_config(const Plan& plan) {
  // Text for text: of many cells a JSON tree is three times as large.
  CellTexts texts(plan);
  std::string text =
      fmt::format(R"({{"{}":"{}","name":{},"timing":{},"error_rates":{},"experiments":[)", kVersionKey, kConfigVersion,
                  Json(plan.name).dump(), fields_json(plan.timing).dump(), fields_json(plan.error_rates).dump());
  const std::string* experiment = nullptr;
  for (const Cell& cell : plan.cells) {
    const bool same = experiment && *experiment == cell.experiment;
    if (!same) text += fmt::format(R"({}{{"name":{},"include":[)", experiment ? "]}," : "", Json(cell.experiment).dump());
    experiment = &cell.experiment;
    text += (same ? "," : "") + texts.applied(cell);
  }
  text += fmt::format(R"({}],"tables":{})", experiment ? "]}" : "", tables_json(plan.tables).dump());
  if (!plan.claims.empty()) text += fmt::format(R"(,"claims":{})", claims_json(plan.claims).dump());
  if (!plan.credits.empty()) text += fmt::format(R"(,"credits":{})", Json(plan.credits).dump());
  text += "}";
  text.shrink_to_fit();  // it stays as long as the run
  return text;
}

std::string config_hash(const std::string& config_text) { return fmt::format("{:016x}", fnv1a(config_text)); }

}  // namespace nullmark
