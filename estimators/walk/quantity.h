#pragma once

#include <cstddef>
#include <limits>

#include "media/base/types.h"

namespace nullmark {

/// What an estimator says of its mean.  `exact`: no variance, error of rounding only.  `unbiased`: mean T (or tau) for any sample
/// count. `consistent`: bias vanishes with the step.  `biased`: neither; registered for comparison.
enum class Guarantee { exact, unbiased, consistent, biased };

/// Values one sample can take, when the majorant bounds the extinction.
enum class SampleRange { binary, unit, non_negative, any_sign };

/// What is estimated: T = exp(-tau); tau; T at several distances of one walk; how a free flight ends; the radiance that arrives
/// along a ray, with the flights that `event` tells of.
enum class Quantity { transmittance, optical_depth, transmittance_profile, free_path, radiance };
inline constexpr std::size_t kQuantities = 5;

/// Numbers that walks are made of.  Single precision: flights, lookups and weights in float, so a flight is told to 2^-24 of the
/// majorant depth of its ray; means over samples are taken in double.
enum class Precision { float64, float32 };

/// Distance from 1 to the next number.
constexpr Real epsilon_of(Precision precision) {
  return precision == Precision::float64 ? std::numeric_limits<Real>::epsilon() : Real{std::numeric_limits<float>::epsilon()};
}

}  // namespace nullmark
