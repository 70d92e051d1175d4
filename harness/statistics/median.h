#pragma once

#include <boost/math/statistics/univariate_statistics.hpp>
#include <cmath>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// A median, and the median of the absolute distances from it.  Boost 1.74's own median_absolute_deviation returns the absolute
/// value of the middle number instead of its distance.
struct MedianSpread {
  Real median = 0, deviation = 0;
};

/// Of one number or more.
inline MedianSpread median_spread(std::vector<Real> numbers) {
  MedianSpread spread;
  spread.median = boost::math::statistics::median(numbers);
  for (Real& x : numbers) x = std::abs(x - spread.median);
  spread.deviation = boost::math::statistics::median(numbers);
  return spread;
}

}  // namespace nullmark
