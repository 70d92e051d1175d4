#pragma once

#include <optional>

#include "harness/interval.h"
#include "harness/record.h"

namespace nullmark {

/// What accuracy costs in one cell, averaged over its channels.  n samples of a ray have the mean squared error
/// V / n + (floor R)^2, R being the root mean square of the reference, and take n times the time of one.
struct Cost {
  bool analytic = false;                  ///< the variance is theory's
  Real reference = 0;                     ///< R
  Interval variance;                      ///< V, of a sample; a sample variance's interval is by its kurtosis
  std::optional<Interval> ns_per_sample;  ///< median over the repetitions
  std::optional<Interval> variance_x_lookups, variance_x_ns;
  /// Relative error that no number of samples removes, of estimators that do not claim to be unbiased; from the rays' errors.
  std::optional<Interval> floor;
};

/// Nothing where a channel's reference or variance is not known, the reference is 0, or the cell has several outputs a channel.
std::optional<Cost> cost_of(const CellRecord& record);

/// Samples of a ray until the relative error is `target`: V / ((target^2 - floor^2) R^2), at least 1; infinite where the floor
/// is above it.
Interval samples_to(const Cost& cost, Real target);

/// Seconds of one ray on one thread until the relative error is `target`; infinite where it never is.  Nothing without a time.
std::optional<Interval> seconds_to(const Cost& cost, Real target);

/// When an estimator with a floor stops being cheaper than one without: from
///   t = (V_u s_u - V_b s_b) / (floor_b R)^2
/// on, s being the time of a sample, the unbiased one has the smaller error in the same time.  `error` is that of both then.
struct BreakEven {
  enum class Kind { at, never_cheaper, no_floor_seen } kind = Kind::at;
  Interval seconds, error;
};
/// Nothing where either has no time.
std::optional<BreakEven> break_even(const Cost& biased, const Cost& unbiased);

}  // namespace nullmark
