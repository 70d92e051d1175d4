#include "harness/config/cell_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "harness/io/cell_texts.h"
#include "harness/io/transport_json.h"
#include "harness/model/names.h"
#include "harness/registry/components.h"

namespace nullmark {
namespace {

/// What may tell cells of an experiment apart beside estimator, medium and majorant.
std::array<std::string, 7> distinctions(const Plan& plan, const Cell& cell) {
  const Measurement& measurement = cell.measurement;
  std::string measured = measurement.clamp ? "clamped" : "unclamped";
  if (measurement.quantise_bits > 0) measured += fmt::format("/quantise_bits:{}", measurement.quantise_bits);
  return {
      fmt::format("seed:{}", cell.seed),
      to_string(cell.quantity),
      plan.ray_sets[cell.rays]->label,
      cell.equal_lookups ? fmt::format("equal_lookups:{}", *cell.equal_lookups) : fmt::format("samples:{}", cell.samples_per_ray),
      measured,
      transport_label(cell.transport),
      cell.own_streams ? "own_streams" : "common_streams"};
}

std::map<std::string, std::vector<Cell*>> cells_by_name(Plan& plan) {
  std::map<std::string, std::vector<Cell*>> groups;
  for (Cell& cell : plan.cells) groups[cell.name].push_back(&cell);
  return groups;
}

void add_experiments_where_needed(Plan& plan) {
  for (const auto& [name, cells] : cells_by_name(plan))
    for (const Cell* cell : cells)
      if (cell->experiment != cells.front()->experiment) {
        for (Cell& each : plan.cells) each.name = each.experiment + "/" + each.name;
        return;
      }
}

void add_distinctions(const Plan& plan, const std::vector<Cell*>& cells) {
  std::vector<std::array<std::string, 7>> words;
  words.reserve(cells.size());
  for (const Cell* cell : cells) words.push_back(distinctions(plan, *cell));
  for (std::size_t i = 0; i < words[0].size(); ++i) {
    if (std::all_of(words.begin(), words.end(), [&](const auto& own) { return own[i] == words[0][i]; })) continue;
    for (std::size_t c = 0; c < cells.size(); ++c)
      if (!words[c][i].empty()) cells[c]->name += "/" + words[c][i];
  }
}

}  // namespace

void name_cells(Plan& plan) {
  CellTexts texts(plan);
  for (Cell& cell : plan.cells) {
    cell.id = texts.id(cell);
    cell.name = fmt::format("{}{}/{}/{}", cell.estimator->label, cell.minus ? "/minus:" + (*cell.minus)->label : "",
                            plan.media[cell.medium]->label, plan.majorants[cell.majorant]->label);
    if (cell.precision != Precision::float64) cell.name += "/" + to_string(cell.precision);
    if (!cell.lanes) cell.name += "/one_walk";
  }
  add_experiments_where_needed(plan);
  for (const auto& [name, cells] : cells_by_name(plan)) add_distinctions(plan, cells);
  std::map<std::string, int> used;
  for (Cell& cell : plan.cells)
    // Texts with slashes in them may still collide.
    if (const int times = ++used[cell.name]; times > 1) cell.name += fmt::format("#{}", times);
}

}  // namespace nullmark
