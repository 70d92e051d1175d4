#pragma once

#include <vector>

#include "harness/model/plan.h"

namespace nullmark {

/// A part of a plan that meets every combination which the whole plan meets of
///
///   estimator and medium type, medium type and majorant, estimator and depth (what a medium takes beside its box),
///   estimator, majorant and experiment
///
/// Chosen greedily: the cell with the most combinations not met yet comes first, the earlier one of equals.  One entry a cell.
/// Nothing but these names decides, so no result can bend the choice.  A fault that shows in combinations of more parts may be
/// missed: the whole sweep is the proof, this part is the quick check.
std::vector<bool> covering_cells(const Plan& plan);

}  // namespace nullmark
