#include "harness/config/cell_patterns.h"

#include <fmt/format.h>

#include <algorithm>

namespace nullmark {

CellPatterns::CellPatterns(const Plan& plan, std::size_t first, std::span<const ConfiguredCell> cells,
                           std::vector<std::string> experiments)
    : plan_(&plan), first_(first), cells_(cells), experiments_(std::move(experiments)) {
  for (const Cell& cell : plan.cells) judged_.emplace(cell.name, cell.verdict.enabled);
}

std::string CellPatterns::named(const JsonNode& node) const {
  node.expect_keys({"cell"});
  std::string wanted = node["cell"].string();
  if (judged_.count(wanted) == 0) {
    std::vector<std::string> names;
    for (const auto& [name, judged] : judged_) names.push_back(name);
    node["cell"].unknown("cell", wanted, names);
  }
  return wanted;
}

bool CellPatterns::is_judged(const std::string& name) const { return judged_.at(name); }

std::vector<std::size_t> CellPatterns::matching(const JsonNode& node) const {
  const Test test = read_pattern(node, {"experiment"});
  const std::string experiment = node.has("experiment") ? node["experiment"].one_of(experiments_, "experiment") : "";
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < cells_.size(); ++i)
    if ((experiment.empty() || cells_[i].experiment == experiment) && test(cells_[i])) found.push_back(i);
  return found;
}

std::string CellPatterns::described(std::size_t configured) const {
  const ConfiguredCell& found = cells_[configured];
  return fmt::format("{}: {}/{}/{}", found.experiment, (*found.estimator)->label, (*found.medium)->label,
                     (*found.majorant)->label);
}

void CellPatterns::matches_none(const JsonNode& node, const char* expected) const {
  for (const auto& [key, value] : node.json().items()) {
    if (key == "experiment" || key.rfind("x-", 0) == 0) continue;
    Json alone = {{key, value}};
    if (node.has("experiment")) alone["experiment"] = node.json().at("experiment");
    if (matching(JsonNode(alone, node.file(), node.pointer())).empty())
      node.fail(fmt::format("matches no cell; expected {}, and no cell has this \"{}\"", expected, key));
  }
  node.fail(fmt::format("matches no cell; expected {}, but its keys match different cells", expected));
}

std::string CellPatterns::one(const JsonNode& node) const {
  node.expect_object();
  if (node.has("cell")) return named(node);
  const std::vector<std::size_t> found = matching(node);
  if (found.empty()) matches_none(node, "exactly one");
  if (found.size() > 1)
    node.fail(fmt::format("matches {} cells, among them \"{}\" and \"{}\"; expected exactly one", found.size(),
                          described(found[0]), described(found[1])));
  return name(found[0]);
}

std::vector<std::string> CellPatterns::all(const JsonNode& node) const {
  std::vector<std::string> names;
  for (const JsonNode& entry : node.elements_or_self()) {
    entry.expect_object();
    if (entry.has("cell")) {
      names.push_back(named(entry));
      continue;
    }
    const std::vector<std::size_t> found = matching(entry);
    if (found.empty()) matches_none(entry, "at least one");
    for (const std::size_t configured : found) names.push_back(name(configured));
  }
  if (names.empty()) node.expected("at least one pattern of cells");
  return names;
}

namespace {

/// Whether two components of one type differ in no parameter but those that a pattern names.
bool agree_beside(const JsonNode& pattern, const Component& a, const Component& b) {
  if (a.type != b.type) return false;
  for (const auto& [name, value] : a.values) {
    const bool named = std::any_of(pattern.json().begin(), pattern.json().end(),
                                   [&, key = name](const Json& one) { return one.is_object() && one.contains(key); }) ||
                       (pattern.json().is_object() && pattern.has(name.c_str()));
    if (!named && value != b.values.at(name)) return false;
  }
  return true;
}

}  // namespace

std::vector<std::string> CellPatterns::counterparts(const JsonNode& of, const JsonNode& node) const {
  if (node.json().is_array() || node.has("cell")) return all(node);
  const std::vector<std::size_t> candidates = matching(node);
  if (candidates.empty()) matches_none(node, "a counterpart for each of \"cells\"");
  std::vector<std::string> names;
  for (const JsonNode& entry : of.elements_or_self()) {
    if (entry.has("cell")) node.fail("named cells need named counterparts: a list of {\"cell\": name}");
    for (const std::size_t configured : matching(entry)) {
      std::vector<std::size_t> found;
      for (const std::size_t candidate : candidates) {
        const auto agree = [&](const Axis& axis) {
          return node.has(axis.name.c_str()) || axis.agree(cells_[configured], cells_[candidate]);
        };
        const bool same = node.has("experiment") || cells_[configured].experiment == cells_[candidate].experiment;
        if (same && std::all_of(axes().begin(), axes().end(), agree)) found.push_back(candidate);
      }
      if (found.empty())
        node.fail(fmt::format("finds no counterpart of \"{}\"; expected one that differs from it only in what this pattern names",
                              described(configured)));
      // Of several, those that are as the cell itself in what the pattern leaves open.
      std::vector<std::size_t> alike = found;
      if (found.size() > 1 && node.has("estimator"))
        std::erase_if(alike, [&](std::size_t candidate) {
          return !agree_beside(node["estimator"], **cells_[configured].estimator, **cells_[candidate].estimator);
        });
      if (alike.size() == 1) found = alike;
      if (found.size() > 1)
        node.fail(
            fmt::format("finds {} counterparts of \"{}\", among them \"{}\" and \"{}\"; expected a pattern that tells them apart",
                        found.size(), described(configured), name(found[0]), name(found[1])));
      names.push_back(name(found[0]));
    }
  }
  return names;
}

}  // namespace nullmark
