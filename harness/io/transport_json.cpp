#include "harness/io/transport_json.h"

#include <fmt/format.h>

#include <cmath>

#include "harness/registry/components.h"

namespace nullmark {
namespace {

const std::vector<std::string> kShapes = {"plane", "box", "sphere"}, kNextEvent = {"off", "phase", "uniform"},
                               kKernels = {"own", "general"};

std::array<Real, 3> read_point(const JsonNode& node) {
  if (!node.json().is_array() || node.json().size() != 3) node.expected("a list of 3 numbers");
  return {node[std::size_t{0}].number(), node[1].number(), node[2].number()};
}

/// The keys of a shape's two points.
std::pair<const char*, const char*> point_keys(const std::string& type) {
  if (type == "box") return {"low", "high"};
  return type == "sphere" ? std::pair{"center", "radius"} : std::pair{"point", "normal"};
}

SurfaceSpec read_surface(const JsonNode& node) {
  node.expect_object();
  SurfaceSpec surface;
  surface.type = node["type"].one_of(kShapes, "surface");
  const auto [first, second] = point_keys(surface.type);
  node.expect_keys({"type", first, second, "radiance"});
  surface.point = read_point(node[first]);
  if (surface.type == "sphere") {
    surface.radius = node["radius"].number();
    if (!(surface.radius > 0)) node["radius"].expected("a radius above 0");
  } else {
    surface.direction = read_point(node[second]);
  }
  if (surface.type == "plane" && surface.direction == std::array<Real, 3>{}) node["normal"].expected("a normal that is not 0");
  for (std::size_t axis = 0; axis < 3 && surface.type == "box"; ++axis)
    if (!(surface.point[axis] < surface.direction[axis])) node["high"].expected("a corner above \"low\" along every axis");
  if (node.has("radiance")) surface.radiance = read_per_channel(node["radiance"], kInfinity);
  return surface;
}

Json surface_json(const SurfaceSpec& surface) {
  const auto [first, second] = point_keys(surface.type);
  Json json = {{"type", surface.type}, {first, surface.point}};
  if (surface.type == "sphere")
    json[second] = surface.radius;
  else
    json[second] = surface.direction;
  json["radiance"] = surface.radiance;
  return json;
}

}  // namespace

std::vector<Real> read_per_channel(const JsonNode& node, Real most) {
  std::vector<Real> values;
  for (const JsonNode& element : node.elements_or_self()) {
    const Real value = element.number();
    if (!(value >= 0 && value <= most) || !std::isfinite(value))
      element.expected(std::isfinite(most) ? fmt::format("a number from 0 to {}", most) : "a finite number >= 0");
    values.push_back(value);
  }
  if (values.size() > kMaxChannels) node.expected(fmt::format("one number, or one per channel, at most {}", kMaxChannels));
  return values;
}

TransportSpec read_transport(const JsonNode& node) {
  node.expect_keys({"environment", "surfaces", "next_event", "roulette_from", "roulette_floor", "most_scatterings", "kernel"});
  TransportSpec transport;
  if (node.has("environment")) transport.environment = read_per_channel(node["environment"], kInfinity);
  if (node.has("surfaces"))
    for (const JsonNode& surface : node["surfaces"].elements()) transport.surfaces.push_back(read_surface(surface));
  if (node.has("next_event")) transport.next_event = node["next_event"].one_of(kNextEvent, "next_event");
  const auto count = [&](const char* key, std::optional<int>& value) {
    if (!node.has(key)) return;
    value.reset();
    if (!node[key].json().is_null()) value = static_cast<int>(node[key].integer(0, 1'000'000));
  };
  count("roulette_from", transport.roulette_from);
  count("most_scatterings", transport.most_scatterings);
  if (node.has("roulette_floor")) {
    transport.roulette_floor = node["roulette_floor"].number();
    if (!(transport.roulette_floor > 0 && transport.roulette_floor <= 1)) node["roulette_floor"].expected("a number in (0, 1]");
  }
  if (node.has("kernel")) transport.general = node["kernel"].one_of(kKernels, "kernel") == "general";
  return transport;
}

Json transport_json(const TransportSpec& transport) {
  const auto count = [](const std::optional<int>& value) { return value ? Json(*value) : Json(nullptr); };
  Json surfaces = Json::array();
  for (const SurfaceSpec& surface : transport.surfaces) surfaces.push_back(surface_json(surface));
  return {{"environment", transport.environment},       {"surfaces", std::move(surfaces)},
          {"next_event", transport.next_event},         {"roulette_from", count(transport.roulette_from)},
          {"roulette_floor", transport.roulette_floor}, {"most_scatterings", count(transport.most_scatterings)},
          {"kernel", kKernels[transport.general]}};
}

std::string transport_label(const TransportSpec& transport) {
  const Json defaults = transport_json({}), own = transport_json(transport);
  std::string label;
  for (const auto& [key, value] : own.items()) {
    if (value == defaults[key]) continue;
    std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    if (key == "surfaces") {
      text.clear();
      for (const SurfaceSpec& surface : transport.surfaces) text += (text.empty() ? "" : ",") + surface.type;
    }
    if (key == "environment") text = to_text(transport.environment);
    label += fmt::format("{}{}:{}", label.empty() ? "" : "/", key, text);
  }
  return label;
}

Json transport_schema() {
  const Json radiance = {{"anyOf",
                          {{{"type", "number"}, {"minimum", 0}},
                           {{"type", "array"}, {"items", {{"type", "number"}, {"minimum", 0}}}, {"maxItems", kMaxChannels}}}},
                         {"description", "one number for all channels, or one each"}};
  const Json point = {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 3}, {"maxItems", 3}};
  const auto shape = [&](const char* type, Json properties, const std::vector<std::string>& required) {
    properties["type"] = {{"const", type}};
    properties["radiance"] = radiance;
    return Json{{"type", "object"},
                {"properties", std::move(properties)},
                {"required", required},
                {"additionalProperties", false},
                {"patternProperties", {{"^x-", Json::object()}}}};
  };
  const Json count = {{"type", {"integer", "null"}}, {"minimum", 0}};
  return {{"type", "object"},
          {"description", "the scene around the medium, and how paths are sampled"},
          {"properties",
           {{"environment", radiance},
            {"surfaces",
             {{"type", "array"},
              {"items",
               {{"anyOf",
                 {shape("plane", {{"point", point}, {"normal", point}}, {"type", "point", "normal"}),
                  shape("box", {{"low", point}, {"high", point}}, {"type", "low", "high"}),
                  shape("sphere", {{"center", point}, {"radius", {{"type", "number"}, {"exclusiveMinimum", 0}}}},
                        {"type", "center", "radius"})}}}}}},
            {"next_event", {{"enum", kNextEvent}, {"default", "off"}}},
            {"roulette_from", count},
            {"roulette_floor", {{"type", "number"}, {"exclusiveMinimum", 0}, {"maximum", 1}, {"default", 0.05}}},
            {"most_scatterings", count},
            {"kernel", {{"enum", kKernels}, {"default", "own"}}}}},
          {"additionalProperties", false},
          {"patternProperties", {{"^x-", Json::object()}}}};
}

}  // namespace nullmark
