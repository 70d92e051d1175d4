#pragma once

#include "harness/cell_finder.h"

namespace nullmark {

/// The claims of a plan, cells by their names.
Json claims_json(const std::vector<PublishedClaim>& claims);

/// Claims of a configuration (format: config.md) or, with a finder that takes names as they are, of results.  Throws InputError.
std::vector<PublishedClaim> read_claims(const Place& place, const CellFinder& finder);

}  // namespace nullmark
