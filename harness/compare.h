#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/record.h"

namespace nullmark {

/// What accuracy costs in one cell (averaged over channels): `variance` is the analytic one where known.
struct Efficiency {
  std::optional<Real> variance;
  std::optional<Real> variance_x_lookups, variance_x_ns;
  std::optional<Real> seconds_to_1pct;  ///< time to a relative RMSE of 1 %, absent below the bias floor
  std::optional<Real> floor;            ///< relative bias that no number of samples removes
  Real relative_error = 0;              ///< standard error of a sample variance, relative; 0 for an analytic one
};
Efficiency efficiency(const CellRecord& record);

/// A table per quantity, ray set, medium and majorant: estimators by time to 1 % relative RMSE, each beside the baseline
/// (default: the first that is unbiased).  Throws ParameterError when the baseline names no estimator of the results.
std::string compare_results(const std::vector<RunRecord>& runs, const std::string& baseline);

}  // namespace nullmark
