#pragma once

#include <vector>

#include "harness/model/plan.h"

namespace nullmark {

/// A subset of a plan in which all of these combinations occur that occur in the whole plan:
///
///   estimator and medium type, medium type and majorant, estimator and depth (what a medium takes beside its box),
///   estimator, majorant and experiment
///
/// Chosen greedily: the cell with the most missing combinations comes next, the earlier one if equal.  One entry per cell.  The
/// choice depends only on names, never on results.  The subset can miss a fault that needs a combination of more parts: the whole
/// sweep is the proof, the subset a quick check.
std::vector<bool> covering_cells(const Plan& plan);

}  // namespace nullmark
