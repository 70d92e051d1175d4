// How deep a flight in float may be: its law enumerated over all 2^24 random numbers there are, not sampled.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "estimators/walk/lane_rng.h"

namespace nullmark {
namespace {

constexpr std::size_t kNumbers = std::size_t{1} << 24;

/// All unit exponentials that LaneRng<float> can draw, ascending.
std::vector<float> every_exponential() {
  std::vector<float> rest(kNumbers);
  for (std::size_t k = 0; k < kNumbers; ++k) rest[k] = 1 - static_cast<float>(k) * 0x1p-24f;
  map_lanes(rest.data(), kNumbers, rest.data(), [](auto x) { return negative_logarithm(x); });
  EXPECT_TRUE(std::is_sorted(rest.begin(), rest.end()));
  return rest;
}

/// P(e > t) of a flight, which is what delta tracking, and ratio tracking under a bound that equals the extinction, estimate T
/// by: off by less than one of 2^24 random numbers, and by a last digit of t.  So T is within epsilon down to 2^-24/epsilon.
TEST(FloatDepth, AFlightKeepsItsLawDownToOneRandomNumber) {
  const std::vector<float> all = every_exponential();
  const auto escapes = [&](float depth) {
    return static_cast<Real>(all.end() - std::upper_bound(all.begin(), all.end(), depth)) / static_cast<Real>(kNumbers);
  };
  EXPECT_EQ(all.front(), 0);
  EXPECT_NEAR(all.back(), 24 * std::log(2.), 1e-5);
  for (const Real epsilon : {1e-3, 1e-2, 2e-2, 5e-2}) {
    Real deepest = 0;
    for (int step = 1; step <= 17 * 64; ++step) {
      const Real depth = step / 64., exact = std::exp(-depth), error = std::abs(escapes(static_cast<float>(depth)) - exact);
      EXPECT_LE(error, 0x1p-24 + 4 * 0x1p-23 * depth * exact) << depth;
      if (error > epsilon * exact) break;
      deepest = depth;
    }
    const Real told = std::log(epsilon * 0x1p24);
    std::printf("one flight in float: T within %g %% down to an optical depth of %.2f at least\n", 100 * epsilon, deepest);
    EXPECT_GE(deepest, told - 0.1);
  }
}

}  // namespace
}  // namespace nullmark
