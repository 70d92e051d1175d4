#pragma once

#include "harness/io/cell_reader.h"
#include "harness/model/plan.h"

namespace nullmark {

/// The claims of a plan, cells by their names.
Json claims_json(const std::vector<PublishedClaim>& claims);

/// Adds the claims of a configuration (format: config.md) or, with a finder that takes names as they are, of results, to those of
/// other files.  Throws InputError.
void read_claims(const JsonNode& node, const CellReader& finder, std::vector<PublishedClaim>& claims);

}  // namespace nullmark
