#include "harness/statistics/ks_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace nullmark {
namespace {

/// Everything sorted, every rank looked at.
Real by_sorting(std::vector<Real> u) {
  std::sort(u.begin(), u.end());
  const auto n = static_cast<Real>(u.size());
  Real distance = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    const auto before = static_cast<Real>(i);
    distance = std::max({distance, u[i] - before / n, (before + 1) / n - u[i]});
  }
  return 2 * n * distance * distance - std::log(Real{2});
}

TEST(Uniformity, IsTheLargestDistanceToTheLastBit) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<Real> uniform(0, 1);
  for (const std::size_t count : {1, 2, 15, 16, 17, 100, 1000, 30000})
    for (const Real power : {1., 0.99, 1.3, 8.})
      for (int round = 0; round < 20; ++round) {
        std::vector<Real> u(count);
        for (Real& x : u) x = std::pow(uniform(random), power);
        EXPECT_EQ(uniformity(u), by_sorting(u)) << count << ", " << power;
      }
}

TEST(Uniformity, TakesAnyNumbers) {
  EXPECT_EQ(uniformity({}), -kInfinity);
  const std::vector<std::vector<Real>> lists = {{0, 0, 0},       {1, 1},          {0.5, 0.5, 0.5, 0.5},         {-3, 0.2, 0.4},
                                                {0.1, 0.9, 1.5}, {-1e300, 1e300}, std::vector<Real>(1000, 0.25)};
  for (const std::vector<Real>& u : lists) EXPECT_EQ(uniformity(u), by_sorting(u));
}

}  // namespace
}  // namespace nullmark
