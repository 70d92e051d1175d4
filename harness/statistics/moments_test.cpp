#include "harness/statistics/moments.h"

#include <gtest/gtest.h>

#include <random>

namespace nullmark {
namespace {

std::vector<Real> errors(std::size_t count) {
  std::mt19937_64 random(1);
  std::exponential_distribution<Real> law(1);
  std::vector<Real> result(count);
  for (Real& x : result) x = law(random) - 1;
  return result;
}

TEST(Moments, AreThePowerSumsOfAnyNumberOfErrors) {
  for (const std::size_t count : {0, 1, 7, 8, 9, 64, 1000}) {
    const std::vector<Real> x = errors(count);
    Moments moments;
    moments.add(x);
    long double sum[5] = {}, size[5] = {};
    for (const long double e : x)
      for (int power = 1; power <= 4; ++power) {
        sum[power] += std::pow(e, power);
        size[power] += std::abs(std::pow(e, power));
      }
    EXPECT_EQ(moments.count, count);
    const Real found[5] = {0, moments.s1, moments.s2, moments.s3, moments.s4};
    for (int power = 1; power <= 4; ++power)
      EXPECT_NEAR(found[power], static_cast<Real>(sum[power]), 1e-14 * static_cast<Real>(size[power])) << count << ", " << power;
  }
}

TEST(BlockErrors, HoldEveryErrorOnce) {
  for (const std::size_t count : {1, 100, 1023, 1024, 5000, 16384}) {
    const std::vector<Real> x = errors(count);
    BlockErrors blocks;
    Moments moments, expected;
    blocks.add(3, x, moments);
    expected.add(x);
    Real squares = 0;
    std::uint64_t counted = 0, used = 0;
    for (std::size_t b = 0; b < BlockErrors::kBlocks; ++b) {
      squares += blocks.squares[b];
      counted += blocks.count[b];
      used += blocks.count[b] > 0;
    }
    EXPECT_EQ(counted, count);
    EXPECT_EQ(moments.count, count);
    EXPECT_NEAR(squares, expected.s2, 1e-12 * expected.s2);
    EXPECT_NEAR(moments.s4, expected.s4, 1e-12 * expected.s4);
    // Few errors of a ray go to the ray's block, many to all.
    EXPECT_EQ(used, count < 1024 ? 1u : BlockErrors::kBlocks);
    EXPECT_EQ(blocks.count[3], count < 1024 ? count : (count + 15) / 16);
  }
}

/// Every disjoint group of 2^level consecutive errors, one by one.
std::vector<GroupErrors::Level> one_by_one(const std::vector<Real>& x) {
  std::vector<GroupErrors::Level> levels;
  for (std::size_t size = 1; size <= x.size(); size *= 2) {
    GroupErrors::Level level;
    for (std::size_t first = 0; first + size <= x.size(); first += size) {
      Real sum = 0;
      for (std::size_t i = first; i < first + size; ++i) sum += x[i];
      const Real mean = sum / static_cast<Real>(size);
      level.sum_of_squares += mean * mean;
      ++level.groups;
    }
    levels.push_back(level);
  }
  return levels;
}

TEST(GroupErrors, HoldEveryGroupOfConsecutiveSamples) {
  for (const std::size_t count : {1, 2, 3, 16, 37, 255, 256, 1000}) {
    const std::vector<Real> x = errors(count);
    const std::vector<GroupErrors::Level> expected = one_by_one(x);
    // At once, and in blocks with a shorter one at the end.
    for (const std::size_t block : {std::size_t{1024}, std::size_t{32}}) {
      GroupErrors groups;
      for (std::size_t first = 0; first < count; first += block)
        groups.add(std::span(x).subspan(first, std::min(block, count - first)));
      ASSERT_EQ(groups.levels().size(), expected.size()) << count << ", " << block;
      for (std::size_t level = 0; level < expected.size(); ++level) {
        EXPECT_EQ(groups.levels()[level].groups, expected[level].groups) << count << ", " << block << ", " << level;
        EXPECT_NEAR(groups.levels()[level].sum_of_squares, expected[level].sum_of_squares,
                    1e-13 * expected[level].sum_of_squares + 1e-15)
            << count << ", " << block << ", " << level;
      }
    }
  }
}

TEST(GroupErrors, OfOneRayDoNotMixWithThoseOfTheNext) {
  const std::vector<Real> x = {1, 1, 1}, y = {-1, -1, -1};
  GroupErrors groups;
  groups.add(x);
  groups.finish_ray();
  groups.add(y);
  groups.finish_ray();
  ASSERT_EQ(groups.levels().size(), 2u);
  EXPECT_EQ(groups.levels()[0].groups, 6u);
  EXPECT_EQ(groups.levels()[1].groups, 2u);
  EXPECT_EQ(groups.levels()[1].sum_of_squares, 2);
}

}  // namespace
}  // namespace nullmark
