#include "harness/statistics/interval.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>

namespace nullmark {
namespace {

/// Half-widths of the logarithm, below and above.
Real below(const Interval& x) { return x.low > 0 ? std::log(x.value / x.low) : x.exact() ? 0 : kInfinity; }
Real above(const Interval& x) { return x.value > 0 ? std::log(x.high / x.value) : x.exact() ? 0 : kInfinity; }

Interval around(Real value, Real lower, Real upper) {
  return {value, value * std::exp(-lower), value > 0 ? value * std::exp(upper) : 0};
}

}  // namespace

Interval relative(Real value, Real relative_error) {
  return around(value, kNormal975 * relative_error, kNormal975 * relative_error);
}

Interval product(const Interval& a, const Interval& b) {
  return around(a.value * b.value, std::hypot(below(a), below(b)), std::hypot(above(a), above(b)));
}

Interval quotient(const Interval& a, const Interval& b) {
  return around(a.value / b.value, std::hypot(below(a), above(b)), std::hypot(above(a), below(b)));
}

std::optional<Interval> median_interval(std::vector<Real> values) {
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  const Real median = n % 2 == 1 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2;
  const boost::math::binomial_distribution<Real> below_median(static_cast<Real>(n), 0.5);
  std::size_t outside = 0;  // order statistics left out on either side
  while (2 * (outside + 1) < n && boost::math::cdf(below_median, static_cast<Real>(outside + 1)) <= 0.025) ++outside;
  return Interval{median, values[outside], values[n - 1 - outside]};
}

}  // namespace nullmark
