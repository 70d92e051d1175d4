#include "harness/performance_gate/required.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "harness/io/json_input.h"

namespace nullmark {
namespace {

constexpr std::pair<const char*, Tier> kWords[] = {
    {"counts", Tier::counts},       {"expected", Tier::expected}, {"instructions", Tier::instructions},
    {"wall-time", Tier::wall_time}, {"misses", Tier::misses},     {"start-up", Tier::start_up}};

bool holds(const CellCounts& cell, Tier tier) {
  switch (tier) {
    case Tier::counts:
      return true;
    case Tier::expected:
      return cell.lookups_theory.has_value();
    case Tier::instructions:
      return cell.instructions.has_value();
    case Tier::misses:
      return cell.misses.has_value();
    case Tier::wall_time:
    case Tier::start_up:
      break;
  }
  return false;
}

/// "3 of 17 cells, for example NAME"; nothing where there are none.
std::string told(const std::vector<std::string>& cells, std::size_t all) {
  if (cells.empty()) return "";
  return fmt::format("{} of {} cell{}, for example {}", cells.size(), all, all == 1 ? "" : "s", cells[0]);
}

/// Names of the cells of which `before` holds the tier and `after` does not.
std::string lacking(const Counts& before, const Counts& after, Tier tier) {
  std::map<std::string, const CellCounts*> later;
  for (const CellCounts& cell : after.cells) later.emplace(cell.name, &cell);
  std::vector<std::string> lack;
  for (const CellCounts& cell : before.cells) {
    if (!holds(cell, tier)) continue;
    const auto at = later.find(cell.name);
    if (at == later.end() ? !after.partial : !holds(*at->second, tier)) lack.push_back(cell.name);
  }
  return told(lack, before.cells.size());
}

/// Names of the cells of which `before` holds the tier, and the report has no comparison.
std::string left_out(const PerformanceReport& report, const Counts& before, const Counts& after, Tier tier) {
  std::set<std::string> compared, later;
  for (const GateRow& row : report.rows)
    if (row.tier == tier && row.finding != GateResult::not_compared) compared.insert(row.cell);
  for (const CellCounts& cell : after.cells) later.insert(cell.name);
  std::vector<std::string> out;
  for (const CellCounts& cell : before.cells)
    if (holds(cell, tier) && compared.count(cell.name) == 0 && !(after.partial && later.count(cell.name) == 0))
      out.push_back(cell.name);
  return told(out, before.cells.size());
}

}  // namespace

std::vector<std::string> required_words() {
  std::vector<std::string> words;
  for (const auto& [word, tier] : kWords) words.emplace_back(word);
  return words;
}

Tier required_tier(const std::string& word) {
  for (const auto& [known, tier] : kWords)
    if (word == known) return tier;
  throw InputError(fmt::format("--require: found \"{}\"; expected {}", word, fmt::join(required_words(), ", ")));
}

std::vector<std::string> missing_tiers(const PerformanceReport& report, const Counts& before, const Counts& after,
                                       const std::optional<std::vector<Tier>>& required) {
  std::vector<std::string> missing;
  for (const Tier tier : kTiers) {
    if (!required) {
      if (tier == Tier::start_up && before.start_up && !after.start_up)
        missing.push_back(fmt::format("{}: {} has it, {} does not", to_string(tier), before.source, after.source));
      else if (const std::string cells = lacking(before, after, tier); !cells.empty())
        missing.push_back(fmt::format("{}: {} has them, {} does not: {}", to_string(tier), before.source, after.source, cells));
    } else if (std::find(required->begin(), required->end(), tier) != required->end()) {
      if (!report.compared(tier))
        missing.push_back(fmt::format("{}: required, and nothing could be compared", to_string(tier)));
      else if (const std::string cells = left_out(report, before, after, tier); !cells.empty())
        missing.push_back(fmt::format("{}: required, and not compared in {}", to_string(tier), cells));
    }
  }
  return missing;
}

}  // namespace nullmark
