#pragma once

#include <functional>
#include <string>
#include <vector>

#include "harness/verdict/walk_laws.h"

namespace nullmark {

/// Why the distribution of free paths is not tested, as part of a sentence; empty if it is tested.  It is tested if the medium is
/// grey and all weights are 1: the range is binary and the majorant bounds, or theory states a weight without variance.
std::string why_no_free_path_laws(const Scene& scene, SampleRange range, const CellTheory& theory);

/// Tests the distribution of free paths against the exact one, for samplers whose weights are 1.  Each ray is cut into
/// kFreePathCells cells with exact probabilities; the escape is an atom of probability T.
///
///   kolmogorov_smirnov  the largest distance of the two distribution functions at the cells' ends, p <= 2 exp(-2 n D^2)
///                       [Dvoretzky, Kiefer, Wolfowitz 1956; Massart 1990]
///   chi_square          cells and escape; cells of fewer than 20 expected collisions are pooled
///
/// Empty if the law does not apply or `stop` returned true.
std::vector<LawRecord> free_path_laws(const Cell& cell, const Scene& scene, const Kernel& kernel, SampleRange range,
                                      const CellTheory& theory, const LawBudget& budget, const std::function<bool()>& stop);

}  // namespace nullmark
