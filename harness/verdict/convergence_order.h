#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// Convergence order of a consistent estimator, fitted over cells that differ only in their number of steps.
struct OrderFit {
  std::string name;                             ///< the cells' name without the steps
  Real claimed = 0, order = 0, half_width = 0;  ///< interval at the given quantile of the normal law
  std::vector<int> steps;                       ///< numbers of steps whose bias is resolved
  Outcome outcome = Outcome::inconclusive;
  std::string reason;
};

/// Fits log |bias| against log(1/steps), weighted by the standard errors of the biases.  For T the bias is that of the optical
/// depth, log(mean/T).  Only biases beyond 4 standard errors and 10 times the reference's error count.  An order needs three such
/// numbers of steps, and biases of one sign that follow a power law.  Of cells with the same number of steps, whose majorants or
/// lanes may be all that differs, the best known one counts.  FAIL: the whole interval lies below the claim by more than a
/// quarter, and so does that of the two finest steps, whose order exceeds the fitted one by no more: coarse steps may skip a
/// medium's detail, and an order is claimed of small ones.  PASS: none of the interval does.  A bias that vanishes faster than
/// claimed is no fault: midpoints are exact on linear media.  Cells with a measurement (clamped, quantised) claim no order, nor do
/// cells in float, where rounding cannot be told from a bias.
std::vector<OrderFit> fit_orders(const std::vector<CellRecord>& cells);

}  // namespace nullmark
