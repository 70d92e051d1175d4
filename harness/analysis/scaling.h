#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "harness/model/record.h"
#include "harness/statistics/interval.h"

namespace nullmark {

/// The numeric parameters of a cell's estimator, medium, majorant and rays ("medium.optical_depth"), and "channels".
std::map<std::string, Real> numeric_parameters(const CellRecord& record);

/// Exponent p of y ~ x^p by least squares of logarithms, with a 95 % interval from the scatter around the line.  Nothing for
/// fewer than three points or two different x.  x and y must be above 0.
std::optional<Interval> power_law(const std::vector<std::pair<Real, Real>>& points);

/// Cells that differ only in one parameter.
struct ScalingSeries {
  std::string axis;                                 ///< the parameter
  std::string tracker, rest;                        ///< the tracker, and everything else that the cells share
  std::vector<const CellRecord*> cells;             ///< by ascending parameter, three or more
  std::vector<Real> x;                              ///< the parameter, > 0
  std::optional<Interval> time, lookups, variance;  ///< exponents of ns, of lookups and of relative variance per sample
  std::optional<Interval> time_upper;               ///< the same over the upper half of the points, if it has three
};

/// Variance of a sample over its squared mean, averaged over the channels; of a free path the variance of its weight in the first
/// channel, whose mean is 1.
std::optional<Real> scaled_variance(const CellRecord& record);

/// All such series of a run's sampled cells.
std::vector<ScalingSeries> scaling_series(const RunRecord& run);

}  // namespace nullmark
