#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "harness/model/record.h"
#include "harness/statistics/interval.h"

namespace nullmark {

/// Relative errors below are rounding: they count as 0.
inline constexpr Real kRounding = 1e-10;

/// What accuracy costs in one cell, averaged over its channels.  n samples of a ray have the mean squared error
/// V / n + (floor R)^2, R being the root mean square of the reference, and take n times the time of one.
struct Cost {
  bool analytic = false;                  ///< the variance is theory's
  Real reference = 0;                     ///< R
  Interval variance;                      ///< V, of a sample; a sample variance's interval is by its kurtosis
  std::optional<Interval> ns_per_sample;  ///< median over the repetitions
  /// What samples cost where so few share a walk through the majorant structure, ascending; the last is ns_per_sample.
  std::vector<std::pair<std::uint64_t, Interval>> ns_by_batch;
  std::optional<Interval> variance_x_lookups, variance_x_ns;
  /// Relative error that no number of samples removes, of estimators that do not claim to be unbiased, and of samples that are
  /// clamped or rounded; from the rays' errors.
  std::optional<Interval> floor;
};

/// Nothing where a channel's reference or variance is not known, the reference is 0, or the cell has several outputs a channel.
std::optional<Cost> cost_of(const CellRecord& record);

/// Samples of a ray until the relative error is `target`: V / ((target^2 - floor^2) R^2), at least 1; infinite where the floor
/// is above it.
Interval samples_to(const Cost& cost, Real target);

/// Seconds of one ray on one thread until the relative error is `target`, by the time of the largest batch that was timed and is
/// not larger than the samples needed; infinite where it never is.  Nothing without a time.
std::optional<Interval> seconds_to(const Cost& cost, Real target);

/// Fewer samples are needed than in the smallest batch that was timed: `seconds_to` leaves out part of the walk through the
/// majorant structure.
bool is_amortised(const Cost& cost, Real target);

/// Mean squared error of n samples: V / n + (floor R)^2.
Interval mean_square_error(const Cost& cost, std::uint64_t samples);

/// When an estimator with a floor stops being cheaper than one without: from
///   t = (V_u s_u - V_b s_b) / (floor_b R)^2
/// on, s being the time of a sample, the unbiased one has the smaller error in the same time.  `error` is that of both then.
/// Where t is before the first sample of the unbiased one, only a biased one whose samples take less is cheaper, until then.
struct BreakEven {
  enum class Kind { at, first_sample, never_cheaper, no_floor_seen, exact } kind = Kind::at;  ///< exact: but for rounding
  Interval seconds, error;
};
/// Nothing where either has no time.
std::optional<BreakEven> break_even(const Cost& biased, const Cost& unbiased);

}  // namespace nullmark
