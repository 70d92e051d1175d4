#pragma once

#include <optional>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// A number with a 95 % interval; low == high if it is exact.
struct Interval {
  Real value = 0, low = 0, high = 0;

  bool exact() const { return low == high; }
};

inline Interval exactly(Real value) { return {value, value, value}; }

/// Quantile .975 of the normal distribution.
inline constexpr Real kNormal975 = 1.959963984540054;

/// Interval of a value >= 0 whose logarithm has the standard error `relative_error`.
Interval relative(Real value, Real relative_error);

/// Product of independent factors >= 0; half-widths of the logarithms add in quadrature.
Interval product(const Interval& a, const Interval& b);

/// a / b, b > 0, of independent numbers >= 0.
Interval quotient(const Interval& a, const Interval& b);

/// Median of values, and the pair of order statistics that contains the true median with at least 95 % for any distribution (sign
/// test).  For five values or fewer the pair is the least and the largest (94 % for five).  Nothing for no values.
std::optional<Interval> median_interval(std::vector<Real> values);

}  // namespace nullmark
