#include "harness/config/cell_patterns.h"

#include <fmt/format.h>

#include <algorithm>

namespace nullmark {

CellPatterns::CellPatterns(const Plan& plan, std::size_t first, std::span<const Draft> drafts,
                           std::vector<std::string> experiments)
    : plan_(&plan), first_(first), drafts_(drafts), experiments_(std::move(experiments)) {
  for (const Cell& cell : plan.cells) judged_.emplace(cell.name, cell.gate.enabled);
}

std::string CellPatterns::named(const Place& place) const {
  place.expect_keys({"cell"});
  std::string wanted = place["cell"].string();
  if (judged_.count(wanted) == 0) {
    std::vector<std::string> names;
    for (const auto& [name, judged] : judged_) names.push_back(name);
    place["cell"].unknown("cell", wanted, names);
  }
  return wanted;
}

bool CellPatterns::is_judged(const std::string& name) const { return judged_.at(name); }

std::vector<std::size_t> CellPatterns::matching(const Place& place) const {
  const Test test = read_pattern(place, {"experiment"});
  const std::string experiment = place.has("experiment") ? place["experiment"].one_of(experiments_, "experiment") : "";
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < drafts_.size(); ++i)
    if ((experiment.empty() || drafts_[i].experiment == experiment) && test(drafts_[i])) found.push_back(i);
  return found;
}

std::string CellPatterns::described(std::size_t draft) const {
  const Draft& found = drafts_[draft];
  return fmt::format("{}: {}/{}/{}", found.experiment, found.estimator->label, found.medium->label, found.majorant->label);
}

void CellPatterns::matches_none(const Place& place, const char* expected) const {
  for (const auto& [key, value] : place.json().items()) {
    if (key == "experiment" || key.rfind("x-", 0) == 0) continue;
    Json alone = {{key, value}};
    if (place.has("experiment")) alone["experiment"] = place.json().at("experiment");
    if (matching(Place(alone, place.file(), place.pointer())).empty())
      place.fail(fmt::format("matches no cell; expected {}, and there is none of this \"{}\"", expected, key));
  }
  place.fail(fmt::format("matches no cell; expected {}, but its keys are those of different cells", expected));
}

std::string CellPatterns::one(const Place& place) const {
  place.expect_object();
  if (place.has("cell")) return named(place);
  const std::vector<std::size_t> found = matching(place);
  if (found.empty()) matches_none(place, "exactly one");
  if (found.size() > 1)
    place.fail(fmt::format("matches {} cells, among them \"{}\" and \"{}\"; expected exactly one", found.size(),
                           described(found[0]), described(found[1])));
  return name(found[0]);
}

std::vector<std::string> CellPatterns::all(const Place& place) const {
  std::vector<std::string> names;
  for (const Place& entry : place.elements_or_self()) {
    entry.expect_object();
    if (entry.has("cell")) {
      names.push_back(named(entry));
      continue;
    }
    const std::vector<std::size_t> found = matching(entry);
    if (found.empty()) matches_none(entry, "at least one");
    for (const std::size_t draft : found) names.push_back(name(draft));
  }
  if (names.empty()) place.expected("at least one pattern of cells");
  return names;
}

namespace {

/// Whether two components of one type differ in no parameter but those that a pattern names.
bool agree_beside(const Place& pattern, const Component& a, const Component& b) {
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

std::vector<std::string> CellPatterns::counterparts(const Place& of, const Place& place) const {
  if (place.json().is_array() || place.has("cell")) return all(place);
  const std::vector<std::size_t> candidates = matching(place);
  if (candidates.empty()) matches_none(place, "a counterpart for each of \"cells\"");
  std::vector<std::string> names;
  for (const Place& entry : of.elements_or_self()) {
    if (entry.has("cell")) place.fail("cells that are named need counterparts that are named: a list of {\"cell\": name}");
    for (const std::size_t draft : matching(entry)) {
      std::vector<std::size_t> found;
      for (const std::size_t candidate : candidates) {
        const auto agree = [&](const std::string& axis) {
          return place.has(axis.c_str()) || agree_on(axis, drafts_[draft], drafts_[candidate]);
        };
        const bool same = place.has("experiment") || drafts_[draft].experiment == drafts_[candidate].experiment;
        if (same && std::all_of(axes().begin(), axes().end(), agree)) found.push_back(candidate);
      }
      if (found.empty())
        place.fail(
            fmt::format("finds no counterpart of \"{}\"; expected one that differs from it in what this pattern names, and in "
                        "nothing else",
                        described(draft)));
      // Of several, those that are as the cell itself in what the pattern leaves open.
      std::vector<std::size_t> alike = found;
      if (found.size() > 1 && place.has("estimator"))
        std::erase_if(alike, [&](std::size_t candidate) {
          return !agree_beside(place["estimator"], *drafts_[draft].estimator, *drafts_[candidate].estimator);
        });
      if (alike.size() == 1) found = alike;
      if (found.size() > 1)
        place.fail(
            fmt::format("finds {} counterparts of \"{}\", among them \"{}\" and \"{}\"; expected a pattern that tells them apart",
                        found.size(), described(draft), name(found[0]), name(found[1])));
      names.push_back(name(found[0]));
    }
  }
  return names;
}

}  // namespace nullmark
