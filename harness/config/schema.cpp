#include "harness/config/schema.h"

#include <fmt/format.h>

#include <cmath>

#include "harness/config/axes.h"
#include "harness/io/results_json.h"
#include "harness/io/spec_fields.h"
#include "harness/io/spec_json.h"
#include "harness/model/metrics.h"

namespace nullmark {
namespace {

constexpr const char* kDraft = "http://json-schema.org/draft-07/schema#";

Json reference(const std::string& name) { return {{"$ref", "#/definitions/" + name}}; }

Json list_of(Json item, int least = 0) {
  Json json = list_schema(std::move(item));
  if (least > 0) json["minItems"] = least;
  return json;
}

/// An object without keys of its own making, but for comments.
Json closed_object(Json properties, const std::vector<std::string>& required = {}) {
  Json json = {{"type", "object"},
               {"properties", std::move(properties)},
               {"patternProperties", {{"^x-", Json::object()}}},
               {"additionalProperties", false}};
  if (!required.empty()) json["required"] = required;
  return json;
}

Json range_schema(const Range& range) {
  Json json = {{"type", "number"}};
  if (std::isfinite(range.low)) json[range.exclusive ? "exclusiveMinimum" : "minimum"] = range.low;
  if (std::isfinite(range.high)) json["maximum"] = range.high;
  return json;
}

/// What any medium takes beside its type's parameters.
void add_matter_schema(Json& properties) {
  const Json number = {{"type", "number"}, {"minimum", 0}};
  const Json albedo = one_or_list_schema(Json{{"type", "number"}, {"minimum", 0}, {"maximum", 1}});
  properties["albedo"] = {{"anyOf", {one_or_list_schema(albedo), closed_object({{"field", reference("medium")}}, {"field"})}},
                          {"description", "mu_s / mu, one for all channels or one each; or a medium whose extinction it is"}};
  properties["anisotropy"] =
      one_or_list_schema(described({{"type", "number"}, {"exclusiveMinimum", -1}, {"exclusiveMaximum", 1}, {"default", 0}},
                                   "mean cosine of the Henyey-Greenstein phase function"));
  properties["emission"] = {
      {"anyOf",
       {one_or_list_schema(number),
        closed_object({{"radiance", one_or_list_schema(number)}, {"field", described(reference("medium"), "scales it in space")}},
                      {"radiance"})}},
      {"description", "radiance L_e: a ray gains mu_a L_e per unit length"}};
  properties["optional"] = {{"type", "boolean"}, {"default", false}};
}

/// Every registered type of a kind, as {"type": ...} with its parameters, swept where given as lists.
Json component_schema(ComponentKind kind) {
  Json names = Json::array(), alternatives = Json::array();
  for (const ComponentInfo& entry : registered(kind)) {
    names.push_back(entry.name);
    Json properties = {{"type", {{"const", entry.name}}}};
    for (const ParameterInfo& parameter : parameters_of(kind, entry.name)) {
      const Json own = parameter_schema(parameter);
      properties[parameter.name] = described(one_or_list_schema(own), own["description"].get<std::string>());
    }
    if (kind == ComponentKind::medium) {
      properties["spectrum"] = one_or_list_schema(list_of({{"type", "number"}, {"minimum", 0}}, 1));
      add_matter_schema(properties);
    }
    alternatives.push_back(described(closed_object(std::move(properties), {"type"}), entry.summary));
  }
  if (kind == ComponentKind::medium)
    for (const auto& [type, text] : {std::pair{"channels", "one grey medium per channel"}, {"sum", "the sum of grey media"}}) {
      Json properties = {{"type", {{"const", type}}}, {"media", list_of(reference("medium"), 1)}};
      add_matter_schema(properties);
      alternatives.push_back(described(closed_object(std::move(properties), {"type", "media"}), text));
    }
  Json any = {{{"enum", std::move(names)}}};
  for (Json& alternative : alternatives) any.push_back(std::move(alternative));
  return {{"anyOf", std::move(any)}};
}

/// A partial specification: type and any parameters.
Json pattern_schema() {
  const Json one = {{"anyOf", {{{"type", "string"}}, {{"type", "object"}, {"required", {"type"}}}}}};
  return one_or_list_schema(one);
}

/// Keys of an experiment, and the objects that experiments, tables and claims choose cells with.
Json cell_definitions() {
  Json cell = Json::object(), matrix = Json::object(), pattern = Json::object();
  for (const Axis& axis : axes()) {
    cell[axis.name] = axis.schema;
    matrix[axis.name] = one_or_list_schema(axis.schema);
    pattern[axis.name] = axis.partial ? pattern_schema() : one_or_list_schema(axis.schema);
  }
  for (const SharedKey& key : shared_keys()) cell[key.name] = key.schema;
  Json experiment = cell;
  experiment["name"] = {{"type", "string"}, {"minLength", 1}};
  experiment["matrix"] = described(closed_object(std::move(matrix)), "axes; every combination is a cell");
  experiment["zip"] = described(list_of(list_of({{"type", "string"}}, 1)), "axes that advance together");
  experiment["exclude"] = list_of(reference("pattern"));
  experiment["include"] = list_of(reference("cell"));
  experiment["constraints"] =
      list_of(closed_object({{"if", reference("pattern")}, {"then", reference("pattern")}}, {"if", "then"}));
  Json selector = pattern;
  selector["experiment"] = selector["cell"] = {{"type", "string"}};
  return {{"cells", described(closed_object(Json(selector)), "matches at least one cell")},
          {"cell", closed_object(std::move(cell))},
          {"pattern", closed_object(std::move(pattern))},
          {"selector", described(closed_object(std::move(selector)), "matches exactly one cell")},
          {"experiment", closed_object(std::move(experiment), {"name"})}};
}

Json table_schema() {
  const Json row =
      closed_object({{"label", {{"type", "string"}}},
                     {"given", {{"type", "object"}, {"additionalProperties", {{"type", "number"}}}}},
                     {"cells", {{"type", "object"}, {"additionalProperties", reference("selector")}}},
                     {"theory", reference("selector")},
                     {"relative_to", described(reference("selector"), "the row's metric is divided by that of this cell")},
                     {"note", {{"type", "string"}}}},
                    {"label"});
  return closed_object(
      {{"title", {{"type", "string"}}}, {"metric", {{"enum", metric_names()}, {"default", "rmse"}}}, {"rows", list_of(row)}},
      {"title", "rows"});
}

Json claim_schema() {
  const Json metric = {{"enum", metric_names()}};
  const Json compared = {
      {"anyOf",
       {{{"type", "number"}}, list_of({{"type", "number"}}, 1), {{"const", "theory"}}, one_or_list_schema(reference("cells"))}}};
  const Json part = closed_object(
      {{"says", described({{"type", "string"}}, "this part of the claim in words")},
       {"metric", {{"enum", claimable_metric_names()}}},
       {"cells", one_or_list_schema(reference("cells"))},
       {"near", described(compared, "a number, one for each cell, \"theory\" of each cell, or the same metric of a counterpart")},
       {"at_most", compared},
       {"at_least", compared},
       {"unbiased", described({{"const", true}}, "the verdict of every cell is PASS")},
       {"factor", described({{"type", "number"}}, "multiplies what is compared with")},
       {"tolerance", described(positive_schema(), "relative, of \"near\"")},
       {"slope_against", described(metric, "compare the slope of log metric over the log of this one")}},
      {"cells"});
  return closed_object({{"id", {{"type", "string"}}},
                        {"source", described({{"type", "string"}}, "paper and place, or the equation")},
                        {"claim", {{"type", "string"}}},
                        {"note", described({{"type", "string"}}, "how the test differs from the publication")},
                        {"required", described({{"type", "boolean"}, {"default", false}},
                                               "check fails if it is refuted, and is inconclusive if it cannot be told")},
                        {"parts", list_of(part, 1)}},
                       {"id", "source", "claim", "parts"});
}

Json definitions() {
  Json json = cell_definitions();
  json["estimator"] = component_schema(ComponentKind::estimator);
  json["medium"] = component_schema(ComponentKind::medium);
  json["majorant"] = component_schema(ComponentKind::majorant);
  json["rays"] = component_schema(ComponentKind::ray_set);
  json["table"] = table_schema();
  json["claim"] = claim_schema();
  return json;
}

}  // namespace

Json parameter_schema(const ParameterInfo& parameter) {
  Json json;
  switch (parameter.default_value.index()) {
    case 0:
      json = range_schema(parameter.range);
      break;
    case 1:
      json = {{"type", "integer"}, {"minimum", parameter.low}, {"maximum", parameter.high}};
      break;
    case 2:
      json = {{"type", "boolean"}};
      break;
    case 3:
      json = {{"type", parameter.object ? Json{"object", "string"} : Json("string")}};
      break;
    case 6:
      json = list_of({{"type", "string"}}, 1);
      break;
    case 4:
      json = list_of(range_schema(parameter.range), parameter.least);
      json["maxItems"] = parameter.most;
      break;
    default:
      json = list_of({{"type", "number"}}, 3);
      json["maxItems"] = 3;
  }
  if (!parameter.allowed.empty()) json["enum"] = parameter.allowed;
  std::visit([&](const auto& value) { json["default"] = value; }, parameter.default_value);
  return described(std::move(json),
                   parameter.unit.empty() ? parameter.text : fmt::format("{} [{}]", parameter.text, parameter.unit));
}

Json config_schema() {
  Json json = {{"$schema", kDraft}, {"title", "nullmark configuration"}};
  json.update(closed_object({{"$schema", {{"type", "string"}}},
                             {kVersionKey, {{"const", kConfigVersion}}},
                             {"name", {{"type", "string"}}},
                             {"seed", {{"type", "integer"}, {"minimum", 0}, {"default", 1}}},
                             {"timing", closed_schema<TimingPlan>()},
                             {"error_rates", closed_schema<ErrorRates>()},
                             {"experiments", list_of(reference("experiment"), 1)},
                             {"tables", list_of(reference("table"))},
                             {"claims", list_of(reference("claim"))},
                             {"credits", described({{"type", "object"}, {"additionalProperties", {{"type", "string"}}}},
                                                   "author and licence, by a data file's name")}},
                            {kVersionKey, "experiments"}));
  json["definitions"] = definitions();
  return json;
}

Json results_schema() {
  Json json = {{"$schema", kDraft}, {"title", "nullmark results"}};
  json.update(Json{{"type", "object"},
                   {"properties",
                    {{kVersionKey, {{"const", RunRecord::kVersion}}},
                     {"name", {{"type", "string"}}},
                     {"config_hash", {{"type", "string"}}},
                     {"config", {{"type", {"object", "null"}}, {"description", "as applied: every cell is named"}}},
                     {"provenance", {{"type", "object"}}},
                     {"cells", list_of(cell_schema())},
                     {"tables", list_of({{"type", "object"}})},
                     {"claims", list_of({{"type", "object"}})}}},
                   {"required", {kVersionKey, "name", "config", "provenance", "cells"}}});
  return json;
}

}  // namespace nullmark
