#include "harness/statistics/interval.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace nullmark {
namespace {

TEST(Interval, ProductsAndQuotientsAddLogarithmsInQuadrature) {
  const Interval a = relative(2, 0.03), b = relative(5, 0.04);
  EXPECT_DOUBLE_EQ(a.high, 2 * std::exp(0.03 * kNormal975));
  const Interval expected = relative(10, 0.05), product_of = product(a, b), quotient_of = quotient(a, b);
  EXPECT_DOUBLE_EQ(product_of.value, 10);
  EXPECT_NEAR(product_of.low, expected.low, 1e-12);
  EXPECT_NEAR(product_of.high, expected.high, 1e-12);
  EXPECT_NEAR(quotient_of.low, relative(0.4, 0.05).low, 1e-12);
  EXPECT_NEAR(quotient_of.high, relative(0.4, 0.05).high, 1e-12);
  EXPECT_TRUE(product(exactly(3), exactly(4)).exact());
  EXPECT_TRUE(product(exactly(0), exactly(4)).exact());
  // A quotient is as uncertain as its parts on the sides that matter.
  const Interval skewed = quotient(exactly(1), {1, 0.5, 1});
  EXPECT_DOUBLE_EQ(skewed.low, 1);
  EXPECT_DOUBLE_EQ(skewed.high, 2);
}

TEST(Interval, TheUnknownStaysUnknown) {
  const Interval open = product({1, 0.5, kInfinity}, exactly(2));
  EXPECT_DOUBLE_EQ(open.low, 1);
  EXPECT_EQ(open.high, kInfinity);
  EXPECT_EQ(product({1, 0, 2}, exactly(1)).low, 0);
}

TEST(Interval, OfAMedianAreOrderStatistics) {
  EXPECT_FALSE(median_interval({}));
  const Interval five = *median_interval({5, 1, 4, 2, 3});
  EXPECT_EQ(five.value, 3);
  EXPECT_EQ(five.low, 1);
  EXPECT_EQ(five.high, 5);
  const Interval nine = *median_interval({9, 8, 7, 6, 5, 4, 3, 2, 1});
  EXPECT_EQ(nine.low, 2);
  EXPECT_EQ(nine.high, 8);
  EXPECT_EQ(median_interval({1, 2, 3, 10})->value, 2.5);
}

/// Whatever the distribution: here a very skew one.  A loop over 4000 sets of 21, of which at least 95 % must be right; chance
/// alone gives less than 94 % once in 1e3 runs if the true share were 95 %, and it is 97.3 %.
TEST(Interval, OfAMedianCoversTheTrueOne) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<Real> law(0, 2);
  int covered = 0;
  constexpr int kSets = 4000;
  for (int set = 0; set < kSets; ++set) {
    std::vector<Real> values(21);
    for (Real& value : values) value = law(random);
    const Interval interval = *median_interval(values);
    covered += interval.low <= 1 && 1 <= interval.high;
  }
  EXPECT_GE(covered, kSets * 95 / 100);
  EXPECT_LE(covered, kSets * 99 / 100);
}

}  // namespace
}  // namespace nullmark
