#pragma once

#include <map>
#include <optional>
#include <string>

#include "harness/model/record.h"

namespace nullmark {

using CellsByName = std::map<std::string, const CellRecord*>;

inline CellsByName cells_by_name(const RunRecord& run) {
  CellsByName cells;
  for (const CellRecord& record : run.cells) cells[record.cell.name] = &record;
  return cells;
}

/// A table's metric of one cell, divided by that of the row's `relative_to` cell; nothing if either is unknown.  `value` is
/// `metric` or `metric_theory`.
template <class F>
std::optional<Real> row_value(const CellsByName& cells, const Table& table, const TableRow& row, const std::string& name,
                              F&& value) {
  const auto at = cells.find(name);
  const std::optional<Real> own = at == cells.end() ? std::nullopt : value(*at->second, table.metric);
  if (!row.relative_to || !own) return own;
  const auto base = cells.find(*row.relative_to);
  const std::optional<Real> unit = base == cells.end() ? std::nullopt : value(*base->second, table.metric);
  return unit && *unit != 0 ? std::optional(*own / *unit) : std::nullopt;
}

}  // namespace nullmark
