#include "harness/analysis/expectation.h"

#include <fmt/format.h>

#include <cmath>

#include "harness/model/metrics.h"

namespace nullmark {

CellsByName cells_by_name(const RunRecord& run) {
  CellsByName cells;
  for (const CellRecord& record : run.cells) cells[record.cell.name] = &record;
  return cells;
}

std::vector<Expectation> expectations(const RunRecord& run) {
  const CellsByName cells = cells_by_name(run);
  std::vector<Expectation> all;
  for (const Table& table : run.tables)
    for (const TableRow& row : table.rows) {
      if (!row.tolerance || row.given.empty()) continue;
      for (const auto& [heading, name] : row.cells) {
        Expectation one;
        one.name = fmt::format("{} / {} / {}", table.title, row.label, heading);
        one.given = row.given.front().second;
        one.tolerance = *row.tolerance;
        one.measured = row_value(cells, table, row, name, metric);
        one.met = one.measured && std::abs(*one.measured - one.given) <= one.tolerance * std::abs(one.given);
        all.push_back(std::move(one));
      }
    }
  return all;
}

std::string expectation_line(const Expectation& expectation) {
  return fmt::format("{}: {}, expected {:.5g} within {:g} %", expectation.name,
                     expectation.measured ? fmt::format("{:.5g}", *expectation.measured) : "not measured", expectation.given,
                     100 * expectation.tolerance);
}

}  // namespace nullmark
