#include "harness/config/component_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "harness/io/text.h"
#include "harness/io/transport_json.h"

namespace nullmark {
namespace {

/// Media made of media: one channel of each, or their sum.
constexpr const char *kChannels = "channels", *kSum = "sum";

bool is_composed(const std::string& type) { return type == kChannels || type == kSum; }

std::string expectation(const Range& range, const std::string& unit) {
  std::string text = "a finite number";
  if (std::isfinite(range.low)) text = fmt::format("a finite number {} {}", range.exclusive ? ">" : ">=", range.low);
  if (std::isfinite(range.high)) text += fmt::format(" and <= {}", range.high);
  return unit.empty() ? text : text + " in " + unit;
}

Real number_within(const JsonNode& node, const Range& range, const std::string& unit) {
  if (!node.json().is_number()) node.expected(expectation(range, unit));
  const Real value = node.number();
  if (!std::isfinite(value) || !range.contains(value)) node.expected(expectation(range, unit));
  return value;
}

std::vector<Real> numbers_within(const JsonNode& node, std::size_t least, std::size_t most, const Range& range,
                                 const std::string& unit) {
  const std::string length =
      least == most ? fmt::format("a list of {} numbers", least) : fmt::format("a list of {} to {} numbers", least, most);
  if (!node.json().is_array() || node.json().size() < least || node.json().size() > most) node.expected(length);
  std::vector<Real> values;
  for (const JsonNode& element : node.elements()) values.push_back(number_within(element, range, unit));
  return values;
}

bool holds_list(const ParameterInfo& parameter) {
  return std::holds_alternative<std::vector<Real>>(parameter.default_value) ||
         std::holds_alternative<std::vector<std::string>>(parameter.default_value) ||
         std::holds_alternative<std::array<Real, 3>>(parameter.default_value);
}

/// A JSON object, or, as results hold it, the text of one.
std::string object_text(const JsonNode& node) {
  const Json object = node.json().is_string() ? known_json(node.string()) : node.json();
  if (!object.is_object()) node.expected("an object");
  return object.dump();
}

std::vector<std::string> words(const JsonNode& node) {
  constexpr std::size_t kMost = 1000;
  if (!node.json().is_array() || node.json().empty() || node.json().size() > kMost)
    node.expected(fmt::format("a list of 1 to {} words", kMost));
  std::vector<std::string> list;
  for (const JsonNode& word : node.elements()) list.push_back(word.string());
  return list;
}

/// Such as the name of a file, which messages show.
std::string text(const JsonNode& node) {
  if (node.string() != printable(node.string())) node.expected("a text without control characters");
  return node.string();
}

ParameterValue read_value(const ParameterInfo& parameter, const JsonNode& node) {
  switch (parameter.default_value.index()) {
    case 0:
      return number_within(node, parameter.range, parameter.unit);
    case 1:
      return static_cast<int>(node.integer(parameter.low, parameter.high));
    case 2:
      return node.boolean();
    case 3:
      if (parameter.object) return object_text(node);
      return parameter.allowed.empty() ? text(node) : node.one_of(parameter.allowed, parameter.name.c_str());
    case 4:
      return numbers_within(node, static_cast<std::size_t>(parameter.least), static_cast<std::size_t>(parameter.most),
                            parameter.range, parameter.unit);
    case 6:
      return words(node);
    default: {
      const std::vector<Real> point = numbers_within(node, 3, 3, Range::any(), parameter.unit);
      return std::array{point[0], point[1], point[2]};
    }
  }
}

/// One value, or each of a swept list's.
std::vector<JsonNode> swept(const JsonNode& node, bool value_is_list) {
  const Json& json = node.json();
  const bool sweep = json.is_array() && (!value_is_list || (!json.empty() && json[0].is_array()));
  if (sweep && json.empty()) node.expected("at least one value");
  return sweep ? node.elements() : std::vector<JsonNode>{node};
}

template <class Spec, class Value, class Set>
std::vector<Spec> crossed(const JsonNode& node, const std::vector<Spec>& specs, const std::vector<Value>& values,
                          const Set& set) {
  expect_cells(node, specs.size(), values.size());
  std::vector<Spec> result;
  for (const Spec& spec : specs)
    for (const Value& value : values) {
      result.push_back(spec);
      set(result.back(), value);
    }
  return result;
}

std::vector<std::string> names_of(const std::vector<ComponentInfo>& entries) {
  std::vector<std::string> names;
  names.reserve(entries.size());
  for (const ComponentInfo& entry : entries) names.push_back(entry.name);
  return names;
}

/// The entry's type, checked, and the place to blame for it.
std::string read_type(ComponentKind kind, const JsonNode& node) {
  std::vector<std::string> names = names_of(registered(kind));
  if (kind == ComponentKind::medium) names.insert(names.end(), {kChannels, kSum});
  if (!node.json().is_string() && !node.json().is_object())
    node.expected(fmt::format("the name of a {} or an object with \"type\"", to_string(kind)));
  const JsonNode type = node.json().is_string() ? node : node["type"];
  if (kind == ComponentKind::estimator && type.json().is_string() && is_planted(type.string())) return type.string();
  return type.one_of(names, to_string(kind));
}

/// Keys that any medium takes beside its type's own.
const std::vector<std::string> kMatterKeys = {"albedo", "anisotropy", "emission", "optional"};

/// Media whose optical depth no parameter sets have others that do.
void tell_of_extinction(const JsonNode& node, const std::string& type, const std::vector<ParameterInfo>& parameters) {
  std::vector<std::string> names;
  for (const ParameterInfo& parameter : parameters)
    if (parameter.unit == "1/length") names.push_back(fmt::format("\"{}\"", parameter.name));
  if (!names.empty())
    node.fail(fmt::format("{} has no optical_depth; its extinction is set by {}", type, fmt::join(names, ", ")));
}

/// Components with the values that are given; `extra` keys are someone else's.
std::vector<Component> read_given(ComponentKind kind, const JsonNode& node, const std::vector<std::string>& extra = {}) {
  Component first;
  first.type = read_type(kind, node);
  first.pointer = node.where();
  std::vector<Component> components = {first};
  if (node.json().is_string()) return components;

  const std::vector<ParameterInfo> parameters = parameters_of(kind, first.type);
  std::vector<std::string> keys = extra;
  keys.push_back("type");
  for (const ParameterInfo& parameter : parameters) keys.push_back(parameter.name);
  for (const auto& [key, json] : node.json().items()) {
    const auto named = [&name = key](const ParameterInfo& parameter) { return parameter.name == name; };
    const auto parameter = std::find_if(parameters.begin(), parameters.end(), named);
    if (parameter == parameters.end()) {
      if (kind == ComponentKind::medium && key == "optical_depth") tell_of_extinction(node[key], first.type, parameters);
      if (key.rfind("x-", 0) != 0 && std::find(keys.begin(), keys.end(), key) == keys.end()) {
        if (parameters.empty() && nearest(key, keys).empty())
          node[key].fail(fmt::format("unknown parameter \"{}\"; {} has no parameters", key, first.type));
        node[key].unknown(fmt::format("parameter of {}", first.type), key, keys);
      }
      continue;
    }
    std::vector<ParameterValue> values;
    for (const JsonNode& value : swept(node[key], holds_list(*parameter))) values.push_back(read_value(*parameter, value));
    components = crossed(node, components, values,
                         [&name = key](Component& component, const ParameterValue& value) { component.values[name] = value; });
  }
  return components;
}

void complete(ComponentKind kind, Component& component) {
  const std::vector<ParameterInfo> parameters = parameters_of(kind, component.type);
  for (const ParameterInfo& parameter : parameters) component.values.emplace(parameter.name, parameter.default_value);
  component.label = printable(make_label(component.type, component.values, parameters));
}

void complete(MediumSpec& medium);

void add_matter_label(MediumSpec& medium) {
  if (!medium.albedo.empty()) medium.label += "/albedo:" + to_text(medium.albedo);
  for (MediumSpec& field : medium.albedo_field) {
    complete(field);
    medium.optional |= field.optional;
    medium.label += fmt::format("/albedo:({})", field.label);
  }
  if (medium.anisotropy != 0) medium.label += "/anisotropy:" + to_text(medium.anisotropy);
  if (!medium.emission.empty()) medium.label += "/emission:" + to_text(medium.emission);
  for (MediumSpec& field : medium.emission_field) {
    complete(field);
    medium.optional |= field.optional;
    medium.label += fmt::format("({})", field.label);
  }
}

void complete(MediumSpec& medium) {
  if (medium.per_channel.empty()) {
    complete(ComponentKind::medium, medium.field);
    medium.label = medium.field.label;
    if (!medium.spectrum.empty()) medium.label += "/spectrum:" + to_text(medium.spectrum);
    add_matter_label(medium);
    return;
  }
  for (MediumSpec& channel : medium.per_channel) {
    complete(channel);
    medium.label += (medium.label.empty() ? medium.field.type + "(" : "|") + channel.label;
    medium.optional |= channel.optional;
  }
  medium.label += ")";
  medium.field.label = medium.label;
  add_matter_label(medium);
}

std::vector<MediumSpec> read_given_media(const JsonNode& node);

Real read_anisotropy(const JsonNode& node) {
  const Real g = node.number();
  if (!(g > -1 && g < 1)) node.expected("a mean cosine between -1 and 1");
  return g;
}

/// What the media do to light beside removing it.
std::vector<MediumSpec> with_matter(std::vector<MediumSpec> media, const JsonNode& node) {
  if (!node.json().is_object()) return media;
  if (node.has("albedo") && node["albedo"].json().is_object()) {
    node["albedo"].expect_keys({"field"});
    const std::vector<MediumSpec> fields = read_given_media(node["albedo"]["field"]);
    if (fields.size() != 1) node["albedo"]["field"].expected("one medium, not a sweep");
    for (MediumSpec& medium : media) medium.albedo_field = fields;
  } else if (node.has("albedo")) {
    std::vector<std::vector<Real>> albedos;
    for (const JsonNode& albedo : swept(node["albedo"], true)) albedos.push_back(read_per_channel(albedo, 1));
    media = crossed(node, media, albedos, [](MediumSpec& medium, const std::vector<Real>& albedo) { medium.albedo = albedo; });
  }
  if (node.has("anisotropy")) {
    std::vector<Real> cosines;
    for (const JsonNode& g : swept(node["anisotropy"], false)) cosines.push_back(read_anisotropy(g));
    media = crossed(node, media, cosines, [](MediumSpec& medium, Real g) { medium.anisotropy = g; });
  }
  if (!node.has("emission")) return media;
  const JsonNode emission = node["emission"];
  if (!emission.json().is_object()) {
    for (MediumSpec& medium : media) medium.emission = read_per_channel(emission, kInfinity);
    return media;
  }
  emission.expect_keys({"radiance", "field"});
  for (MediumSpec& medium : media) medium.emission = read_per_channel(emission["radiance"], kInfinity);
  if (!emission.has("field")) return media;
  std::vector<MediumSpec> fields = read_given_media(emission["field"]);
  if (fields.size() != 1) emission["field"].expected("one medium, not a sweep");
  if (!fields[0].spectrum.empty() || !fields[0].per_channel.empty())
    emission["field"].fail("a field of emission must be grey; its radiance may differ by channel");
  for (MediumSpec& medium : media) medium.emission_field = fields;
  return media;
}

std::vector<MediumSpec> read_given_media(const JsonNode& node) {
  MediumSpec first;
  if (node.json().is_object() && node.has("optional")) first.optional = node["optional"].boolean();
  std::vector<MediumSpec> media = {first};

  if (const std::string type = read_type(ComponentKind::medium, node); is_composed(type)) {
    if (!node.json().is_object()) node.expected("an object with \"type\" and \"media\"");
    std::vector<std::string> keys = kMatterKeys;
    keys.insert(keys.end(), {"type", "media"});
    node.expect_keys(keys);
    const std::vector<JsonNode> channels = node["media"].elements();
    if (channels.empty() || channels.size() > kMaxChannels)
      node["media"].expected(fmt::format("1 to {} grey media", kMaxChannels));
    media[0].field.type = type;
    media[0].field.pointer = node.where();
    for (const JsonNode& channel : channels) {
      const std::vector<MediumSpec> variants = read_given_media(channel);
      if (!variants[0].spectrum.empty() || !variants[0].per_channel.empty())
        channel.fail(fmt::format("its medium must be grey; expected neither \"spectrum\" nor \"{0}\" inside \"{0}\"", type));
      if (!variants[0].albedo_field.empty() || !variants[0].emission.empty() || variants[0].anisotropy != 0)
        channel.fail(
            "a field of \"albedo\", \"anisotropy\" and \"emission\" belong to the whole; expected them beside \"media\"");
      const bool scatters =
          std::any_of(variants.begin(), variants.end(), [](const MediumSpec& one) { return !one.albedo.empty(); });
      if (scatters && type != kSum) channel.fail("\"albedo\" belongs to the whole; expected it beside \"media\"");
      if (scatters && node.has("albedo"))
        channel.fail("\"albedo\" of a component and of the whole exclude each other; expected the one or the other");
      media = crossed(node, media, variants,
                      [](MediumSpec& medium, const MediumSpec& variant) { medium.per_channel.push_back(variant); });
    }
    return with_matter(media, node);
  }

  std::vector<std::string> keys = kMatterKeys;
  keys.emplace_back("spectrum");
  const std::vector<Component> fields = read_given(ComponentKind::medium, node, keys);
  media = crossed(node, media, fields, [](MediumSpec& medium, const Component& field) { medium.field = field; });
  if (node.json().is_object() && node.has("spectrum")) {
    std::vector<std::vector<Real>> spectra;
    for (const JsonNode& spectrum : swept(node["spectrum"], true))
      spectra.push_back(numbers_within(spectrum, 1, kMaxChannels, Range::non_negative(), ""));
    media =
        crossed(node, media, spectra, [](MediumSpec& medium, const std::vector<Real>& spectrum) { medium.spectrum = spectrum; });
  }
  return with_matter(media, node);
}

}  // namespace

void expect_cells(const JsonNode& node, std::size_t a, std::size_t b) {
  if (b > 0 && a > kMostCells / b)
    node.fail(fmt::format("its sweeps make more than {} cells; split them into several files", kMostCells));
}

std::vector<Component> read_components(ComponentKind kind, const JsonNode& node) {
  std::vector<Component> components = read_given(kind, node);
  for (Component& component : components) complete(kind, component);
  return components;
}

std::vector<MediumSpec> read_media(const JsonNode& node) {
  std::vector<MediumSpec> media = read_given_media(node);
  for (MediumSpec& medium : media) complete(medium);
  return media;
}

std::vector<Component> read_component_patterns(ComponentKind kind, const JsonNode& node) {
  std::vector<Component> patterns;
  for (const JsonNode& entry : node.elements_or_self())
    for (Component& pattern : read_given(kind, entry)) patterns.push_back(std::move(pattern));
  return patterns;
}

std::vector<MediumSpec> read_medium_patterns(const JsonNode& node) {
  std::vector<MediumSpec> patterns;
  for (const JsonNode& entry : node.elements_or_self()) {
    // "channels" alone is a pattern, though no medium.
    if (entry.json() == kChannels ||
        (entry.json().is_object() && entry.json().size() == 1 && entry["type"].json() == kChannels)) {
      MediumSpec any_channels;
      any_channels.field.type = kChannels;
      patterns.push_back(any_channels);
      continue;
    }
    for (MediumSpec& pattern : read_given_media(entry)) patterns.push_back(std::move(pattern));
  }
  return patterns;
}

bool matches(const Component& pattern, const Component& component) {
  return pattern.type == component.type && std::all_of(pattern.values.begin(), pattern.values.end(), [&](const auto& given) {
           const auto at = component.values.find(given.first);
           return at != component.values.end() && at->second == given.second;
         });
}

bool matches(const MediumSpec& pattern, const MediumSpec& medium) {
  if (!matches(pattern.field, medium.field)) return false;
  if (!pattern.spectrum.empty() && pattern.spectrum != medium.spectrum) return false;
  if (!pattern.albedo.empty() && pattern.albedo != medium.albedo) return false;
  if (!pattern.albedo_field.empty() && pattern.albedo_field != medium.albedo_field) return false;
  if (pattern.anisotropy != 0 && pattern.anisotropy != medium.anisotropy) return false;
  if (!pattern.emission.empty() && pattern.emission != medium.emission) return false;
  return pattern.per_channel.empty() ||
         std::equal(pattern.per_channel.begin(), pattern.per_channel.end(), medium.per_channel.begin(), medium.per_channel.end(),
                    [](const MediumSpec& a, const MediumSpec& b) { return matches(a, b); });
}

}  // namespace nullmark
