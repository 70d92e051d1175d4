#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "harness/model/record.h"
#include "harness/statistics/interval.h"

namespace nullmark {

/// Relative errors below this are rounding and count as 0.
inline constexpr Real kRounding = 1e-10;

/// Cost of accuracy in one cell, averaged over its channels.  n samples of a ray have the mean squared error V / n + (floor R)^2
/// and take n times the time of one.  R is the root mean square of the reference, or the mean of the samples where no mean is
/// known.
struct Cost {
  bool analytic = false;  ///< the variance comes from theory
  Real reference = 0;     ///< R
  Interval variance;      ///< V of one sample; the interval of a sample variance comes from its kurtosis, or is wide if uncertain
  std::optional<Interval> ns_per_sample;  ///< median over the repetitions
  /// Cost of a sample by the number that share a walk through the majorant structure, ascending; the last is ns_per_sample.
  std::vector<std::pair<std::uint64_t, Interval>> ns_by_batch;
  std::optional<Interval> variance_x_lookups, variance_x_ns;
  std::optional<Interval> variance_x_ns_alone;  ///< by the time of a sample that shares that walk with no other
  /// Relative error that no number of samples removes, from the rays' errors, of cells that do not stand as unbiased.
  std::optional<Interval> floor;
};

/// Whether a cell counts as unbiased: its estimator claims it, its samples are used as drawn, and its verdict is neither FAIL nor
/// VIOLATED.
bool stands_unbiased(const CellRecord& record);

/// Whether a sample variance without theory tells little: its own standard error is above a half, by the kurtosis; or the mean of
/// an estimator that stands as unbiased lies farther than 5 standard errors from the reference, because rare samples were not
/// seen.
bool variance_is_uncertain(const CellRecord& record, const ChannelRecord& channel);

/// Nothing if a channel's mean or variance is unknown, the reference is 0, or the cell has several outputs per channel.
std::optional<Cost> cost_of(const CellRecord& record);

/// Samples per ray for the relative error `target`: V / ((target^2 - floor^2) R^2), at least 1; infinite if the floor is above
/// the target.
Interval samples_to(const Cost& cost, Real target);

/// Seconds of one ray on one thread until the relative error is `target`, where the samples needed share a walk through the
/// majorant structure: interpolated linearly between the numbers of samples that were timed together.  Infinite if the target is
/// never reached, nothing without a time.
std::optional<Interval> seconds_to(const Cost& cost, Real target);

/// Whether fewer samples are needed than the smallest timed batch has.  `seconds_to` then leaves out part of the walk through the
/// majorant structure.
bool is_amortised(const Cost& cost, Real target);

/// Mean squared error of n samples: V / n + (floor R)^2.
Interval mean_square_error(const Cost& cost, std::uint64_t samples);

/// The time from which an unbiased estimator has a smaller error than one with a floor:
///   t = (V_u s_u - V_b s_b) / (floor_b R)^2
/// where s is the time of a sample.  `error` is the error of both at t.  If t is before the first sample of the unbiased
/// estimator, the biased one is cheaper only if its samples take less time, and only until that first sample.
struct BreakEven {
  enum class Kind { at, first_sample, never_cheaper, no_floor_seen, exact } kind = Kind::at;  ///< exact: but for rounding
  Interval seconds, error;
};

/// Until when the biased estimator is cheaper than the unbiased one, in words; "at" for Kind::at.
const char* to_string(BreakEven::Kind kind);

/// Nothing if either has no time.
std::optional<BreakEven> break_even(const Cost& biased, const Cost& unbiased);

}  // namespace nullmark
