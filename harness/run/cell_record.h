#pragma once

#include <optional>

#include "harness/model/record.h"
#include "harness/sampling/cell_preparation.h"
#include "harness/sampling/sampling.h"

namespace nullmark {

/// What is known of a cell before anything is sampled.
CellRecord blank_record(const Plan& plan, const PreparedCell& prepared);

void fill_statistics(CellRecord& record, const PreparedCell& prepared, const Sampled& sampled);

/// Where samples are not finite or walks did not end, what is left of them has no say; references and theory stand.
void drop_sampled_statistics(CellRecord& record);

/// The verdict, or why there is none.  A bias is one even where there is nothing to meet; a PASS is none.
void add_verdict(CellRecord& record, const PreparedCell& prepared, const std::optional<VerdictRecord>& verdict);

}  // namespace nullmark
