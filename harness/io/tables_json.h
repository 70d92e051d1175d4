#pragma once

#include "harness/io/cell_reader.h"
#include "harness/model/plan.h"

namespace nullmark {

/// The tables of a plan, cells by their names: {"cell": "ratio/linear/global"}.
Json tables_json(const std::vector<Table>& tables);

/// Tables of a configuration or, with a finder that takes names as they are, of results.  Throws InputError.
std::vector<Table> read_tables(const JsonNode& node, const CellReader& finder);

}  // namespace nullmark
