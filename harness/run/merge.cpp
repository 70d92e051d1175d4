#include "harness/run/merge.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>

#include "harness/config/config.h"
#include "harness/io/results_json.h"
#include "harness/io/spec_json.h"
#include "harness/run/cell_draws.h"

namespace nullmark {
namespace {

bool sampled(const CellRecord& record) { return record.status == Status::ok || record.status == Status::error; }

std::string statistics_of(const CellRecord& record) {
  RunRecord run;
  run.cells.push_back(record);
  return statistics_text(run);
}

/// Of two records of a cell the one that tells more.
const CellRecord* better(const CellRecord* a, const CellRecord* b) {
  const auto rank = [](const CellRecord& record) {
    const int told = record.status == Status::ok        ? 3
                     : record.status == Status::error   ? 2
                     : record.status == Status::skipped ? 1
                                                        : 0;
    return told * 2 + (record.time ? 1 : 0);
  };
  return rank(*b) > rank(*a) ? b : a;
}

/// What a run was asked for, shards aside; JSON texts, empty where it does not say.
std::array<std::string, 3> selection(const RunRecord& run) {
  const auto text = [&](const char* key) {
    const auto at = run.provenance.find(key);
    return at == run.provenance.end() ? std::string() : at->second;
  };
  return {text("filter"), text("covering"), text("selected")};
}

/// A value of a configuration, cut where it is long.
std::string value_shown(const Json* value) {
  constexpr std::size_t kMost = 60;
  if (!value) return "nothing";
  const std::string text = value->dump();
  return text.size() <= kMost ? text : text.substr(0, kMost - 3) + "...";
}

/// The first place at which two documents differ, as a JSON pointer with both values; nothing where they are equal.
struct Difference {
  std::string pointer;
  const Json *a, *b;
};
std::optional<Difference> first_difference(const Json& a, const Json& b, const std::string& pointer) {
  if (a == b) return std::nullopt;
  if (a.is_array() && b.is_array() && a.size() == b.size())
    for (std::size_t i = 0; i < a.size(); ++i)
      if (auto found = first_difference(a[i], b[i], fmt::format("{}/{}", pointer, i))) return found;
  if (a.is_object() && b.is_object()) {
    for (const auto& [key, value] : a.items()) {
      if (!b.contains(key)) return Difference{pointer + "/" + key, &value, nullptr};
      if (auto found = first_difference(value, b[key], pointer + "/" + key)) return found;
    }
    for (const auto& [key, value] : b.items())
      if (!a.contains(key)) return Difference{pointer + "/" + key, nullptr, &value};
  }
  return Difference{pointer, &a, &b};
}

/// "/config/seed: found 2, and 1 in a.json".
std::string config_difference(const std::string& text, const std::string& expected, const std::string& where) {
  const Json a = known_json(text), b = known_json(expected);
  const auto found = first_difference(a, b, "/config");
  // Equal values in another order.
  if (!found)
    return fmt::format("/config: found the configuration {}, and {} in {}", config_hash(text), config_hash(expected), where);
  return fmt::format("{}: found {}, and {} in {}", found->pointer, value_shown(found->a), value_shown(found->b), where);
}

struct Found {
  const CellRecord* record;
  std::size_t part;
  std::vector<std::pair<const CellRecord*, std::size_t>> shares{};  ///< records of parts of a split cell
};

/// Cells of all parts by name, each the one that tells most.
std::map<std::string, Found> found_cells(const std::vector<RunRecord>& parts, const std::vector<std::string>& names) {
  std::map<std::string, Found> cells;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    if (parts[part].config_text != parts[0].config_text)
      throw InputError(fmt::format("{}: {}; expected results of one configuration and seed", names[part],
                                   config_difference(parts[part].config_text, parts[0].config_text, names[0])));
    for (const CellRecord& record : parts[part].cells) {
      const auto [at, added] = cells.emplace(record.cell.name, Found{&record, part});
      if (!record.drawn_parts.empty()) at->second.shares.emplace_back(&record, part);
      if (added) continue;
      const CellRecord& other = *at->second.record;
      if (sampled(record) && sampled(other) && statistics_of(record) != statistics_of(other))
        throw InputError(fmt::format("{}: cell \"{}\" has other statistics than in {}; expected the same to the last bit",
                                     names[part], record.cell.name, names[at->second.part]));
      if (better(at->second.record, &record) != &record) continue;
      at->second.record = &record;
      at->second.part = part;
    }
  }
  return cells;
}

/// The data that cells of each medium of the plan were sampled in.
class MediaSeen {
 public:
  explicit MediaSeen(const std::vector<std::string>& names) : names_(names) {}

  /// Throws InputError where others of the medium were sampled in other data.
  void add(std::size_t medium, const CellRecord& record, std::size_t part) {
    if (record.medium_hash.empty()) return;
    const auto [at, fresh] = seen_.emplace(medium, std::pair(record.medium_hash, part));
    if (fresh || at->second.first == record.medium_hash) return;
    throw InputError(fmt::format(
        "{}: cell \"{}\": found the medium {} of hash {}; expected {}, as in {}: its data were replaced; "
        "run its cells again",
        names_[part], record.cell.name, record.medium->label, record.medium_hash, at->second.first, names_[at->second.second]));
  }

 private:
  const std::vector<std::string>& names_;
  std::map<std::size_t, std::pair<std::string, std::size_t>> seen_;
};

/// One record of the parts of a split cell that are there.  Throws InputError where they are damaged or do not fit.
CellRecord joined(const Found& cell, const std::vector<std::string>& names, const std::vector<Build>& made_by) {
  CellRecord whole = *cell.shares.front().first;
  whole.part.clear();
  whole.drawn_parts.clear();
  std::optional<CellDraws> all;
  for (const auto& [record, part] : cell.shares) {
    const std::string where = fmt::format("{}: cell \"{}\"", names[part], record->cell.name);
    expect_joinable(names[part], made_by[part], "this program, which joins parts of cells", this_build(), Builds::same);
    if (!record->build.empty()) throw InputError(where + ": found a part that another build drew; run the shard again");
    if (record->cell.id != whole.cell.id) throw InputError(where + ": found a part of another cell; run the shard again");
    for (const std::string& text : record->drawn_parts) {
      if (std::find(whole.drawn_parts.begin(), whole.drawn_parts.end(), text) != whole.drawn_parts.end()) continue;
      CellDraws draws = read_draws(text, where);
      if (draws.cell != whole.cell.id) throw InputError(where + ": found samples of another cell; run the shard again");
      if (all)
        join(*all, std::move(draws), where);
      else
        all = std::move(draws);
      whole.drawn_parts.push_back(text);
    }
    if (record->time) whole.time = record->time;
  }
  whole.reason = "parts of the cell are drawn; `run CONFIG --resume -o RESULTS` draws the others";
  return whole;
}

}  // namespace

RunRecord merge_results(const std::vector<RunRecord>& parts, const std::vector<std::string>& names, Builds builds) {
  if (parts.empty()) throw InputError("found no results to merge; expected at least one file");
  std::vector<Build> made_by;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    made_by.push_back(build_of(parts[part].provenance));
    expect_joinable(names[part], made_by[part], names[0], made_by[0], builds);
  }
  std::map<std::string, Found> cells = found_cells(parts, names);
  MediaSeen media(names);
  RunRecord merged;
  merged.name = parts[0].name;
  merged.config_text = parts[0].config_text;
  merged.tables = parts[0].tables;
  merged.claims = parts[0].claims;
  merged.provenance = parts[0].provenance;
  Json list = Json::array();
  for (const RunRecord& part : parts) {
    Json one = Json::object();
    for (const auto& [key, text] : part.provenance) one[key] = known_json(text);
    const Json of_parts = one.value("parts", Json());
    if (of_parts.is_array())
      list.insert(list.end(), of_parts.begin(), of_parts.end());
    else
      list.push_back(std::move(one));
  }
  merged.provenance["parts"] = list.dump();
  // Parts of one selection make it whole; those of several are measured by the whole configuration.
  merged.provenance.erase("shard");
  const bool same =
      std::all_of(parts.begin(), parts.end(), [&](const RunRecord& part) { return selection(part) == selection(parts[0]); });
  if (!same) {
    merged.provenance.erase("filter");
    merged.provenance.erase("covering");
    merged.provenance.erase("selected");
  }
  for (const Cell& cell : read_config(parts[0].config_text, names[0] + "#config").cells)
    if (const auto at = cells.find(cell.name); at != cells.end()) {
      const Found& found = at->second;
      for (const auto& [record, part] : found.shares) media.add(cell.medium, *record, part);
      media.add(cell.medium, *found.record, found.part);
      merged.cells.push_back(found.record->status == Status::not_run && !found.shares.empty() ? joined(found, names, made_by)
                                                                                              : *found.record);
      mark_build(merged.cells.back(), made_by[found.part], made_by[0]);
      cells.erase(at);
    }
  if (!cells.empty())
    throw InputError(
        fmt::format("{}: cell \"{}\" is not of its configuration", names[cells.begin()->second.part], cells.begin()->first));
  return merged;
}

}  // namespace nullmark
