#pragma once

#include <functional>
#include <vector>

#include "harness/laws.h"

namespace nullmark {

/// The distribution of free paths against the exact one, for samplers whose weights are 1 (their range is binary and the majorant
/// bounds).  Every ray's axis is cut into kFreePathCells cells with exact probabilities, and the escape, an atom of probability
/// T.
///
///   kolmogorov_smirnov  the largest distance of the two distribution functions at the cells' ends, p <= 2 exp(-2 n D^2)
///                       [Dvoretzky, Kiefer, Wolfowitz 1956; Massart 1990]
///   chi_square          cells and escape; cells of fewer than 20 expected collisions are pooled
///
/// Nothing where the law does not apply or `stop` answered true.
std::vector<LawRecord> free_path_laws(const Cell& cell, const Scene& scene, const Kernel& kernel, const CellTheory& theory,
                                      const LawBudget& budget, const std::function<bool()>& stop);

}  // namespace nullmark
