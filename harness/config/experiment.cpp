#include "harness/config/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "harness/config/component_reader.h"
#include "harness/io/spec_json.h"
#include "harness/io/text.h"

namespace nullmark {
namespace {

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// The keys of a cell, with the keys in `also`.
std::vector<std::string> cell_keys(const std::vector<std::string>& also = {}) {
  std::vector<std::string> keys = axis_names();
  for (const SharedKey& key : shared_keys()) keys.push_back(key.name);
  return joined(std::move(keys), also);
}

const Axis& axis_named(const std::string& name) {
  return *std::find_if(axes().begin(), axes().end(), [&](const Axis& axis) { return axis.name == name; });
}

/// Gives a cell the values that stand outside a matrix, one for each key.
void apply_keys(const JsonNode& object, ConfiguredCell& configured) {
  for (const Axis& axis : axes()) {
    if (!object.has(axis.name.c_str())) continue;
    const JsonNode node = object[axis.name];
    const std::vector<Setter> values = axis.read(node);
    if (values.size() != 1)
      node.fail(fmt::format("found {} values; expected one here, sweeps belong into \"matrix\"", values.size()));
    values[0](configured);
  }
  for (const SharedKey& key : shared_keys())
    if (object.has(key.name.c_str())) key.read(object[key.name])(configured);
}

void refuse_two_sample_counts(const JsonNode& object) {
  if (object.has("samples_per_ray") && object.has("equal_lookups"))
    object["equal_lookups"].fail("found beside \"samples_per_ray\"; expected one of the two");
}

}  // namespace

Test read_pattern(const JsonNode& node, const std::vector<std::string>& also) {
  node.expect_keys(joined(axis_names(), also));
  std::vector<Test> tests;
  for (const Axis& axis : axes())
    if (node.has(axis.name.c_str())) tests.push_back(axis.pattern(node[axis.name]));
  return [tests](const ConfiguredCell& configured) {
    return std::all_of(tests.begin(), tests.end(), [&](const Test& t) { return t(configured); });
  };
}

namespace {

/// Axes that advance together, as one list of changes.
using Group = std::vector<Setter>;

std::vector<Group> read_matrix(const JsonNode& experiment) {
  const JsonNode matrix = experiment["matrix"];
  matrix.expect_keys(axis_names());
  refuse_two_sample_counts(matrix);
  std::map<std::string, std::size_t> group_of;
  std::vector<std::vector<std::string>> zipped;
  if (experiment.has("zip"))
    for (const JsonNode& list : experiment["zip"].elements()) {
      zipped.emplace_back();
      for (const JsonNode& name : list.elements()) {
        const std::string key = name.one_of(axis_names(), "axis");
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
      const std::vector<Setter> values = axis_named(member).read(matrix[member]);
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

void refuse_renamed(const JsonNode& node, const char* before, const char* now) {
  if (node.has(before)) node[before].fail(fmt::format("is called \"{}\" since {}", now, kConfigVersion));
}

std::vector<ConfiguredCell> read_experiment(const JsonNode& node, std::uint64_t seed) {
  refuse_renamed(node, "gate", "verdict");
  node.expect_keys(cell_keys({"name", "matrix", "zip", "exclude", "include", "constraints"}));
  refuse_two_sample_counts(node);
  ConfiguredCell base;
  base.experiment = base.cell.experiment = printable(node["name"].string());
  if (base.experiment.empty()) node["name"].expected("a name that is not empty");
  base.cell.seed = seed;
  static const Json kGlobal = "global";
  base.majorant = read_components(ComponentKind::majorant, JsonNode(kGlobal, node.file(), node.pointer()))[0];
  apply_keys(node, base);

  std::vector<ConfiguredCell> cells;
  if (node.has("matrix"))
    cells = expand_matrix(node, base);
  else if (!node.has("include"))
    node.fail("found neither \"matrix\" nor \"include\"; expected at least one");
  else
    for (const char* key : {"zip", "exclude", "constraints"})
      if (node.has(key)) node[key].fail("found without \"matrix\", to which it applies");
  if (node.has("include"))
    for (const JsonNode& entry : node["include"].elements()) {
      refuse_renamed(entry, "gate", "verdict");
      entry.expect_keys(cell_keys());
      refuse_two_sample_counts(entry);
      cells.push_back(base);
      apply_keys(entry, cells.back());
      require_complete(entry, cells.back());
    }
  if (cells.empty()) node.fail("found no cell after \"exclude\" and \"constraints\"; expected at least one");
  return cells;
}

}  // namespace nullmark
