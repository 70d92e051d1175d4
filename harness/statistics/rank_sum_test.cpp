#include "harness/statistics/rank_sum.h"

#include <gtest/gtest.h>

#include <random>

namespace nullmark {
namespace {

TEST(RankSum, CountsTheOrdersOfAFewNumbers) {
  EXPECT_NEAR(rank_sum_probability({1, 2}, {3, 4}), 2. / 6, 1e-15);  // one order of 6, on either side
  EXPECT_NEAR(rank_sum_probability({1, 2, 3}, {4, 5, 6}), 2. / 20, 1e-15);
  EXPECT_NEAR(rank_sum_probability({1, 2, 4}, {3, 5, 6}), 4. / 20, 1e-15);
  EXPECT_EQ(rank_sum_probability({1, 4}, {2, 3}), 1);
  EXPECT_EQ(rank_sum_probability({}, {1}), 1);
}

TEST(RankSum, SixteenBelowSixteenAreTheRarestOrder) {
  std::vector<Real> low, high;
  for (int i = 0; i < 16; ++i) low.push_back(i), high.push_back(100 + i);
  EXPECT_NEAR(rank_sum_probability(low, high) * 601080390 / 2, 1, 1e-9);  // 32 choose 16
  EXPECT_EQ(rank_sum_probability(low, low), 1);
  EXPECT_EQ(rank_sum_probability(std::vector<Real>(16, 1), std::vector<Real>(16, 1)), 1);
}

/// Heavy tails: squares of Cauchy numbers have no mean.  Of 20000 pairs at most 1 % may come below .01; five standard errors.
TEST(RankSum, HoldsItsLevelForAnyDistribution) {
  std::mt19937_64 random(5);
  std::cauchy_distribution<Real> law;
  int below = 0;
  for (int pair = 0; pair < 20000; ++pair) {
    std::vector<Real> first, second;
    for (int i = 0; i < 16; ++i) first.push_back(std::pow(law(random), 2)), second.push_back(std::pow(law(random), 2));
    below += rank_sum_probability(first, second) <= 0.01;
  }
  EXPECT_LE(below, 200 + 5 * 14);
  EXPECT_GE(below, 100);
}

}  // namespace
}  // namespace nullmark
