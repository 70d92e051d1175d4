#include "harness/config/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "harness/config/component_reader.h"
#include "harness/io/spec_json.h"
#include "harness/io/transport_json.h"
#include "harness/model/names.h"

namespace nullmark {
namespace {

using Setter = std::function<void(ConfiguredCell&)>;

const std::vector<std::string> kAxes = {"estimator",     "medium", "majorant",    "rays",      "quantity", "samples_per_ray",
                                        "equal_lookups", "seed",   "measurement", "transport", "precision"};
const std::vector<std::string> kSingle = {"images", "image_maximum", "own_streams", "verdict", "reference"};

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Quantity read_quantity(const JsonNode& node) { return *quantity_named(node.one_of(quantity_names(), "quantity")); }

Precision read_precision(const JsonNode& node) { return precision_named(node.one_of(precision_names(), "precision")); }

Measurement read_measurement(const JsonNode& node) {
  node.expect_keys({"clamp", "quantise_bits"});
  Measurement measurement;
  if (node.has("clamp")) measurement.clamp = node["clamp"].boolean();
  if (node.has("quantise_bits")) measurement.quantise_bits = static_cast<int>(node["quantise_bits"].integer(0, 31));
  return measurement;
}

std::uint64_t read_samples(const JsonNode& node) { return node.unsigned_integer(1, std::uint64_t{1} << 53); }

VerdictSpec read_verdict_spec(const JsonNode& node) {
  node.expect_keys({"enabled", "epsilon", "max_samples_per_ray", "max_lookups_per_ray", "laws", "tolerate", "samples"});
  VerdictSpec spec;
  if (node.has("enabled")) spec.enabled = node["enabled"].boolean();
  if (node.has("epsilon")) spec.epsilon = node["epsilon"].positive();
  if (node.has("max_samples_per_ray"))
    spec.max_samples_per_ray = node["max_samples_per_ray"].unsigned_integer(0, std::uint64_t{1} << 53);
  if (node.has("max_lookups_per_ray")) spec.max_lookups_per_ray = node["max_lookups_per_ray"].positive();
  const auto choice = [&](const char* key, const std::vector<std::string>& names, const char* what) {
    return std::find(names.begin(), names.end(), node[key].one_of(names, what)) - names.begin();
  };
  if (node.has("laws")) spec.laws = static_cast<LawPolicy>(choice("laws", law_policies(), "policy"));
  if (node.has("tolerate")) spec.tolerate = static_cast<Tolerate>(choice("tolerate", tolerances(), "bias to tolerate"));
  if (node.has("samples")) spec.all_samples = choice("samples", sample_policies(), "policy") == 1;
  return spec;
}

GivenReference read_reference(const JsonNode& node) {
  node.expect_keys({"value", "error", "source"});
  GivenReference reference;
  for (const JsonNode& value : node["value"].elements_or_self()) reference.value.push_back(value.number());
  reference.error = node["error"].number();
  if (!(reference.error >= 0)) node["error"].expected("a relative bound >= 0");
  reference.source = node["source"].string();
  return reference;
}

template <class Value, class Set>
std::vector<Setter> setters(const std::vector<Value>& values, Set set) {
  std::vector<Setter> result;
  result.reserve(values.size());
  for (const Value& value : values) result.push_back([value, set](ConfiguredCell& configured) { set(configured, value); });
  return result;
}

template <class Read>
auto each(const JsonNode& node, Read read) {
  std::vector<decltype(read(node))> values;
  for (const JsonNode& element : node.elements_or_self()) values.push_back(read(element));
  return values;
}

std::vector<Component> each_component(ComponentKind kind, const JsonNode& node) {
  std::vector<Component> components;
  for (const JsonNode& entry : node.elements_or_self())
    for (Component& component : read_components(kind, entry)) components.push_back(std::move(component));
  return components;
}

/// The values of one key, each as a change to a cell.
std::vector<Setter> read_axis(const std::string& key, const JsonNode& node) {
  if (key == "estimator")
    return setters(each_component(ComponentKind::estimator, node),
                   [](ConfiguredCell& d, const Component& c) { d.estimator = c; });
  if (key == "majorant")
    return setters(each_component(ComponentKind::majorant, node), [](ConfiguredCell& d, const Component& c) { d.majorant = c; });
  if (key == "rays")
    return setters(each_component(ComponentKind::ray_set, node), [](ConfiguredCell& d, const Component& c) { d.rays = c; });
  if (key == "medium") {
    std::vector<MediumSpec> media;
    for (const JsonNode& entry : node.elements_or_self())
      for (MediumSpec& medium : read_media(entry)) media.push_back(std::move(medium));
    return setters(media, [](ConfiguredCell& d, const MediumSpec& m) { d.medium = m; });
  }
  if (key == "quantity") return setters(each(node, read_quantity), [](ConfiguredCell& d, Quantity q) { d.cell.quantity = q; });
  if (key == "precision")
    return setters(each(node, read_precision), [](ConfiguredCell& d, Precision precision) { d.cell.precision = precision; });
  if (key == "measurement")
    return setters(each(node, read_measurement), [](ConfiguredCell& d, const Measurement& m) { d.cell.measurement = m; });
  if (key == "transport")
    return setters(each(node, read_transport), [](ConfiguredCell& d, const TransportSpec& t) { d.cell.transport = t; });
  if (key == "seed") {
    const auto read = [](const JsonNode& at) { return at.unsigned_integer(0); };
    return setters(each(node, read), [](ConfiguredCell& d, std::uint64_t seed) { d.cell.seed = seed; });
  }
  if (key == "samples_per_ray")
    return setters(each(node, read_samples), [](ConfiguredCell& d, std::uint64_t samples) {
      d.has_samples = true;
      d.cell.samples_per_ray = samples;
      d.cell.equal_lookups.reset();
    });
  if (key == "equal_lookups")
    return setters(each(node, [](const JsonNode& at) { return at.positive(); }), [](ConfiguredCell& d, Real lookups) {
      d.has_samples = true;
      d.cell.samples_per_ray = 1;
      d.cell.equal_lookups = lookups;
    });
  if (key == "image_maximum")
    return setters(std::vector{node.positive()}, [](ConfiguredCell& d, Real maximum) { d.cell.image_maximum = maximum; });
  if (key == "reference")
    return setters(std::vector{read_reference(node)},
                   [](ConfiguredCell& d, const GivenReference& given) { d.cell.reference = given; });
  if (key == "verdict")
    return setters(std::vector{read_verdict_spec(node)},
                   [](ConfiguredCell& d, const VerdictSpec& spec) { d.cell.verdict = spec; });
  const bool flag = node.boolean();
  return {key == "images" ? Setter([flag](ConfiguredCell& d) { d.cell.images = flag; })
                          : Setter([flag](ConfiguredCell& d) { d.cell.own_streams = flag; })};
}

/// A key that has one value outside a matrix.
void apply_single(const JsonNode& object, const std::string& key, ConfiguredCell& configured) {
  if (!object.has(key.c_str())) return;
  const JsonNode node = object[key];
  const std::vector<Setter> values = read_axis(key, node);
  if (values.size() != 1)
    node.fail(fmt::format("found {} values; expected one here; sweeps belong in \"matrix\"", values.size()));
  values[0](configured);
}

void refuse_two_sample_counts(const JsonNode& object) {
  if (object.has("samples_per_ray") && object.has("equal_lookups"))
    object["equal_lookups"].fail("found beside \"samples_per_ray\"; expected one of the two");
}

template <class Pattern, class Select>
Test any_matches(const std::vector<Pattern>& patterns, Select select) {
  return [patterns, select](const ConfiguredCell& configured) {
    return std::any_of(patterns.begin(), patterns.end(), [&](const Pattern& pattern) { return select(configured, pattern); });
  };
}

Test read_test(const std::string& key, const JsonNode& node) {
  if (key == "estimator")
    return any_matches(read_component_patterns(ComponentKind::estimator, node),
                       [](const ConfiguredCell& d, const Component& c) { return matches(c, *d.estimator); });
  if (key == "majorant")
    return any_matches(read_component_patterns(ComponentKind::majorant, node),
                       [](const ConfiguredCell& d, const Component& c) { return matches(c, *d.majorant); });
  if (key == "rays")
    return any_matches(read_component_patterns(ComponentKind::ray_set, node),
                       [](const ConfiguredCell& d, const Component& c) { return matches(c, *d.rays); });
  if (key == "medium")
    return any_matches(read_medium_patterns(node),
                       [](const ConfiguredCell& d, const MediumSpec& m) { return matches(m, *d.medium); });
  if (key == "quantity")
    return any_matches(each(node, read_quantity), [](const ConfiguredCell& d, Quantity q) { return d.cell.quantity == q; });
  if (key == "precision")
    return any_matches(each(node, read_precision), [](const ConfiguredCell& d, Precision p) { return d.cell.precision == p; });
  if (key == "measurement")
    return any_matches(each(node, read_measurement),
                       [](const ConfiguredCell& d, const Measurement& m) { return d.cell.measurement == m; });
  if (key == "transport")
    return any_matches(each(node, read_transport),
                       [](const ConfiguredCell& d, const TransportSpec& t) { return d.cell.transport == t; });
  if (key == "seed")
    return any_matches(each(node, [](const JsonNode& at) { return at.unsigned_integer(0); }),
                       [](const ConfiguredCell& d, std::uint64_t seed) { return d.cell.seed == seed; });
  if (key == "samples_per_ray")
    return any_matches(each(node, read_samples), [](const ConfiguredCell& d, std::uint64_t samples) {
      return !d.cell.equal_lookups && d.cell.samples_per_ray == samples;
    });
  return any_matches(each(node, [](const JsonNode& at) { return at.positive(); }),
                     [](const ConfiguredCell& d, Real lookups) { return d.cell.equal_lookups == lookups; });
}

}  // namespace

Test read_pattern(const JsonNode& node, const std::vector<std::string>& also) {
  node.expect_keys(joined(kAxes, also));
  std::vector<Test> tests;
  for (const std::string& key : kAxes)
    if (node.has(key.c_str())) tests.push_back(read_test(key, node[key]));
  return [tests](const ConfiguredCell& configured) {
    return std::all_of(tests.begin(), tests.end(), [&](const Test& t) { return t(configured); });
  };
}

namespace {

/// Axes that advance together, as one list of changes.
using Group = std::vector<Setter>;

std::vector<Group> read_matrix(const JsonNode& experiment) {
  const JsonNode matrix = experiment["matrix"];
  matrix.expect_keys(kAxes);
  refuse_two_sample_counts(matrix);
  std::map<std::string, std::size_t> group_of;
  std::vector<std::vector<std::string>> zipped;
  if (experiment.has("zip"))
    for (const JsonNode& list : experiment["zip"].elements()) {
      zipped.emplace_back();
      for (const JsonNode& name : list.elements()) {
        const std::string key = name.one_of(kAxes, "axis");
        if (!matrix.has(key.c_str())) name.fail(fmt::format("found \"{}\"; expected a key of \"matrix\"", key));
        if (!group_of.emplace(key, zipped.size() - 1).second) name.fail(fmt::format("\"{}\" is zipped twice", key));
        zipped.back().push_back(key);
      }
    }
  std::vector<Group> groups;
  std::set<std::size_t> done;
  for (const auto& [key, json] : matrix.json().items()) {
    if (key.rfind("x-", 0) == 0) continue;
    if (experiment.has(key.c_str())) experiment[key].fail("found here and in \"matrix\"; expected one of the two");
    const auto at = group_of.find(key);
    if (at != group_of.end() && !done.insert(at->second).second) continue;
    const std::vector<std::string> members = at == group_of.end() ? std::vector{key} : zipped[at->second];
    Group group;
    for (const std::string& member : members) {
      const std::vector<Setter> values = read_axis(member, matrix[member]);
      if (values.empty()) matrix[member].expected("at least one value");
      if (member == members.front()) group.assign(values.size(), [](ConfiguredCell&) {});
      if (values.size() != group.size())
        matrix[member].fail(fmt::format("found {} values; expected {}, as many as \"{}\" it is zipped with", values.size(),
                                        group.size(), members.front()));
      for (std::size_t i = 0; i < values.size(); ++i)
        group[i] = [before = group[i], value = values[i]](ConfiguredCell& configured) {
          before(configured);
          value(configured);
        };
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

void require_complete(const JsonNode& node, const ConfiguredCell& configured) {
  const auto missing = [&](const char* key) {
    node.fail(fmt::format("\"{}\" is missing; expected it here or in \"matrix\"", key));
  };
  if (!configured.estimator) missing("estimator");
  if (!configured.medium) missing("medium");
  if (!configured.rays) missing("rays");
  if (!configured.has_samples) missing("samples_per_ray");
}

std::vector<ConfiguredCell> expand_matrix(const JsonNode& experiment, const ConfiguredCell& base) {
  std::vector<ConfiguredCell> cells = {base};
  for (const Group& group : read_matrix(experiment)) {
    expect_cells(experiment["matrix"], cells.size(), group.size());
    std::vector<ConfiguredCell> next;
    next.reserve(cells.size() * group.size());
    for (const ConfiguredCell& configured : cells)
      for (const Setter& set : group) {
        next.push_back(configured);
        set(next.back());
      }
    cells = std::move(next);
  }
  require_complete(experiment, cells.front());

  std::vector<Test> unwanted;
  if (experiment.has("exclude"))
    for (const JsonNode& pattern : experiment["exclude"].elements()) unwanted.push_back(read_pattern(pattern));
  if (experiment.has("constraints"))
    for (const JsonNode& constraint : experiment["constraints"].elements()) {
      constraint.expect_keys({"if", "then"});
      unwanted.push_back([premise = read_pattern(constraint["if"]), conclusion = read_pattern(constraint["then"])](
                             const ConfiguredCell& configured) { return premise(configured) && !conclusion(configured); });
    }
  const auto drop = [&](const ConfiguredCell& configured) {
    return std::any_of(unwanted.begin(), unwanted.end(), [&](const Test& test) { return test(configured); });
  };
  cells.erase(std::remove_if(cells.begin(), cells.end(), drop), cells.end());
  return cells;
}

}  // namespace

const std::vector<std::string>& axes() { return kAxes; }

bool agree_on(const std::string& axis, const ConfiguredCell& a, const ConfiguredCell& b) {
  if (axis == "estimator") return a.estimator == b.estimator;
  if (axis == "medium") return a.medium == b.medium;
  if (axis == "majorant") return a.majorant == b.majorant;
  if (axis == "rays") return a.rays == b.rays;
  if (axis == "quantity") return a.cell.quantity == b.cell.quantity;
  if (axis == "samples_per_ray") return a.cell.samples_per_ray == b.cell.samples_per_ray;
  if (axis == "equal_lookups") return a.cell.equal_lookups == b.cell.equal_lookups;
  if (axis == "seed") return a.cell.seed == b.cell.seed;
  if (axis == "measurement") return a.cell.measurement == b.cell.measurement;
  if (axis == "transport") return a.cell.transport == b.cell.transport;
  return a.cell.precision == b.cell.precision;
}

void refuse_renamed(const JsonNode& node, const char* before, const char* now) {
  if (node.has(before)) node[before].fail(fmt::format("is called \"{}\" since {}", now, kConfigVersion));
}

std::vector<ConfiguredCell> read_experiment(const JsonNode& node, std::uint64_t seed) {
  refuse_renamed(node, "gate", "verdict");
  node.expect_keys(joined(joined(kAxes, kSingle), {"name", "matrix", "zip", "exclude", "include", "constraints"}));
  refuse_two_sample_counts(node);
  ConfiguredCell base;
  base.experiment = base.cell.experiment = node["name"].string();
  if (base.experiment.empty()) node["name"].expected("a name that is not empty");
  base.cell.seed = seed;
  static const Json kGlobal = "global";
  base.majorant = read_components(ComponentKind::majorant, JsonNode(kGlobal, node.file(), node.pointer()))[0];
  for (const std::string& key : joined(kAxes, kSingle)) apply_single(node, key, base);

  std::vector<ConfiguredCell> cells;
  if (node.has("matrix"))
    cells = expand_matrix(node, base);
  else if (!node.has("include"))
    node.fail("found neither \"matrix\" nor \"include\"; expected at least one");
  else
    for (const char* key : {"zip", "exclude", "constraints"})
      if (node.has(key)) node[key].fail("found without \"matrix\"; it applies only to a matrix");
  if (node.has("include"))
    for (const JsonNode& entry : node["include"].elements()) {
      refuse_renamed(entry, "gate", "verdict");
      entry.expect_keys(joined(kAxes, kSingle));
      refuse_two_sample_counts(entry);
      cells.push_back(base);
      for (const std::string& key : joined(kAxes, kSingle)) apply_single(entry, key, cells.back());
      require_complete(entry, cells.back());
    }
  if (cells.empty()) node.fail("found no cell after \"exclude\" and \"constraints\"; expected at least one");
  return cells;
}

}  // namespace nullmark
