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

using Setter = std::function<void(Draft&)>;

const std::vector<std::string> kAxes = {"estimator",     "medium", "majorant",    "rays",      "quantity", "samples_per_ray",
                                        "equal_lookups", "seed",   "measurement", "transport", "precision"};
const std::vector<std::string> kSingle = {"images", "image_maximum", "own_streams", "gate", "reference"};

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Quantity read_quantity(const Place& place) { return *quantity_named(place.one_of(quantity_names(), "quantity")); }

Precision read_precision(const Place& place) { return precision_named(place.one_of(precision_names(), "precision")); }

Measurement read_measurement(const Place& place) {
  place.expect_keys({"clamp", "quantise_bits"});
  Measurement measurement;
  if (place.has("clamp")) measurement.clamp = place["clamp"].boolean();
  if (place.has("quantise_bits")) measurement.quantise_bits = static_cast<int>(place["quantise_bits"].integer(0, 31));
  return measurement;
}

std::uint64_t read_samples(const Place& place) { return place.unsigned_integer(1, std::uint64_t{1} << 53); }

GateSpec read_gate(const Place& place) {
  place.expect_keys({"enabled", "epsilon", "max_samples_per_ray", "max_lookups_per_ray", "laws", "tolerate", "samples"});
  GateSpec gate;
  if (place.has("enabled")) gate.enabled = place["enabled"].boolean();
  if (place.has("epsilon")) gate.epsilon = place["epsilon"].positive();
  if (place.has("max_samples_per_ray"))
    gate.max_samples_per_ray = place["max_samples_per_ray"].unsigned_integer(0, std::uint64_t{1} << 53);
  if (place.has("max_lookups_per_ray")) gate.max_lookups_per_ray = place["max_lookups_per_ray"].positive();
  const auto choice = [&](const char* key, const std::vector<std::string>& names, const char* what) {
    return std::find(names.begin(), names.end(), place[key].one_of(names, what)) - names.begin();
  };
  if (place.has("laws")) gate.laws = static_cast<LawPolicy>(choice("laws", law_policies(), "policy"));
  if (place.has("tolerate")) gate.tolerate = static_cast<Tolerate>(choice("tolerate", tolerances(), "bias to tolerate"));
  if (place.has("samples")) gate.all_samples = choice("samples", sample_policies(), "policy") == 1;
  return gate;
}

GivenReference read_reference(const Place& place) {
  place.expect_keys({"value", "error", "source"});
  GivenReference reference;
  for (const Place& value : place["value"].elements_or_self()) reference.value.push_back(value.number());
  reference.error = place["error"].number();
  if (!(reference.error >= 0)) place["error"].expected("a relative bound >= 0");
  reference.source = place["source"].string();
  return reference;
}

template <class Value, class Set>
std::vector<Setter> setters(const std::vector<Value>& values, Set set) {
  std::vector<Setter> result;
  result.reserve(values.size());
  for (const Value& value : values) result.push_back([value, set](Draft& draft) { set(draft, value); });
  return result;
}

template <class Read>
auto each(const Place& place, Read read) {
  std::vector<decltype(read(place))> values;
  for (const Place& element : place.elements_or_self()) values.push_back(read(element));
  return values;
}

std::vector<Component> each_component(ComponentKind kind, const Place& place) {
  std::vector<Component> components;
  for (const Place& entry : place.elements_or_self())
    for (Component& component : read_components(kind, entry)) components.push_back(std::move(component));
  return components;
}

/// The values of one key, each as a change to a draft.
std::vector<Setter> read_axis(const std::string& key, const Place& place) {
  if (key == "estimator")
    return setters(each_component(ComponentKind::estimator, place), [](Draft& d, const Component& c) { d.estimator = c; });
  if (key == "majorant")
    return setters(each_component(ComponentKind::majorant, place), [](Draft& d, const Component& c) { d.majorant = c; });
  if (key == "rays")
    return setters(each_component(ComponentKind::ray_set, place), [](Draft& d, const Component& c) { d.rays = c; });
  if (key == "medium") {
    std::vector<MediumSpec> media;
    for (const Place& entry : place.elements_or_self())
      for (MediumSpec& medium : read_media(entry)) media.push_back(std::move(medium));
    return setters(media, [](Draft& d, const MediumSpec& m) { d.medium = m; });
  }
  if (key == "quantity") return setters(each(place, read_quantity), [](Draft& d, Quantity q) { d.cell.quantity = q; });
  if (key == "precision")
    return setters(each(place, read_precision), [](Draft& d, Precision precision) { d.cell.precision = precision; });
  if (key == "measurement")
    return setters(each(place, read_measurement), [](Draft& d, const Measurement& m) { d.cell.measurement = m; });
  if (key == "transport")
    return setters(each(place, read_transport), [](Draft& d, const TransportSpec& t) { d.cell.transport = t; });
  if (key == "seed") {
    const auto read = [](const Place& at) { return at.unsigned_integer(0); };
    return setters(each(place, read), [](Draft& d, std::uint64_t seed) { d.cell.seed = seed; });
  }
  if (key == "samples_per_ray")
    return setters(each(place, read_samples), [](Draft& d, std::uint64_t samples) {
      d.has_samples = true;
      d.cell.samples_per_ray = samples;
      d.cell.equal_lookups.reset();
    });
  if (key == "equal_lookups")
    return setters(each(place, [](const Place& at) { return at.positive(); }), [](Draft& d, Real lookups) {
      d.has_samples = true;
      d.cell.samples_per_ray = 1;
      d.cell.equal_lookups = lookups;
    });
  if (key == "image_maximum")
    return setters(std::vector{place.positive()}, [](Draft& d, Real maximum) { d.cell.image_maximum = maximum; });
  if (key == "reference")
    return setters(std::vector{read_reference(place)}, [](Draft& d, const GivenReference& given) { d.cell.reference = given; });
  if (key == "gate") return setters(std::vector{read_gate(place)}, [](Draft& d, const GateSpec& gate) { d.cell.gate = gate; });
  const bool flag = place.boolean();
  return {key == "images" ? Setter([flag](Draft& d) { d.cell.images = flag; })
                          : Setter([flag](Draft& d) { d.cell.own_streams = flag; })};
}

/// A key that has one value outside a matrix.
void apply_single(const Place& object, const std::string& key, Draft& draft) {
  if (!object.has(key.c_str())) return;
  const Place place = object[key];
  const std::vector<Setter> values = read_axis(key, place);
  if (values.size() != 1)
    place.fail(fmt::format("found {} values; expected one here, sweeps belong into \"matrix\"", values.size()));
  values[0](draft);
}

void refuse_two_sample_counts(const Place& object) {
  if (object.has("samples_per_ray") && object.has("equal_lookups"))
    object["equal_lookups"].fail("found beside \"samples_per_ray\"; expected one of the two");
}

template <class Pattern, class Select>
Test any_matches(const std::vector<Pattern>& patterns, Select select) {
  return [patterns, select](const Draft& draft) {
    return std::any_of(patterns.begin(), patterns.end(), [&](const Pattern& pattern) { return select(draft, pattern); });
  };
}

Test read_test(const std::string& key, const Place& place) {
  if (key == "estimator")
    return any_matches(read_component_patterns(ComponentKind::estimator, place),
                       [](const Draft& d, const Component& c) { return matches(c, *d.estimator); });
  if (key == "majorant")
    return any_matches(read_component_patterns(ComponentKind::majorant, place),
                       [](const Draft& d, const Component& c) { return matches(c, *d.majorant); });
  if (key == "rays")
    return any_matches(read_component_patterns(ComponentKind::ray_set, place),
                       [](const Draft& d, const Component& c) { return matches(c, *d.rays); });
  if (key == "medium")
    return any_matches(read_medium_patterns(place), [](const Draft& d, const MediumSpec& m) { return matches(m, *d.medium); });
  if (key == "quantity")
    return any_matches(each(place, read_quantity), [](const Draft& d, Quantity q) { return d.cell.quantity == q; });
  if (key == "precision")
    return any_matches(each(place, read_precision), [](const Draft& d, Precision p) { return d.cell.precision == p; });
  if (key == "measurement")
    return any_matches(each(place, read_measurement),
                       [](const Draft& d, const Measurement& m) { return d.cell.measurement == m; });
  if (key == "transport")
    return any_matches(each(place, read_transport), [](const Draft& d, const TransportSpec& t) { return d.cell.transport == t; });
  if (key == "seed")
    return any_matches(each(place, [](const Place& at) { return at.unsigned_integer(0); }),
                       [](const Draft& d, std::uint64_t seed) { return d.cell.seed == seed; });
  if (key == "samples_per_ray")
    return any_matches(each(place, read_samples), [](const Draft& d, std::uint64_t samples) {
      return !d.cell.equal_lookups && d.cell.samples_per_ray == samples;
    });
  return any_matches(each(place, [](const Place& at) { return at.positive(); }),
                     [](const Draft& d, Real lookups) { return d.cell.equal_lookups == lookups; });
}

}  // namespace

Test read_pattern(const Place& place, const std::vector<std::string>& also) {
  place.expect_keys(joined(kAxes, also));
  std::vector<Test> tests;
  for (const std::string& key : kAxes)
    if (place.has(key.c_str())) tests.push_back(read_test(key, place[key]));
  return [tests](const Draft& draft) { return std::all_of(tests.begin(), tests.end(), [&](const Test& t) { return t(draft); }); };
}

namespace {

/// Axes that advance together, as one list of changes.
using Group = std::vector<Setter>;

std::vector<Group> read_matrix(const Place& experiment) {
  const Place matrix = experiment["matrix"];
  matrix.expect_keys(kAxes);
  refuse_two_sample_counts(matrix);
  std::map<std::string, std::size_t> group_of;
  std::vector<std::vector<std::string>> zipped;
  if (experiment.has("zip"))
    for (const Place& list : experiment["zip"].elements()) {
      zipped.emplace_back();
      for (const Place& name : list.elements()) {
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
      if (member == members.front()) group.assign(values.size(), [](Draft&) {});
      if (values.size() != group.size())
        matrix[member].fail(fmt::format("found {} values; expected {}, as many as \"{}\" it is zipped with", values.size(),
                                        group.size(), members.front()));
      for (std::size_t i = 0; i < values.size(); ++i)
        group[i] = [before = group[i], value = values[i]](Draft& draft) {
          before(draft);
          value(draft);
        };
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

void require_complete(const Place& place, const Draft& draft) {
  const auto missing = [&](const char* key) {
    place.fail(fmt::format("\"{}\" is missing; expected it here or in \"matrix\"", key));
  };
  if (!draft.estimator) missing("estimator");
  if (!draft.medium) missing("medium");
  if (!draft.rays) missing("rays");
  if (!draft.has_samples) missing("samples_per_ray");
}

std::vector<Draft> expand_matrix(const Place& experiment, const Draft& base) {
  std::vector<Draft> drafts = {base};
  for (const Group& group : read_matrix(experiment)) {
    expect_cells(experiment["matrix"], drafts.size(), group.size());
    std::vector<Draft> next;
    next.reserve(drafts.size() * group.size());
    for (const Draft& draft : drafts)
      for (const Setter& set : group) {
        next.push_back(draft);
        set(next.back());
      }
    drafts = std::move(next);
  }
  require_complete(experiment, drafts.front());

  std::vector<Test> unwanted;
  if (experiment.has("exclude"))
    for (const Place& pattern : experiment["exclude"].elements()) unwanted.push_back(read_pattern(pattern));
  if (experiment.has("constraints"))
    for (const Place& constraint : experiment["constraints"].elements()) {
      constraint.expect_keys({"if", "then"});
      unwanted.push_back([premise = read_pattern(constraint["if"]), conclusion = read_pattern(constraint["then"])](
                             const Draft& draft) { return premise(draft) && !conclusion(draft); });
    }
  const auto drop = [&](const Draft& draft) {
    return std::any_of(unwanted.begin(), unwanted.end(), [&](const Test& test) { return test(draft); });
  };
  drafts.erase(std::remove_if(drafts.begin(), drafts.end(), drop), drafts.end());
  return drafts;
}

}  // namespace

const std::vector<std::string>& axes() { return kAxes; }

bool agree_on(const std::string& axis, const Draft& a, const Draft& b) {
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

std::vector<Draft> read_experiment(const Place& place, std::uint64_t seed) {
  place.expect_keys(joined(joined(kAxes, kSingle), {"name", "matrix", "zip", "exclude", "include", "constraints"}));
  refuse_two_sample_counts(place);
  Draft base;
  base.experiment = base.cell.experiment = place["name"].string();
  if (base.experiment.empty()) place["name"].expected("a name that is not empty");
  base.cell.seed = seed;
  static const Json kGlobal = "global";
  base.majorant = read_components(ComponentKind::majorant, Place(kGlobal, place.file(), place.pointer()))[0];
  for (const std::string& key : joined(kAxes, kSingle)) apply_single(place, key, base);

  std::vector<Draft> drafts;
  if (place.has("matrix"))
    drafts = expand_matrix(place, base);
  else if (!place.has("include"))
    place.fail("found neither \"matrix\" nor \"include\"; expected at least one");
  else
    for (const char* key : {"zip", "exclude", "constraints"})
      if (place.has(key)) place[key].fail("found without \"matrix\", to which it applies");
  if (place.has("include"))
    for (const Place& entry : place["include"].elements()) {
      entry.expect_keys(joined(kAxes, kSingle));
      refuse_two_sample_counts(entry);
      drafts.push_back(base);
      for (const std::string& key : joined(kAxes, kSingle)) apply_single(entry, key, drafts.back());
      require_complete(entry, drafts.back());
    }
  if (drafts.empty()) place.fail("found no cell after \"exclude\" and \"constraints\"; expected at least one");
  return drafts;
}

}  // namespace nullmark
