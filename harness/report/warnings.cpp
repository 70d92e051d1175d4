#include "harness/report/warnings.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/io/json_input.h"
#include "harness/run/provenance.h"

namespace nullmark {
namespace {

std::string short_version(const std::map<std::string, std::string>& provenance) {
  const auto json = [&](const char* key) {
    const auto at = provenance.find(key);
    return at == provenance.end() ? Json() : known_json(at->second);
  };
  const Json version = json("version"), git = json("git");
  if (!version.is_string()) return "an unknown version";
  constexpr std::size_t kDigits = 7;
  const bool known = git.is_object() && git.contains("commit") && git["commit"].is_string();
  return known ? fmt::format("{} ({})", version.get<std::string>(), git["commit"].get<std::string>().substr(0, kDigits))
               : version.get<std::string>();
}

}  // namespace

std::string measured_by(const RunRecord& run) { return short_version(run.provenance); }

std::string this_version() { return short_version(make_provenance({}, std::chrono::system_clock::now())); }

std::optional<std::string> version_remark(const RunRecord& run) {
  if (run.provenance.count("version") == 0) return std::nullopt;
  const std::string measured = measured_by(run), read = this_version();
  if (measured == read) return std::nullopt;
  return fmt::format("measured by {}, read by {}; run the configuration again where versions matter", measured, read);
}

std::optional<std::string> single_bound_remark(const RunRecord& run) {
  std::size_t cells = 0;
  const CellRecord* first = nullptr;
  for (const CellRecord& record : run.cells) {
    const std::string& type = record.majorant->type;
    if (!record.structure || record.structure->cells != 1 || record.medium->field.type == "homogeneous" ||
        (type != "kd_tree" && type != "octree"))
      continue;
    ++cells;
    if (!first) first = &record;
  }
  if (!first) return std::nullopt;
  return fmt::format(
      "in {} of {} cells a tree of bounds has one bound, as \"global\" has, such as {} on {}; `nullmark list majorants {}` tells "
      "the options that decide its splits",
      cells, run.cells.size(), first->majorant->label, first->medium->label, first->majorant->type);
}

std::optional<std::string> busy_remark(const RunRecord& run) {
  std::size_t timed = 0, busy = 0;
  Real most = 0;
  for (const CellRecord& record : run.cells) {
    if (!record.time) continue;
    ++timed;
    const Real waiting = record.time->waiting.value_or(0);
    busy += waiting > kBusy;
    most = std::max(most, waiting);
  }
  if (busy == 0) return std::nullopt;
  return fmt::format(
      "{} of {} cells were timed on a busy machine, where the thread waited up to {:.0f} % of the time; time them again on a "
      "quiet one",
      busy, timed, 100 * most);
}

}  // namespace nullmark
