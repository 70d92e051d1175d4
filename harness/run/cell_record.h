#pragma once

#include <optional>

#include "harness/model/record.h"
#include "harness/sampling/cell_preparation.h"
#include "harness/sampling/sampling.h"

namespace nullmark {

/// The record of a cell before sampling.
CellRecord blank_record(const Plan& plan, const PreparedCell& prepared);

void fill_statistics(CellRecord& record, const PreparedCell& prepared, const Sampled& sampled);

/// Drops the statistics of samples if some are not finite or walks did not end.  References and theory stay.
void drop_sampled_statistics(CellRecord& record);

/// Adds the verdict, or why there is none.  If no ray meets any extinction, a proven bias is a verdict, a PASS is not.
void add_verdict(CellRecord& record, const PreparedCell& prepared, const std::optional<VerdictRecord>& verdict);

}  // namespace nullmark
