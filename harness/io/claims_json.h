#pragma once

#include "harness/io/cell_reader.h"
#include "harness/model/plan.h"

namespace nullmark {

/// The claims of a plan; cells are given by name.
Json claims_json(const std::vector<PublishedClaim>& claims);

/// Adds the claims of a configuration (format: config.md), or of results, to those of other files.  `finder` resolves the cells.
/// Throws InputError.
void read_claims(const JsonNode& node, const CellReader& finder, std::vector<PublishedClaim>& claims);

}  // namespace nullmark
