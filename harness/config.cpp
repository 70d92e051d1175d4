#include "harness/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <map>
#include <set>

#include "harness/cell_names.h"
#include "harness/component_reader.h"
#include "harness/metrics.h"
#include "harness/names.h"
#include "harness/spec_json.h"
#include "harness/transport_json.h"

namespace nullmark {
namespace {

/// A cell while its experiment is expanded: specifications in place of indices.
struct Draft {
  std::optional<Component> estimator, rays;
  std::optional<MediumSpec> medium;
  std::optional<Component> majorant;
  bool has_samples = false;
  Cell cell;
};

using Setter = std::function<void(Draft&)>;
using Test = std::function<bool(const Draft&)>;

constexpr std::uint64_t kAny = std::numeric_limits<std::uint64_t>::max();

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

Real read_positive(const Place& place) {
  const Real value = place.number();
  if (!(value > 0) || !std::isfinite(value)) place.expected("a finite number > 0");
  return value;
}

GateSpec read_gate(const Place& place) {
  place.expect_keys({"enabled", "epsilon", "max_samples_per_ray", "max_lookups_per_ray", "laws"});
  GateSpec gate;
  if (place.has("enabled")) gate.enabled = place["enabled"].boolean();
  if (place.has("epsilon")) gate.epsilon = read_positive(place["epsilon"]);
  if (place.has("max_samples_per_ray"))
    gate.max_samples_per_ray = place["max_samples_per_ray"].unsigned_integer(0, std::uint64_t{1} << 53);
  if (place.has("max_lookups_per_ray")) gate.max_lookups_per_ray = read_positive(place["max_lookups_per_ray"]);
  if (place.has("laws")) {
    const std::string policy = place["laws"].one_of(law_policies(), "policy");
    gate.laws = static_cast<LawPolicy>(std::find(law_policies().begin(), law_policies().end(), policy) - law_policies().begin());
  }
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
    const auto read = [](const Place& at) { return at.unsigned_integer(0, kAny); };
    return setters(each(place, read), [](Draft& d, std::uint64_t seed) { d.cell.seed = seed; });
  }
  if (key == "samples_per_ray")
    return setters(each(place, read_samples), [](Draft& d, std::uint64_t samples) {
      d.has_samples = true;
      d.cell.samples_per_ray = samples;
      d.cell.equal_lookups.reset();
    });
  if (key == "equal_lookups")
    return setters(each(place, read_positive), [](Draft& d, Real lookups) {
      d.has_samples = true;
      d.cell.samples_per_ray = 1;
      d.cell.equal_lookups = lookups;
    });
  if (key == "image_maximum")
    return setters(std::vector{read_positive(place)}, [](Draft& d, Real maximum) { d.cell.image_maximum = maximum; });
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
    return any_matches(each(place, [](const Place& at) { return at.unsigned_integer(0, kAny); }),
                       [](const Draft& d, std::uint64_t seed) { return d.cell.seed == seed; });
  if (key == "samples_per_ray")
    return any_matches(each(place, read_samples), [](const Draft& d, std::uint64_t samples) {
      return !d.cell.equal_lookups && d.cell.samples_per_ray == samples;
    });
  return any_matches(each(place, read_positive), [](const Draft& d, Real lookups) { return d.cell.equal_lookups == lookups; });
}

/// A partial cell; all keys that are given must match.  Keys in `also` are someone else's.
Test read_pattern(const Place& place, const std::vector<std::string>& also = {}) {
  place.expect_keys(joined(kAxes, also));
  std::vector<Test> tests;
  for (const std::string& key : kAxes)
    if (place.has(key.c_str())) tests.push_back(read_test(key, place[key]));
  return [tests](const Draft& draft) { return std::all_of(tests.begin(), tests.end(), [&](const Test& t) { return t(draft); }); };
}

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

std::vector<Draft> read_experiment(const Place& place, std::uint64_t seed) {
  place.expect_keys(joined(joined(kAxes, kSingle), {"name", "matrix", "zip", "exclude", "include", "constraints"}));
  refuse_two_sample_counts(place);
  Draft base;
  base.cell.experiment = place["name"].string();
  if (base.cell.experiment.empty()) place["name"].expected("a name that is not empty");
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

/// Lists what cells refer to, equal specifications once.
class PlanBuilder {
 public:
  explicit PlanBuilder(Plan& plan) : plan_(plan) {}

  void add(const Draft& draft) {
    Cell cell = draft.cell;
    cell.estimator = *draft.estimator;
    cell.medium = media_.index_of(plan_.media, *draft.medium);
    plan_.media[cell.medium].optional &= draft.medium->optional;
    cell.majorant = majorants_.index_of(plan_.majorants, *draft.majorant);
    cell.rays = ray_sets_.index_of(plan_.ray_sets, *draft.rays);
    plan_.cells.push_back(std::move(cell));
  }

 private:
  /// Finds among thousands by label, which equal specifications share.
  class Index {
   public:
    template <class Spec>
    std::size_t index_of(std::vector<Spec>& list, const Spec& spec) {
      std::vector<std::size_t>& places = of_label_[spec.label];
      for (const std::size_t place : places)
        if (list[place] == spec) return place;
      places.push_back(list.size());
      list.push_back(spec);
      return list.size() - 1;
    }

   private:
    std::map<std::string, std::vector<std::size_t>> of_label_;
  };

  Plan& plan_;
  Index media_, majorants_, ray_sets_;
};

bool same_statistics(const Draft& a, const Draft& b) {
  return a.cell.experiment == b.cell.experiment && a.estimator == b.estimator && a.medium == b.medium &&
         a.majorant == b.majorant && a.rays == b.rays && a.cell.quantity == b.cell.quantity &&
         a.cell.precision == b.cell.precision && a.cell.measurement == b.cell.measurement &&
         a.cell.transport == b.cell.transport && a.cell.samples_per_ray == b.cell.samples_per_ray &&
         a.cell.equal_lookups == b.cell.equal_lookups && a.cell.seed == b.cell.seed && a.cell.own_streams == b.cell.own_streams;
}

std::vector<std::uint64_t> read_batches(const Place& place) {
  const auto one = [](const Place& number) { return number.unsigned_integer(1, 1u << 20); };
  if (!place.json().is_array()) return {one(place)};
  std::vector<std::uint64_t> batches;
  for (const Place& element : place.elements()) {
    batches.push_back(one(element));
    if (batches.size() > 1 && batches.back() <= batches[batches.size() - 2]) element.expected("more than the number before it");
  }
  if (batches.empty()) place.expected("at least one number");
  return batches;
}

TimingPlan read_timing(const Place& place) {
  place.expect_keys({"enabled", "repetitions", "seconds", "samples_per_traversal"});
  TimingPlan timing;
  if (place.has("enabled")) timing.enabled = place["enabled"].boolean();
  if (place.has("repetitions")) timing.repetitions = static_cast<int>(place["repetitions"].integer(1, 10'000));
  if (place.has("seconds")) timing.seconds = read_positive(place["seconds"]);
  if (place.has("samples_per_traversal")) timing.samples_per_traversal = read_batches(place["samples_per_traversal"]);
  return timing;
}

Real read_level(const Place& place) {
  const Real value = place.number();
  if (!(value > 0 && value < 1)) place.expected("a number between 0 and 1");
  return value;
}

GateLevels read_levels(const Place& place) {
  place.expect_keys({"alpha", "alpha_pass"});
  GateLevels levels;
  if (place.has("alpha")) levels.alpha = read_level(place["alpha"]);
  if (place.has("alpha_pass")) levels.alpha_pass = read_level(place["alpha_pass"]);
  return levels;
}

bool agree(const TimingPlan& a, const TimingPlan& b) {
  return a.enabled == b.enabled && a.repetitions == b.repetitions && a.seconds == b.seconds &&
         a.samples_per_traversal == b.samples_per_traversal;
}

/// A table's reference to a cell: by its place among the file's cells, or by the name it will have.
struct Selector {
  std::optional<std::size_t> cell;
  std::string name;
  std::string where;
};

struct DraftRow {
  TableRow row;
  std::vector<Selector> cells;
  std::optional<Selector> theory, relative_to;
};

struct DraftTable {
  Table table;
  std::vector<DraftRow> rows;
};

/// One file, expanded, before cells have names.
struct DraftPlan {
  std::string file, name;
  TimingPlan timing;
  GateLevels levels;
  std::vector<Draft> cells;
  std::vector<DraftTable> tables;
  std::map<std::string, std::string> credits;
};

Selector read_selector(const Place& place, const std::vector<Draft>& drafts, const std::vector<std::string>& experiments) {
  place.expect_object();
  Selector selector;
  selector.where = place.where();
  if (place.has("cell")) {
    place.expect_keys({"cell"});
    selector.name = place["cell"].string();
    return selector;
  }
  const Test test = read_pattern(place, {"experiment", "cell"});
  const std::string experiment = place.has("experiment") ? place["experiment"].one_of(experiments, "experiment") : "";
  std::vector<std::string> found;
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    if ((!experiment.empty() && drafts[i].cell.experiment != experiment) || !test(drafts[i])) continue;
    selector.cell = i;
    found.push_back(fmt::format("{}: {}/{}/{}", drafts[i].cell.experiment, drafts[i].estimator->label, drafts[i].medium->label,
                                drafts[i].majorant->label));
  }
  if (found.empty()) place.fail("matches no cell; expected exactly one");
  if (found.size() > 1)
    place.fail(
        fmt::format("matches {} cells, among them \"{}\" and \"{}\"; expected exactly one", found.size(), found[0], found[1]));
  return selector;
}

DraftTable read_table(const Place& place, const std::vector<Draft>& drafts, const std::vector<std::string>& experiments) {
  place.expect_keys({"title", "metric", "rows"});
  DraftTable draft;
  draft.table.title = place["title"].string();
  if (place.has("metric")) draft.table.metric = place["metric"].one_of(metric_names(), "metric");
  for (const Place& entry : place["rows"].elements()) {
    entry.expect_keys({"label", "given", "cells", "theory", "note", "relative_to", "tolerance"});
    DraftRow row;
    row.row.label = entry["label"].string();
    if (entry.has("note")) row.row.note = entry["note"].string();
    if (entry.has("given")) {
      entry["given"].expect_object();
      for (const auto& [heading, json] : entry["given"].json().items())
        row.row.given.emplace_back(heading, entry["given"][heading].number());
    }
    if (entry.has("cells")) {
      entry["cells"].expect_object();
      for (const auto& [heading, json] : entry["cells"].json().items()) {
        row.row.cells.emplace_back(heading, "");
        row.cells.push_back(read_selector(entry["cells"][heading], drafts, experiments));
      }
    }
    if (entry.has("theory")) row.theory = read_selector(entry["theory"], drafts, experiments);
    if (entry.has("relative_to")) row.relative_to = read_selector(entry["relative_to"], drafts, experiments);
    if (entry.has("tolerance")) {
      row.row.tolerance = read_positive(entry["tolerance"]);
      if (row.row.given.empty() || row.row.cells.empty())
        entry["tolerance"].fail("needs \"given\" and \"cells\" beside it, which it compares");
    }
    draft.rows.push_back(std::move(row));
  }
  return draft;
}

DraftPlan read_file(const ConfigSource& source, std::optional<std::uint64_t> seed) {
  const Json json = parse_json(source.text, source.file);
  const Place top(json, source.file);
  if (json.is_object() && json.contains("nullmark_schema"))
    throw InputError(source.file + ": these are results; nullmark check, compare and report read them");
  top.expect_object();
  if (json.empty() || json.begin().key() != "$schema")
    top.fail(fmt::format("found {}; expected the first key \"$schema\": \"{}\"",
                         json.empty() ? "an empty object" : "\"" + json.begin().key() + "\"", kConfigSchema));
  if (top["$schema"].string() != kConfigSchema) top["$schema"].expected(fmt::format("\"{}\"", kConfigSchema));
  top.expect_keys({"$schema", "name", "seed", "timing", "verdict", "experiments", "tables", "credits"});

  DraftPlan plan;
  plan.file = source.file;
  plan.name = top.has("name") ? top["name"].string() : std::filesystem::path(source.file).stem().string();
  if (top.has("timing")) plan.timing = read_timing(top["timing"]);
  if (top.has("verdict")) plan.levels = read_levels(top["verdict"]);
  std::uint64_t own_seed = 1;
  if (top.has("seed")) own_seed = top["seed"].unsigned_integer(0, kAny);
  std::vector<std::string> experiments;
  std::map<std::vector<std::string>, std::vector<std::size_t>> of_labels;
  for (const Place& entry : top["experiments"].elements()) {
    for (Draft& draft : read_experiment(entry, seed.value_or(own_seed))) {
      std::vector<std::size_t>& alike = of_labels[{draft.cell.experiment, draft.estimator->label, draft.medium->label,
                                                   draft.majorant->label, draft.rays->label}];
      const auto same = [&](std::size_t other) { return same_statistics(draft, plan.cells[other]); };
      if (std::any_of(alike.begin(), alike.end(), same)) continue;
      alike.push_back(plan.cells.size());
      plan.cells.push_back(std::move(draft));
    }
    const std::string name = entry["name"].string();
    if (std::find(experiments.begin(), experiments.end(), name) != experiments.end())
      entry["name"].fail(fmt::format("\"{}\" is the name of an earlier experiment; expected another", name));
    experiments.push_back(name);
  }
  if (plan.cells.empty()) top["experiments"].expected("at least one experiment");
  if (top.has("tables"))
    for (const Place& entry : top["tables"].elements()) plan.tables.push_back(read_table(entry, plan.cells, experiments));
  if (top.has("credits")) {
    top["credits"].expect_object();
    for (const auto& [name, text] : top["credits"].json().items()) plan.credits[name] = top["credits"][name].string();
  }
  return plan;
}

/// Puts the configuration's name in front of experiments whose names occur in other files too.
void tell_experiments_apart(std::vector<DraftPlan>& files) {
  std::map<std::string, std::set<std::size_t>> owners;
  for (std::size_t i = 0; i < files.size(); ++i)
    for (const Draft& draft : files[i].cells) owners[draft.cell.experiment].insert(i);
  std::map<std::string, std::size_t> taken;
  for (std::size_t i = 0; i < files.size(); ++i)
    for (Draft& draft : files[i].cells) {
      std::string& name = draft.cell.experiment;
      if (owners[name].size() > 1) name = files[i].name + "." + name;
      if (const auto [at, added] = taken.emplace(name, i); !added && at->second != i)
        throw InputError(
            fmt::format("{}: experiment \"{}\" stands in {} as well; expected another \"name\" of the file or experiment",
                        files[i].file, name, files[at->second].file));
    }
}

std::string resolved(const Selector& selector, const Plan& plan, std::size_t first) {
  if (selector.cell) return plan.cells[first + *selector.cell].name;
  std::vector<std::string> names;
  for (const Cell& cell : plan.cells) names.push_back(cell.name);
  if (std::find(names.begin(), names.end(), selector.name) == names.end()) {
    const std::string near = nearest(selector.name, names);
    throw InputError(fmt::format("{}/cell: unknown cell \"{}\"{}", selector.where, selector.name,
                                 near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
  }
  return selector.name;
}

}  // namespace

Plan read_config(const std::string& text, const std::string& file, std::optional<std::uint64_t> seed) {
  return read_configs({{text, file}}, seed);
}

Plan read_configs(const std::vector<ConfigSource>& sources, std::optional<std::uint64_t> seed) {
  std::vector<DraftPlan> files;
  for (const ConfigSource& source : sources) files.push_back(read_file(source, seed));
  if (files.empty()) throw InputError("found no configuration; expected at least one file");
  tell_experiments_apart(files);

  Plan plan;
  plan.timing = files.front().timing;
  plan.levels = files.front().levels;
  PlanBuilder builder(plan);
  for (const DraftPlan& file : files) {
    plan.name += (plan.name.empty() ? "" : "+") + file.name;
    if (!agree(file.timing, plan.timing))
      throw InputError(fmt::format("{}: /timing: differs from that of {}; expected the same, or run the files one by one",
                                   file.file, files.front().file));
    if (!(file.levels == plan.levels))
      throw InputError(fmt::format("{}: /verdict: differs from that of {}; expected the same, or run the files one by one",
                                   file.file, files.front().file));
    for (const Draft& draft : file.cells) builder.add(draft);
    plan.credits.insert(file.credits.begin(), file.credits.end());
  }
  name_cells(plan);
  std::size_t first = 0;
  for (DraftPlan& file : files) {
    for (DraftTable& draft : file.tables) {
      for (DraftRow& row : draft.rows) {
        for (std::size_t i = 0; i < row.cells.size(); ++i) row.row.cells[i].second = resolved(row.cells[i], plan, first);
        if (row.theory) row.row.theory_of = resolved(*row.theory, plan, first);
        if (row.relative_to) row.row.relative_to = resolved(*row.relative_to, plan, first);
        draft.table.rows.push_back(std::move(row.row));
      }
      plan.tables.push_back(std::move(draft.table));
    }
    first += file.cells.size();
  }
  plan.config_text = applied_config(plan);
  return plan;
}

std::vector<ConfigSource> load_configs(const std::vector<std::string>& paths) {
  namespace fs = std::filesystem;
  const auto all = [](std::istream& in) { return std::string(std::istreambuf_iterator<char>(in), {}); };
  std::vector<ConfigSource> sources;
  const auto load = [&](const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in)
      throw InputError(path.string() + (fs::exists(path) ? ": cannot be read; expected a configuration file" : ": no such file"));
    sources.push_back({all(in), path.string()});
  };
  for (const std::string& path : paths) {
    if (path == "-") {
      sources.push_back({all(std::cin), "<stdin>"});
    } else if (fs::is_directory(path)) {
      std::vector<fs::path> files;
      for (const auto& entry : fs::directory_iterator(path))
        if (entry.path().extension() == ".json" && entry.is_regular_file()) files.push_back(entry.path());
      if (files.empty()) throw InputError(path + ": found no *.json; expected configuration files");
      std::sort(files.begin(), files.end());
      for (const fs::path& file : files) load(file);
    } else {
      load(path);
    }
  }
  return sources;
}

}  // namespace nullmark
