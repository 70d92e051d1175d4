#include "harness/analysis/disagreements.h"

#include <fmt/format.h>

#include <map>
#include <set>

#include "harness/io/transport_json.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

/// The pairs of one scene, by the labels of their trackers.
struct ScenePairs {
  std::map<std::string, std::set<std::string>> differ;
  std::set<std::pair<std::string, std::string>> agree;

  /// Two trackers that the given one differs from and that agree with each other.
  std::optional<std::pair<std::string, std::string>> witnesses_against(const std::string& tracker) const {
    const std::set<std::string>& others = differ.at(tracker);
    for (const auto& pair : agree)
      if (pair.first != pair.second && others.contains(pair.first) && others.contains(pair.second)) return pair;
    return std::nullopt;
  }
};

std::string scene_of(const CellRecord& record) {
  std::string scene = fmt::format("{} on {}, {}, {}", record.cell.experiment, record.medium->label, record.majorant->label,
                                  record.ray_set->label);
  if (const std::string transport = transport_label(record.cell.transport); !transport.empty()) scene += ", " + transport;
  return fmt::format("{}, seed {}", scene, record.cell.seed);
}

}  // namespace

std::vector<std::string> disagreements(const RunRecord& run) {
  std::map<std::string, ScenePairs> scenes;
  for (const CellRecord& record : run.cells) {
    if (!record.cell.minus) continue;
    const std::string &first = record.cell.estimator->label, &second = (*record.cell.minus)->label;
    ScenePairs& pairs = scenes[scene_of(record)];
    if (kind_of(record) == Kind::agree) pairs.agree.emplace(first, second);
    if (kind_of(record) == Kind::differ) pairs.differ[first].insert(second);
  }
  std::vector<std::string> sentences;
  for (const auto& [scene, pairs] : scenes)
    for (const auto& [tracker, others] : pairs.differ) {
      if (const auto witnesses = pairs.witnesses_against(tracker)) {
        sentences.push_back(
            fmt::format("{}: {} differs from {} and {}, which agree with each other: {} is biased, or both of them are", scene,
                        tracker, witnesses->first, witnesses->second, tracker));
        continue;
      }
      for (const std::string& other : others)
        sentences.push_back(fmt::format("{}: {} and {} differ: one of them is biased", scene, tracker, other));
    }
  return sentences;
}

}  // namespace nullmark
