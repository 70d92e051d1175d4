#include "harness/io/transport_json.h"

#include <fmt/format.h>

#include <cmath>

#include "harness/io/fields.h"
#include "harness/registry/components.h"

namespace nullmark {
namespace {

const std::vector<std::string> kShapes = {"plane", "box", "sphere"}, kNextEvent = {"off", "phase", "uniform", "mis"},
                               kKernels = {"own", "general"};

/// Three numbers.
struct PointField {
  std::array<Real, 3>& value;

  Json json() const { return value; }
  void read(const JsonNode& node) const {
    if (!node.json().is_array() || node.json().size() != 3) node.expected("a list of 3 numbers");
    for (std::size_t axis = 0; axis < 3; ++axis) value[axis] = node[axis].number();
  }
  Json schema() const { return {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 3}, {"maxItems", 3}}; }
};

/// A radiance: one number for all channels, or one each.
struct RadianceField {
  std::vector<Real>& value;

  Json json() const { return value; }
  void read(const JsonNode& node) const { value = read_per_channel(node, kInfinity); }
  Json schema() const {
    const Json number = {{"type", "number"}, {"minimum", 0}};
    return {{"anyOf", {number, {{"type", "array"}, {"items", number}, {"maxItems", kMaxChannels}}}},
            {"description", "one number for all channels, or one each"}};
  }
};

/// A number of scatterings; null: none is the limit.
struct LimitField {
  std::optional<int>& value;

  Json json() const { return value ? Json(*value) : Json(nullptr); }
  void read(const JsonNode& node) const {
    value.reset();
    if (!node.json().is_null()) value = static_cast<int>(node.integer(0, 1'000'000));
  }
  Json schema() const { return {{"type", {"integer", "null"}}, {"minimum", 0}}; }
};

/// A number above 0 and at most 1.
struct ShareField {
  Real& value;

  Json json() const { return value; }
  void read(const JsonNode& node) const {
    value = node.number();
    if (!(value > 0 && value <= 1)) node.expected("a number in (0, 1]");
  }
  Json schema() const { return {{"type", "number"}, {"exclusiveMinimum", 0}, {"maximum", 1}}; }
};

}  // namespace

template <class Visit>
void visit_fields(Visit& visit, SurfaceSpec& surface) {
  visit.required("type", WordField{surface.type, kShapes, "surface"});
  const bool box = surface.type == "box", sphere = surface.type == "sphere";
  visit.required(box ? "low" : sphere ? "center" : "point", PointField{surface.point});
  if (sphere)
    visit.required("radius", PositiveField{surface.radius});
  else
    visit.required(box ? "high" : "normal", PointField{surface.direction});
  visit.lenient("radiance", RadianceField{surface.radiance});
}

namespace {

SurfaceSpec surface_of_type(const std::string& type) {
  SurfaceSpec surface;
  surface.type = type;
  return surface;
}

SurfaceSpec read_surface(const JsonNode& node) {
  node.expect_object();
  const SurfaceSpec surface = read_closed(node, surface_of_type(node["type"].one_of(kShapes, "surface")));
  if (surface.type == "plane" && surface.direction == std::array<Real, 3>{}) node["normal"].expected("a normal that is not 0");
  for (std::size_t axis = 0; axis < 3 && surface.type == "box"; ++axis)
    if (!(surface.point[axis] < surface.direction[axis])) node["high"].expected("a corner above \"low\" along every axis");
  return surface;
}

struct SurfacesField {
  std::vector<SurfaceSpec>& value;

  Json json() const {
    Json list = Json::array();
    for (const SurfaceSpec& surface : value) list.push_back(fields_json(surface));
    return list;
  }
  void read(const JsonNode& node) const {
    for (const JsonNode& surface : node.elements()) value.push_back(read_surface(surface));
  }
  Json schema() const {
    Json shapes = Json::array();
    for (const std::string& type : kShapes) {
      shapes.push_back(closed_schema(surface_of_type(type)));
      shapes.back()["properties"]["type"] = {{"const", type}};
    }
    return list_schema({{"anyOf", std::move(shapes)}});
  }
};

}  // namespace

template <class Visit>
void visit_fields(Visit& visit, TransportSpec& transport) {
  visit.lenient("environment", RadianceField{transport.environment});
  visit.lenient("surfaces", SurfacesField{transport.surfaces});
  visit.lenient("next_event", WordField{transport.next_event, kNextEvent, "next_event"});
  visit.lenient("roulette_from", LimitField{transport.roulette_from});
  visit.lenient("roulette_floor", ShareField{transport.roulette_floor});
  visit.lenient("most_scatterings", LimitField{transport.most_scatterings});
  visit.lenient("kernel", FlagWordField{transport.general, kKernels, "kernel"});
}

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

TransportSpec read_transport(const JsonNode& node) { return read_closed<TransportSpec>(node); }

Json transport_json(const TransportSpec& transport) { return fields_json(transport); }

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
  return described(closed_schema<TransportSpec>(), "the scene around the medium, and how paths are sampled");
}

}  // namespace nullmark
