#include "harness/config/schema.h"

#include <fmt/format.h>

#include <cmath>

#include "harness/io/results_json.h"
#include "harness/io/spec_json.h"
#include "harness/io/transport_json.h"
#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/model/record.h"

namespace nullmark {
namespace {

constexpr const char* kDraft = "http://json-schema.org/draft-07/schema#";

Json reference(const std::string& name) { return {{"$ref", "#/definitions/" + name}}; }

Json list_of(Json item, int least = 0) {
  Json json = {{"type", "array"}, {"items", std::move(item)}};
  if (least > 0) json["minItems"] = least;
  return json;
}

Json one_or_list(const Json& item) { return {{"anyOf", {item, list_of(item, 1)}}}; }

/// An object without keys of its own making, but for comments.
Json closed_object(Json properties, const std::vector<std::string>& required = {}) {
  Json json = {{"type", "object"},
               {"properties", std::move(properties)},
               {"patternProperties", {{"^x-", Json::object()}}},
               {"additionalProperties", false}};
  if (!required.empty()) json["required"] = required;
  return json;
}

Json whole(std::uint64_t low) { return {{"type", "integer"}, {"minimum", low}}; }
Json positive() { return {{"type", "number"}, {"exclusiveMinimum", 0}}; }

Json described(Json json, const std::string& text) {
  json["description"] = text;
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
  const Json albedo = one_or_list(Json{{"type", "number"}, {"minimum", 0}, {"maximum", 1}});
  properties["albedo"] = described(one_or_list(albedo), "mu_s / mu, one for all channels or one each");
  properties["anisotropy"] =
      one_or_list(described({{"type", "number"}, {"exclusiveMinimum", -1}, {"exclusiveMaximum", 1}, {"default", 0}},
                            "mean cosine of the Henyey-Greenstein phase function"));
  properties["emission"] = {
      {"anyOf",
       {one_or_list(number),
        closed_object({{"radiance", one_or_list(number)}, {"field", described(reference("medium"), "scales it in space")}},
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
      properties[parameter.name] = described(one_or_list(own), own["description"].get<std::string>());
    }
    if (kind == ComponentKind::medium) {
      properties["spectrum"] = one_or_list(list_of({{"type", "number"}, {"minimum", 0}}, 1));
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
  return one_or_list(one);
}

Json definitions() {
  const Json quantity = {{"enum", quantity_names()}};
  const Json measurement =
      closed_object({{"clamp", described({{"type", "boolean"}, {"default", false}}, "every sample to [0,1]")},
                     {"quantise_bits", described({{"type", "integer"}, {"minimum", 0}, {"maximum", 31}, {"default", 0}},
                                                 "every sample to the nearest multiple of 1/(2^n - 1); 0: not at all")}});
  const Json axes = {{"estimator", reference("estimator")},
                     {"medium", reference("medium")},
                     {"majorant", described(reference("majorant"), "default: \"global\"")},
                     {"rays", reference("rays")},
                     {"quantity", quantity},
                     {"samples_per_ray", whole(1)},
                     {"equal_lookups", described(positive(), "samples_per_ray = this / (expected lookups per sample)")},
                     {"seed", whole(0)},
                     {"precision", described({{"enum", precision_names()}}, "precision of walks; default: \"double\"")},
                     {"measurement", measurement},
                     {"transport", transport_schema()}};
  Json cell = axes, matrix = Json::object(), pattern = Json::object();
  for (const auto& [axis, schema] : axes.items()) {
    matrix[axis] = one_or_list(schema);
    const bool component = axis == "estimator" || axis == "medium" || axis == "majorant" || axis == "rays";
    pattern[axis] = component ? pattern_schema() : one_or_list(schema);
  }
  cell["images"] = {{"type", "boolean"}, {"default", false}};
  cell["image_maximum"] = described(positive(), "value shown as white");
  cell["verdict"] = described(
      closed_object(
          {{"enabled", {{"type", "boolean"}, {"default", true}}},
           {"epsilon", described(positive(), "a PASS proves |bias| below this; relative to the mean reference")},
           {"max_samples_per_ray", described(whole(0),
                                             "drawn while the verdict is open; 0: samples_per_ray, and up to four times as many "
                                             "if the plan says that they suffice")},
           {"max_lookups_per_ray", described(positive(), "expected lookups that all samples of a ray may cost")},
           {"laws", described({{"enum", law_policies()}},
                              "when the laws of walks are tested; undecided: only if the mean cannot be decided")},
           {"tolerate", described({{"enum", tolerances()}},
                                  "nothing: any proven bias is a FAIL; epsilon: only a bias proven beyond epsilon is")},
           {"samples", described({{"enum", sample_policies()}},
                                 "planned: an undecided cell draws no more if the plan says that its allowance does not suffice; "
                                 "all: it draws its whole allowance")}}),
      "what the verdict must prove and may cost");
  cell["reference"] = described(closed_object({{"value", one_or_list(Json{{"type", "number"}})},
                                               {"error", {{"type", "number"}, {"minimum", 0}}},
                                               {"source", {{"type", "string"}}}},
                                              {"value", "error", "source"}),
                                "a mean computed elsewhere, with a relative bound on its error");
  cell["own_streams"] = described({{"type", "boolean"}, {"default", false}},
                                  "random streams depend on the estimator, instead of common random numbers");
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
  const Json row = closed_object(
      {{"label", {{"type", "string"}}},
       {"given", {{"type", "object"}, {"additionalProperties", {{"type", "number"}}}}},
       {"cells", {{"type", "object"}, {"additionalProperties", reference("selector")}}},
       {"theory", reference("selector")},
       {"relative_to", described(reference("selector"), "the row's metric is divided by that of this cell")},
       {"tolerance", described(positive(), "relative; check fails if a cell is farther from the first given number")},
       {"note", {{"type", "string"}}}},
      {"label"});
  const Json metric = {{"enum", metric_names()}};
  const Json compared = {
      {"anyOf",
       {{{"type", "number"}}, list_of({{"type", "number"}}, 1), {{"const", "theory"}}, one_or_list(reference("cells"))}}};
  const Json part = closed_object(
      {{"says", described({{"type", "string"}}, "this part of the claim in words")},
       {"metric", {{"enum", claimable_metric_names()}}},
       {"cells", one_or_list(reference("cells"))},
       {"near", described(compared, "a number, one for each cell, \"theory\" of each cell, or the same metric of a counterpart")},
       {"at_most", compared},
       {"at_least", compared},
       {"unbiased", described({{"const", true}}, "the verdict of every cell is PASS")},
       {"factor", described({{"type", "number"}}, "multiplies what is compared with")},
       {"tolerance", described(positive(), "relative, of \"near\"")},
       {"slope_against", described(metric, "compare the slope of log metric over the log of this one")}},
      {"cells"});
  const Json claim = closed_object({{"id", {{"type", "string"}}},
                                    {"source", described({{"type", "string"}}, "paper and place")},
                                    {"claim", {{"type", "string"}}},
                                    {"note", described({{"type", "string"}}, "how the test differs from the publication")},
                                    {"parts", list_of(part, 1)}},
                                   {"id", "source", "claim", "parts"});
  return {{"claim", claim},
          {"cells", described(closed_object(Json(selector)), "matches at least one cell")},
          {"estimator", component_schema(ComponentKind::estimator)},
          {"medium", component_schema(ComponentKind::medium)},
          {"majorant", component_schema(ComponentKind::majorant)},
          {"rays", component_schema(ComponentKind::ray_set)},
          {"cell", closed_object(std::move(cell))},
          {"pattern", closed_object(std::move(pattern))},
          {"selector", described(closed_object(std::move(selector)), "matches exactly one cell")},
          {"experiment", closed_object(std::move(experiment), {"name"})},
          {"table", closed_object({{"title", {{"type", "string"}}},
                                   {"metric", {{"enum", metric_names()}, {"default", "rmse"}}},
                                   {"rows", list_of(row)}},
                                  {"title", "rows"})}};
}

Json typed_schema() {
  return {{"type", "object"},
          {"properties", {{"type", {{"type", "string"}}}, {"params", {{"type", "object"}}}, {"label", {{"type", "string"}}}}},
          {"required", {"type", "params", "label"}}};
}

Json majorant_schema() {
  Json json = typed_schema();
  json["properties"].update(Json{{"cells", described(whole(1), "regions with their own bounds")},
                                 {"nodes", described(whole(0), "of a tree, leaves included; 0: no tree")},
                                 {"bytes", described(whole(0), "of memory")}});
  return json;
}

Json nullable(const char* type) { return {{"type", {type, "null"}}}; }

/// A number, a list of one per channel, or null.
Json statistic(const std::string& text) {
  return {{"type", {"number", "array", "null"}}, {"items", nullable("number")}, {"description", text}};
}

Json object_schema(Json properties, std::vector<std::string> required) {
  return {{"type", "object"}, {"properties", std::move(properties)}, {"required", std::move(required)}};
}

Json cell_schema() {
  const Json text = {{"type", "string"}};
  return object_schema(
      {{"id",
        {{"type", "string"},
         {"pattern", "^[0-9a-f]{16}$"},
         {"description", "hash of everything that determines the statistics"}}},
       {"name", text},
       {"experiment", text},
       {"estimator", typed_schema()},
       {"medium", typed_schema()},
       {"majorant", majorant_schema()},
       {"ray_set", typed_schema()},
       {"quantity", {{"enum", quantity_names()}}},
       {"precision", {{"enum", precision_names()}}},
       {"channels", {{"type", "integer"}, {"minimum", 1}, {"maximum", kMaxChannels}}},
       {"outputs", described(list_of(text), "names of the entries of the statistics, if they are not channels")},
       {"effects", list_of(text)},
       {"rays", whole(0)},
       {"samples_per_ray", whole(0)},
       {"equal_lookups", positive()},
       {"samples", described(whole(0), "over all rays")},
       {"seed", whole(0)},
       {"own_streams", {{"type", "boolean"}}},
       {"measurement", {{"type", "object"}, {"required", {"clamp", "quantise_bits"}}}},
       {"transport", {{"type", "object"}}},
       {"status",
        {{"enum", {to_string(Status::ok), to_string(Status::skipped), to_string(Status::not_run), to_string(Status::error)}}}},
       {"reason", text},
       {"reliance", described(nullable("number"),
                              "of an estimator that is handed the exact optical depth: how much of its answer "
                              "follows that depth, 1 all of it")},
       {"mean", statistic("average over the rays")},
       {"reference", object_schema({{"value", statistic("average over the rays")},
                                    {"error", statistic("bound on the reference's own error")},
                                    {"rms", statistic("root mean square over the rays")},
                                    {"method", text}},
                                   {"value", "error", "method"})},
       {"bias", statistic("mean - reference")},
       {"bias_theory", statistic("mean that the estimator predicts - reference")},
       {"rmse", statistic("root mean square error of the rays' means")},
       {"rmse_theory", statistic("what theory predicts for rmse")},
       {"variance", statistic("per sample, averaged over the rays")},
       {"variance_theory", statistic("what theory predicts for variance")},
       {"variance_basis", {{"enum", {"analytic", "sample", ""}}}},
       {"relative_variance", statistic("variance, analytic where known, over the mean square of the reference")},
       {"kurtosis", statistic("of the errors around the reference, pooled")},
       {"lookups_per_sample", nullable("number")},
       {"lookups_theory", nullable("number")},
       {"null_collisions_per_sample", nullable("number")},
       {"rng_draws_per_sample", nullable("number")},
       {"lookups", described(whole(0), "over all samples")},
       {"rng_draws", described(whole(0), "over all samples")},
       {"squared_error_blocks", described(list_of(nullable("number")),
                                          "mean squared error of 16 disjoint parts of the samples, cut alike for all "
                                          "estimators; averaged over channels")},
       {"lookups_variance", described(nullable("number"), "of one sample's lookups, averaged over the rays")},
       {"instructions", described(whole(0), "instructions of drawing all samples, counted in a simulator")},
       {"majorant_violations", whole(0)},
       {"largest_violation", described(nullable("number"), "extinction over majorant, where above 1")},
       {"largest_sample", described(nullable("number"), "greatest absolute value of a finite sample, before any measurement")},
       {"nonfinite", whole(0)},
       {"verdict",
        {{"type", {"object", "null"}}, {"description", "evidence for and against the claims; see harness/verdict/verdict.md"}}},
       {"time",
        {{"type", {"object", "null"}},
         {"description", "nanoseconds unless the key says otherwise"},
         {"properties",
          {{"waiting", described(nullable("number"), "share of the wall time in which the timed thread did not run")}}}}},
       {"efficiency", object_schema({{"variance_x_lookups", statistic("lower is better")}}, {"variance_x_lookups"})},
       {"convergence", list_of(object_schema({{"samples", whole(1)},
                                              {"rmse", statistic("of means of so many samples")},
                                              {"variance", statistic("of means of so many samples")}},
                                             {"samples", "rmse", "variance"}))},
       {"image_maximum", nullable("number")},
       {"images", {{"type", "object"}, {"additionalProperties", text}}}},
      {"id",        "name",     "experiment",  "estimator",   "medium", "majorant",
       "ray_set",   "quantity", "channels",    "effects",     "rays",   "samples_per_ray",
       "samples",   "seed",     "own_streams", "measurement", "status", "mean",
       "reference", "bias",     "rmse",        "variance",    "time",   "efficiency"});
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
      json = {{"type", "string"}};
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
  json.update(closed_object(
      {{"$schema", {{"type", "string"}}},
       {kVersionKey, {{"const", kConfigVersion}}},
       {"name", {{"type", "string"}}},
       {"seed", {{"type", "integer"}, {"minimum", 0}, {"default", 1}}},
       {"timing",
        closed_object(
            {{"enabled", {{"type", "boolean"}, {"default", TimingPlan{}.enabled}}},
             {"repetitions", {{"type", "integer"}, {"minimum", 1}, {"maximum", 10'000}, {"default", TimingPlan{}.repetitions}}},
             {"seconds", described(positive(), "minimum time of one repetition")},
             {"samples_per_traversal",
              described({{"anyOf", {whole(1), list_of(whole(1), 1)}}},
                        "samples that share one walk through the majorant structure; of an ascending list the last is what a "
                        "cell's time says")}})},
       {"error_rates",
        closed_object({{"alpha", described(positive(), "chance of even one false FAIL in the whole configuration")},
                       {"alpha_pass", described(positive(), "chance of a false PASS of one test")}})},
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
  json.update(object_schema({{kVersionKey, {{"const", RunRecord::kVersion}}},
                             {"name", {{"type", "string"}}},
                             {"config_hash", {{"type", "string"}}},
                             {"config", {{"type", {"object", "null"}}, {"description", "as applied: every cell is named"}}},
                             {"provenance", {{"type", "object"}}},
                             {"cells", list_of(cell_schema())},
                             {"tables", list_of({{"type", "object"}})},
                             {"claims", list_of({{"type", "object"}})}},
                            {kVersionKey, "name", "config", "provenance", "cells"}));
  return json;
}

}  // namespace nullmark
