#include "harness/io/component_fields.h"

#include <limits>

namespace nullmark {
namespace {

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

}  // namespace

ParameterValue read_parameter(ComponentKind kind, const std::string& type, const std::string& name, const JsonNode& node) {
  const Json& json = node.json();
  if (json.is_boolean()) return json.get<bool>();
  if (json.is_number_float()) return json.get<Real>();
  if (json.is_number()) return static_cast<int>(node.integer(std::numeric_limits<int>::min(), std::numeric_limits<int>::max()));
  if (!json.is_array()) return node.string();
  if (!json.empty() && json[0].is_string()) {
    std::vector<std::string> words;
    for (const JsonNode& element : node.elements()) words.push_back(element.string());
    return words;
  }
  std::vector<Real> numbers;
  for (const JsonNode& element : node.elements()) numbers.push_back(element.number());
  if (numbers.size() == 3 && is_point(kind, type, name)) return std::array{numbers[0], numbers[1], numbers[2]};
  return numbers;
}

Json medium_record_json(const MediumSpec& medium) { return fields_json(medium); }

MediumSpec read_medium_record(const JsonNode& node) {
  MediumSpec medium;
  read_fields(node, medium);
  return medium;
}

}  // namespace nullmark
