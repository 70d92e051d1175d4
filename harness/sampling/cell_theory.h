#pragma once

#include <functional>
#include <vector>

#include "harness/sampling/cell_preparation.h"

namespace nullmark {

/// Adds theory to all cells that can run, scene by scene.  Cells with a measurement get none, because it changes the law of the
/// samples.  With equal_lookups, the number of samples follows from the theory.  A cell whose tracker throws has a `failure`.
/// A cell has a `reason` where a sample can be expected to exceed the bound on its lookups, and where no count holds its samples.
/// Once `stop` returns true, the theory of scenes that are left is not computed.
void add_theory(
    std::vector<PreparedCell>& cells, const std::function<bool()>& stop = [] { return false; });

/// Adds a theory that was computed before to a cell that can run; the same holds as for `add_theory`.
void take_theory(PreparedCell& prepared, CellTheory theory);

}  // namespace nullmark
