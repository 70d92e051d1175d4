#pragma once

#include <map>
#include <string>
#include <vector>

#include "harness/run/build.h"
#include "harness/run/journal.h"

namespace nullmark {

/// What earlier runs of the same configuration left, by place in the plan.
using Earlier = std::map<std::size_t, CellRecord>;

/// Cells of an existing results file and of the journal.  Throws InputError where they are of another configuration, or of a
/// build that may not be joined with this one.
Earlier earlier_results(const Plan& plan, const std::string& output, const Journal& journal, Builds builds);

/// The record of a cell under the plan's own name for it: cells of different experiments may share statistics.
CellRecord placed(CellRecord record, const Cell& cell);

}  // namespace nullmark
