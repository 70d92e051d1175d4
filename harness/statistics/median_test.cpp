#include "harness/statistics/median.h"

#include <gtest/gtest.h>

namespace nullmark {
namespace {

/// Far from 0, where a distance and a number differ.
TEST(MedianSpread, IsOfDistances) {
  const MedianSpread odd = median_spread({104, 101, 100, 103, 200});
  EXPECT_EQ(odd.median, 103);
  EXPECT_EQ(odd.deviation, 2);
  const MedianSpread even = median_spread({100, 102, 110, 104});
  EXPECT_EQ(even.median, 103);
  EXPECT_EQ(even.deviation, 2);
  EXPECT_EQ(median_spread({7, 7, 7}).deviation, 0);
}

}  // namespace
}  // namespace nullmark
