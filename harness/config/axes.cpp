#include "harness/config/axes.h"

#include <algorithm>
#include <utility>

#include "harness/config/component_reader.h"
#include "harness/io/spec_fields.h"
#include "harness/io/transport_json.h"

namespace nullmark {
namespace {

Json definition(const char* name) { return {{"$ref", std::string("#/definitions/") + name}}; }

template <class Read>
auto each(const JsonNode& node, Read read) {
  std::vector<decltype(read(node))> values;
  for (const JsonNode& element : node.elements_or_self()) values.push_back(read(element));
  return values;
}

/// What all entries of a list stand for: an entry may sweep parameters.
template <class Read>
auto joined(const JsonNode& node, Read read) {
  decltype(read(node)) values;
  for (const JsonNode& entry : node.elements_or_self())
    for (auto& value : read(entry)) values.push_back(std::move(value));
  return values;
}

template <class Values, class Set>
std::vector<Setter> setters(const Values& values, Set set) {
  std::vector<Setter> result;
  result.reserve(values.size());
  for (const auto& value : values) result.push_back([value, set](ConfiguredCell& configured) { set(configured, value); });
  return result;
}

/// All cells with a value hold it once.
template <class Value>
std::vector<Shared<Value>> shared_values(std::vector<Value> values) {
  return {std::make_move_iterator(values.begin()), std::make_move_iterator(values.end())};
}

template <class Values, class Fits>
Test any_fits(Values values, Fits fits) {
  return [values = std::move(values), fits](const ConfiguredCell& configured) {
    return std::any_of(values.begin(), values.end(), [&](const auto& value) { return fits(configured, value); });
  };
}

/// `read` makes a value of a node; `member` is where a cell holds it.
template <class Read, class Member>
Axis axis(const char* name, Json schema, Read read, Member member) {
  return {
      name,
      [=](const JsonNode& node) { return setters(each(node, read), [=](auto& c, const auto& value) { member(c) = value; }); },
      [=](const JsonNode& node) { return any_fits(each(node, read), [=](auto& c, const auto& v) { return member(c) == v; }); },
      [=](const ConfiguredCell& a, const ConfiguredCell& b) { return member(a) == member(b); }, std::move(schema)};
}

/// The same of a specification that may sweep parameters; a pattern gives some of them.
template <class Read, class ReadPattern, class Member>
Axis swept_axis(const char* name, Read read, ReadPattern read_pattern, Member member) {
  return {name,
          [=](const JsonNode& node) {
            return setters(shared_values(joined(node, read)), [=](auto& c, const auto& value) { member(c) = value; });
          },
          [=](const JsonNode& node) {
            return any_fits(read_pattern(node),
                            [=](auto& c, const auto& pattern) { return member(c) && matches(pattern, **member(c)); });
          },
          [=](const ConfiguredCell& a, const ConfiguredCell& b) { return member(a) == member(b); },
          definition(name),
          true};
}

template <class Member>
Axis component_axis(const char* name, ComponentKind kind, Member member) {
  return swept_axis(
      name, [kind](const JsonNode& node) { return read_components(kind, node); },
      [kind](const JsonNode& node) { return read_component_patterns(kind, node); }, member);
}

/// A second tracker, defined as estimators are.
Axis minus_axis() {
  Axis minus = component_axis(
      "minus", ComponentKind::estimator, [](auto& c) -> auto& { return c.minus; });
  minus.schema = described({{"anyOf", {definition("estimator")}}}, "a second tracker, whose samples are subtracted");
  return minus;
}

/// Samples are counted, or follow from lookups.
Axis samples_axis() {
  Axis samples = axis(
      "samples_per_ray", whole_schema(1), [](const JsonNode& node) { return node.unsigned_integer(1, std::uint64_t{1} << 53); },
      [](auto& c) -> auto& { return c.cell.samples_per_ray; });
  samples.read = [read = samples.read](const JsonNode& node) {
    return setters(read(node), [](ConfiguredCell& c, const Setter& set) {
      set(c);
      c.has_samples = true;
      c.cell.equal_lookups.reset();
    });
  };
  samples.pattern = [pattern = samples.pattern](const JsonNode& node) {
    return [fits = pattern(node)](const ConfiguredCell& c) { return !c.cell.equal_lookups && fits(c); };
  };
  return samples;
}

Axis equal_lookups_axis() {
  Axis lookups = axis(
      "equal_lookups", described(positive_schema(), "samples_per_ray = this / (expected lookups per sample)"),
      [](const JsonNode& node) { return node.positive(); }, [](auto& c) -> auto& { return c.cell.equal_lookups; });
  lookups.read = [read = lookups.read](const JsonNode& node) {
    return setters(read(node), [](ConfiguredCell& c, const Setter& set) {
      set(c);
      c.has_samples = true;
      c.cell.samples_per_ray = 1;
    });
  };
  return lookups;
}

template <class Value>
Value read_enum(const JsonNode& node) {
  Value value{};
  PlainField{value}.read(node);
  return value;
}

template <class Struct>
SharedKey shared(const char* name, const char* text, Struct (*read)(const JsonNode&), Json schema, void (*set)(Cell&, Struct)) {
  return {name, [=](const JsonNode& node) { return [value = read(node), set](ConfiguredCell& c) { set(c.cell, value); }; },
          described(std::move(schema), text)};
}

}  // namespace

const std::vector<Axis>& axes() {
  static const std::vector<Axis> kAxes = {
      component_axis(
          "estimator", ComponentKind::estimator, [](auto& c) -> auto& { return c.estimator; }),
      minus_axis(),
      swept_axis(
          "medium", read_media, read_medium_patterns, [](auto& c) -> auto& { return c.medium; }),
      component_axis(
          "majorant", ComponentKind::majorant, [](auto& c) -> auto& { return c.majorant; }),
      component_axis(
          "rays", ComponentKind::ray_set, [](auto& c) -> auto& { return c.rays; }),
      axis(
          "quantity", {{"enum", quantity_names()}}, read_enum<Quantity>, [](auto& c) -> auto& { return c.cell.quantity; }),
      samples_axis(),
      equal_lookups_axis(),
      axis(
          "seed", whole_schema(0), [](const JsonNode& node) { return node.unsigned_integer(0); },
          [](auto& c) -> auto& { return c.cell.seed; }),
      axis(
          "measurement", closed_schema<Measurement>(), [](const JsonNode& node) { return read_closed<Measurement>(node); },
          [](auto& c) -> auto& { return c.cell.measurement; }),
      axis(
          "transport", transport_schema(), read_transport, [](auto& c) -> auto& { return c.cell.transport; }),
      axis(
          "precision", described({{"enum", precision_names()}}, "precision of walks; default: \"double\""), read_enum<Precision>,
          [](auto& c) -> auto& { return c.cell.precision; }),
      axis(
          "lanes", described({{"type", "boolean"}}, "walks may run side by side in registers; default: true"),
          [](const JsonNode& node) { return node.boolean(); }, [](auto& c) -> auto& { return c.cell.lanes; })};
  return kAxes;
}

const std::vector<std::string>& axis_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const Axis& one : axes()) names.push_back(one.name);
    return names;
  }();
  return kNames;
}

const std::vector<SharedKey>& shared_keys() {
  const auto flag = [](const JsonNode& node) { return node.boolean(); };
  static const std::vector<SharedKey> kKeys = {
      shared<bool>("images", "", flag, {{"type", "boolean"}, {"default", false}},
                   [](Cell& cell, bool value) { cell.images = value; }),
      shared<Real>(
          "image_maximum", "value shown as white", [](const JsonNode& node) { return node.positive(); }, positive_schema(),
          [](Cell& cell, Real value) { cell.image_maximum = value; }),
      shared<bool>("own_streams", "random streams depend on the estimator, instead of common random numbers", flag,
                   {{"type", "boolean"}, {"default", false}}, [](Cell& cell, bool value) { cell.own_streams = value; }),
      shared<VerdictSpec>(
          "verdict", "what the verdict must prove and may cost",
          [](const JsonNode& node) { return read_closed<VerdictSpec>(node); }, closed_schema<VerdictSpec>(),
          [](Cell& cell, VerdictSpec value) { cell.verdict = value; }),
      shared<GivenReference>(
          "reference", "a mean computed elsewhere, with a relative bound on its error",
          [](const JsonNode& node) { return read_closed<GivenReference>(node); }, closed_schema<GivenReference>(),
          [](Cell& cell, GivenReference value) { cell.reference = std::move(value); })};
  return kKeys;
}

}  // namespace nullmark
