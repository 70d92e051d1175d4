#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/io/spec_fields.h"
#include "harness/io/spec_json.h"
#include "harness/io/transport_json.h"
#include "harness/registry/components.h"

/// Components, media and what belongs to them as records hold them: as fields of a visitor (fields.h).
namespace nullmark {

/// A parameter of a registered type, by its JSON value.
ParameterValue read_parameter(ComponentKind kind, const std::string& type, const std::string& name, const JsonNode& node);

/// The parameters of a registered type.
struct ParametersField {
  Component& component;
  ComponentKind kind;

  Json json() const { return parameters_json(component.values); }
  void read(const JsonNode& node) const {
    node.expect_object();
    for (const auto& [name, json] : node.json().items())
      component.values[name] = read_parameter(kind, component.type, name, node[name]);
  }
  Json schema() const { return {{"type", "object"}}; }
};

template <class Visit>
void visit_component(Visit& visit, Component& component, ComponentKind kind, std::string& label) {
  visit.required("type", component.type);
  visit.required("params", ParametersField{component, kind});
  visit.required("label", label);
  if constexpr (Visit::kReads) component.pointer = visit.node().where();
}

struct ComponentField {
  Component& component;
  ComponentKind kind;

  Json json() const {
    FieldWriter visit;
    visit_component(visit, component, kind, component.label);
    return visit.take();
  }
  void read(const JsonNode& node) const {
    FieldReader visit(node);
    visit_component(visit, component, kind, component.label);
  }
  Json schema() const {
    FieldSchema visit(false);
    visit_component(visit, component, kind, component.label);
    return visit.take();
  }
};

struct OptionalEstimatorField {
  std::optional<Shared<Component>>& component;

  bool empty() const { return !component; }
  Json json() const {
    Component copy = **component;
    return ComponentField{copy, ComponentKind::estimator}.json();
  }
  void read(const JsonNode& node) const {
    Component value;
    ComponentField{value, ComponentKind::estimator}.read(node);
    component.emplace(std::move(value));
  }
  Json schema() const {
    Component any;
    return ComponentField{any, ComponentKind::estimator}.schema();
  }
};

Json medium_record_json(const MediumSpec& medium);
MediumSpec read_medium_record(const JsonNode& node);

struct MediaField {
  std::vector<MediumSpec>& media;

  bool empty() const { return media.empty(); }
  Json json() const {
    Json list = Json::array();
    for (const MediumSpec& medium : media) list.push_back(medium_record_json(medium));
    return list;
  }
  void read(const JsonNode& node) const {
    for (const JsonNode& medium : node.elements()) media.push_back(read_medium_record(medium));
  }
  Json schema() const { return list_schema({{"type", "object"}}); }
};

/// Numbers from 0 to `most`, one for all channels or one each.
struct PerChannelField {
  std::vector<Real>& values;
  Real most;

  bool empty() const { return values.empty(); }
  Json json() const { return values; }
  void read(const JsonNode& node) const { values = read_per_channel(node, most); }
  Json schema() const { return list_schema({{"type", "number"}, {"minimum", 0}}); }
};

/// {"radiance": ..., "field": ...}
struct EmissionField {
  MediumSpec& medium;

  bool empty() const { return medium.emission.empty(); }
  Json json() const {
    Json json = {{"radiance", medium.emission}};
    if (!medium.emission_field.empty()) json["field"] = medium_record_json(medium.emission_field[0]);
    return json;
  }
  void read(const JsonNode& node) const {
    medium.emission = read_per_channel(node["radiance"], kInfinity);
    if (node.has("field")) medium.emission_field.push_back(read_medium_record(node["field"]));
  }
  Json schema() const { return {{"type", "object"}}; }
};

template <class Visit>
void visit_fields(Visit& visit, MediumSpec& medium) {
  visit_component(visit, medium.field, ComponentKind::medium, medium.label);
  if constexpr (Visit::kReads) medium.field.label = medium.label;
  visit.sparse("spectrum", medium.spectrum);
  visit.sparse("media", MediaField{medium.per_channel});
  visit.sparse("albedo", PerChannelField{medium.albedo, 1});
  visit.sparse("albedo_field", MediaField{medium.albedo_field});
  visit.sparse("anisotropy", medium.anisotropy);
  visit.sparse("emission", EmissionField{medium});
  visit.sparse("optional", medium.optional);
}

}  // namespace nullmark
