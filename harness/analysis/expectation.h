#pragma once

#include <map>
#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

using CellsByName = std::map<std::string, const CellRecord*>;
CellsByName cells_by_name(const RunRecord& run);

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

/// A number that the configuration expects of a cell: the first given number of a table row with a tolerance.
struct Expectation {
  std::string name;  ///< table, row and column
  Real given = 0, tolerance = 0;
  std::optional<Real> measured;  ///< absent: the cell was skipped or never ran
  bool met = false;
};
std::vector<Expectation> expectations(const RunRecord& run);

/// "lookups / mu_c = 1 / here: 0.6671, expected 0.6667 within 0.3 %"
std::string expectation_line(const Expectation& expectation);

}  // namespace nullmark
