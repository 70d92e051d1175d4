#include <map>
#include <set>

#include "harness/model/metrics.h"
#include "harness/report/history_text.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

Json changes_json(const std::vector<CellChange>& changes) {
  Json list = Json::array();
  for (const CellChange& one : changes)
    list.push_back({{"cell", one.cell},
                    {"change", to_string(one.change)},
                    {"before", one.before},
                    {"after", one.after},
                    {"note", one.note}});
  return list;
}

using CellsOf = std::map<std::string, const CellRecord*>;

/// Figures of a cell, one for each result; null where the cell is not in it.
Json series_json(const std::vector<CellsOf>& results, const std::string& name) {
  Json series = {{"name", name},          {"verdict", Json::array()},  {"lookups", Json::array()},
                 {"rmse", Json::array()}, {"variance", Json::array()}, {"ns_per_sample", Json::array()}};
  for (const CellsOf& cells : results) {
    const auto at = cells.find(name);
    const bool there = at != cells.end();
    series["verdict"].push_back(there ? Json(marked_word(*at->second)) : Json());
    for (const auto& [key, what] : {std::pair{"lookups", "lookups_per_sample"},
                                    {"rmse", "rmse"},
                                    {"variance", "variance"},
                                    {"ns_per_sample", "ns_per_sample"}})
      series[key].push_back(there ? number_or_null(metric(*at->second, what)) : Json());
  }
  return series;
}

}  // namespace

Json history_json(const History& history) {
  Json json = {{"nullmark", "history/1"}, {"results", Json::array()}, {"steps", Json::array()}, {"cells", Json::array()}};
  for (const HistoryResult& result : history.results)
    json["results"].push_back({{"file", result.file},
                               {"date", result.date},
                               {"commit", result.commit},
                               {"cpu", result.cpu},
                               {"build", result.build},
                               {"verdicts", verdicts_counted(result.run)}});
  for (std::size_t i = 0; i < history.steps.size(); ++i) {
    const HistoryStep& step = history.steps[i];
    json["steps"].push_back({{"since", step.since},
                             {"says", change_shown(history, i + 1)},
                             {"cells", step.cells},
                             {"compared", step.compared},
                             {"changed", step.changed},
                             {"counts", changes_counted(step)},
                             {"changes", changes_json(step.changes)},
                             {"undecided", changes_json(step.undecided)},
                             {"notes", step.notes},
                             {"time", step.time}});
  }
  std::vector<CellsOf> cells;
  for (const HistoryResult& result : history.results) {
    CellsOf& of = cells.emplace_back();
    for (const CellRecord& record : result.run.cells) of.emplace(record.cell.name, &record);
  }
  std::vector<std::string> names;
  std::set<std::string> seen;
  for (auto result = history.results.rbegin(); result != history.results.rend(); ++result)
    for (const CellRecord& record : result->run.cells)
      if (seen.insert(record.cell.name).second) names.push_back(record.cell.name);
  for (const std::string& name : names) json["cells"].push_back(series_json(cells, name));
  if (!history.steps.empty()) json["says"] = changes_line(history);
  return json;
}

}  // namespace nullmark
