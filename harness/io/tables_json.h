#pragma once

#include "harness/io/cell_reader.h"
#include "harness/model/plan.h"

namespace nullmark {

/// The tables of a plan; cells are given by name: {"cell": "ratio/linear/global"}.
Json tables_json(const std::vector<Table>& tables);

/// Reads the tables of a configuration or of results.  `finder` resolves the cells.  Throws InputError.
std::vector<Table> read_tables(const JsonNode& node, const CellReader& finder);

}  // namespace nullmark
