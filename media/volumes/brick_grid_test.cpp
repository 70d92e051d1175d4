#include "media/volumes/brick_grid_summary.h"

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <random>

namespace nullmark {
namespace {

const auto serial = [](std::size_t n, const auto& body) {
  for (std::size_t b = 0; b < n; ++b) body(b);
};

using Voxels = std::function<float(int, int, int)>;

BrickGrid make(const IndexBox& box, float background, const Voxels& voxels) {
  const auto fill = [&](const Index3& origin, float* values) {
    for (int i = 0; i <= 8; ++i)
      for (int j = 0; j <= 8; ++j)
        for (int k = 0; k <= 8; ++k) *values++ = voxels(origin[0] + i, origin[1] + j, origin[2] + k);
  };
  const auto bricks = [](const Index3&, const auto& shape, const auto& visit) {
    visit(0, shape[0] * shape[1] * shape[2], nullptr);
  };
  return BrickGrid::build(box, background, bricks, fill, serial);
}

/// Distinct for every voxel near the origin.
float numbered(int i, int j, int k) { return static_cast<float>(1 + (i + 40) * 6400 + (j + 40) * 80 + k + 40); }

bool inside(const IndexBox& box, int i, int j, int k) { return box.contains({{i, j, k}, {i, j, k}}); }

const std::vector<IndexBox> kBoxes{{{-8, 0, 8}, {-1, 7, 15}},
                                   {{-9, -1, 7}, {0, 8, 16}},
                                   {{3, 3, 3}, {3, 3, 3}},
                                   {{-20, -17, -11}, {-3, 5, 9}},
                                   {{0, 0, 0}, {23, 15, 7}}};

TEST(BrickGrid, HoldsEveryVoxelAndTheBackgroundBeyond) {
  for (const IndexBox& box : kBoxes) {
    const BrickGrid grid = make(box, 0.25f, numbered);
    for (int i = -33; i < 34; ++i)
      for (int j = -33; j < 34; ++j)
        for (int k = -33; k < 34; ++k) ASSERT_EQ(grid.value(i, j, k), inside(box, i, j, k) ? numbered(i, j, k) : 0.25f);
  }
}

TEST(BrickGrid, TrilinearInterpolatesItsOwnVoxelsEverywhere) {
  std::mt19937_64 random(1);
  for (const IndexBox& box : kBoxes) {
    const BrickGrid grid = make(box, 0.25f, numbered);
    std::uniform_real_distribution<Real> coordinate(-34, 34);
    for (int n = 0; n < 20000; ++n) {
      Vec3 p(coordinate(random), coordinate(random), coordinate(random));
      if (n % 4 == 0) p[n / 4 % 3] = std::round(p[n / 4 % 3]);
      const Vec3 low = p.array().floor(), f = p - low;
      Real expected = 0;
      for (int c = 0; c < 8; ++c) {
        const int i = c & 1, j = c >> 1 & 1, k = c >> 2;
        expected += (i ? f[0] : 1 - f[0]) * (j ? f[1] : 1 - f[1]) * (k ? f[2] : 1 - f[2]) *
                    Real{grid.value(static_cast<int>(low[0]) + i, static_cast<int>(low[1]) + j, static_cast<int>(low[2]) + k)};
      }
      ASSERT_NEAR(grid.trilinear(p[0], p[1], p[2]), expected, 1e-8) << p.transpose();
    }
  }
}

TEST(BrickGrid, NearestRoundsHalvesAwayFromZero) {
  const BrickGrid grid = make({{-8, -8, -8}, {8, 8, 8}}, 0, [](int i, int, int) { return static_cast<float>(i + 100); });
  for (const Real x : {-7.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 7.5, 0.49999999999999994, -0.49999999999999994, 0.0, -0.0})
    EXPECT_EQ(grid.nearest(x, 0, 0), static_cast<float>(std::round(x) + 100)) << x;
  for (Real x = -8; x <= 8; x += 0.0625) {
    EXPECT_EQ(grid.nearest(std::nextafter(x, -9.), 0, 0),
              static_cast<float>(x == -8 ? 92 : std::round(std::nextafter(x, -9.)) + 100));
    EXPECT_EQ(BrickGrid::floored(x), static_cast<int>(std::floor(x)));
  }
}

TEST(BrickGrid, AnyNumberIsAValidQuery) {
  const BrickGrid grid = make({{-8, 0, 3}, {-1, 7, 20}}, 0.5f, numbered);
  const Real tiny = std::numeric_limits<Real>::denorm_min(), huge = std::numeric_limits<Real>::max();
  const std::vector<Real> far{huge, -huge, 1e300, -2147483649., 4294967296., kInfinity, -kInfinity, std::nan("")};
  for (const Real x : far)
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 p(-4, 4, 4);
      p[axis] = x;
      EXPECT_EQ(grid.trilinear(p[0], p[1], p[2]), 0.5);
      EXPECT_EQ(grid.nearest(p[0], p[1], p[2]), 0.5f);
    }
  std::vector<Real> near{tiny, -tiny};
  for (int i = -20; i < 40; ++i)
    for (const Real x : {i - 0.5, Real(i), i + 0.5})
      for (const Real y : {std::nextafter(x, -kInfinity), x, std::nextafter(x, kInfinity)}) near.push_back(y);
  for (const Real x : near)
    for (const Real y : near) {  // under a sanitizer, an index out of range stops here
      EXPECT_TRUE(std::isfinite(grid.trilinear(x, y, y)));
      EXPECT_TRUE(std::isfinite(grid.nearest(y, y, x)));
    }
  const BrickGrid empty(0.75f);
  EXPECT_EQ(empty.trilinear(0, 0, 0), 0.75);
  EXPECT_EQ(empty.nearest(0, -1, 2), 0.75f);
  EXPECT_EQ(empty.summary(IndexBox{{-3, -3, -3}, {3, 3, 3}}).average, 0.75);
}

TEST(BrickGrid, SummariesMatchAWalkOverTheVoxels) {
  std::mt19937_64 random(2);
  std::uniform_int_distribution<int> coordinate(-30, 30), scramble(0, 1000);
  for (const IndexBox& box : kBoxes) {
    const BrickGrid grid = make(box, 3.5f, [](int i, int j, int k) {
      return i < -8 ? 2.f : static_cast<float>(((i * 73 + j * 31 + k * 17) % 97 + 97) % 97);
    });
    for (int n = 0; n < 40; ++n) {
      IndexBox range;
      for (int axis = 0; axis < 3; ++axis)
        std::tie(range.lo[axis], range.hi[axis]) = std::minmax({coordinate(random), coordinate(random)});
      RangeSummary expected;
      Real count = 0, weighted = 0, weight = 0;
      const auto weights = [](int axis, int i) { return ((i + 64) % (axis + 2)) / Real(axis + 2); };
      for (int i = range.lo[0]; i <= range.hi[0]; ++i)
        for (int j = range.lo[1]; j <= range.hi[1]; ++j)
          for (int k = range.lo[2]; k <= range.hi[2]; ++k) {
            const Real v = grid.value(i, j, k), w = weights(0, i) * weights(1, j) * weights(2, k);
            expected.minimum = std::min(expected.minimum, v);
            expected.maximum = std::max(expected.maximum, v);
            expected.average += v;
            count += 1;
            weighted += w * v;
            weight += w;
          }
      const RangeSummary found = grid.summary(range);
      ASSERT_EQ(found.minimum, expected.minimum);
      ASSERT_EQ(found.maximum, expected.maximum);
      ASSERT_NEAR(found.average, expected.average / count, 1e-9);
      if (weight > 0) {
        ASSERT_NEAR(grid.summary(range, weights, weight).average,
                    std::clamp(weighted / weight, expected.minimum, expected.maximum), 1e-9);
      }
    }
  }
}

TEST(BrickGrid, BricksOfOneValueShareStorage) {
  // All that varies are the bricks whose voxels or aprons meet another value: the faces and the step between the halves.
  const IndexBox box{{0, 0, 0}, {399, 399, 399}};
  const BrickGrid grid = make(box, 0, [](int i, int, int) { return i < 200 ? 0.f : 1.f; });
  EXPECT_LT(grid.bytes(), 400u * 400 * 400 * sizeof(float) / 7);
  EXPECT_EQ(grid.trilinear(199.25, 200, 200), 0.25);
  const BrickGrid one = make({{0, 0, 0}, {79, 79, 79}}, 0, numbered);
  EXPECT_LT(one.bytes(), 88u * 88 * 88 * sizeof(float) * 3 / 2);
}

/// A step between two values, across the third axis and along the others, in a box that cuts bricks on every side.
TEST(BrickGrid, BricksKnownByTheirCornersAreTheSame) {
  const IndexBox box{{-21, 3, -5}, {18, 30, 61}};
  const auto value = [](int k) { return k < 16 ? 0.5f : k < 48 ? 2.f : 0.25f; };
  const auto bricks = [&](const Index3& first, const auto& shape, const auto& visit) {
    const int lowest = first[2], bricks_up = static_cast<int>(shape[2]);
    for (std::size_t row = 0; row < shape[0] * shape[1]; ++row)
      for (int k = 0, end; k < bricks_up; k = end) {
        const auto values = [&](int at) { return std::pair(value(8 * (lowest + at)), value(8 * (lowest + at + 1))); };
        for (end = k + 1; end < bricks_up && values(end) == values(k);) ++end;
        const auto [own, next] = values(k);
        const BrickGrid::Corners corners{own, next, own, next, own, next, own, next};
        const std::size_t begin = row * shape[2];
        visit(begin + static_cast<std::size_t>(k), begin + static_cast<std::size_t>(end), &corners);
      }
  };
  const auto never = [](const Index3&, float*) { FAIL() << "nothing is left to ask for"; };
  const BrickGrid known = BrickGrid::build(box, 0.25f, bricks, never, serial);
  const BrickGrid asked = make(box, 0.25f, [&](int, int, int k) { return value(k); });
  EXPECT_EQ(known.content_hash(), asked.content_hash());
  for (int i = -24; i < 24; ++i)
    for (int j = 0; j < 40; ++j)
      for (int k = -16; k < 72; ++k) ASSERT_EQ(known.value(i, j, k), asked.value(i, j, k)) << i << ' ' << j << ' ' << k;
  EXPECT_LT(known.bytes(), asked.bytes() / 2);
}

TEST(BrickGrid, HashTellsValuesBoxAndBackgroundApart) {
  const IndexBox box{{-5, 0, 2}, {12, 9, 30}};
  const std::uint64_t hash = make(box, 0, numbered).content_hash();
  EXPECT_EQ(hash, make(box, 0, numbered).content_hash());
  EXPECT_NE(hash, make(box, 1, numbered).content_hash());
  EXPECT_NE(hash, make({box.lo, box.hi + Index3(1, 0, 0)}, 0, numbered).content_hash());
  EXPECT_NE(hash, make(box, 0, [](int i, int j, int k) {
                    return numbered(i, j, k) + (i == 3 && j == 3 && k == 3 ? 0.5f : 0.f);
                  }).content_hash());
}

TEST(BrickGrid, FindsTheFirstVoxel) {
  const IndexBox box{{-20, -20, -20}, {20, 20, 20}};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto is_nan = [](float v) { return std::isnan(v); };
  const BrickGrid grid = make(box, 0, [&](int i, int j, int k) {
    return (i == -3 && j == 19 && k == 5) || (i == -3 && j == 20 && k == -15) || (i > 4) ? nan : 1.f;
  });
  ASSERT_TRUE(grid.find(is_nan).has_value());
  EXPECT_EQ(*grid.find(is_nan), Index3(-3, 19, 5));
  EXPECT_FALSE(make(box, 0, numbered).find(is_nan).has_value());
}

TEST(BrickGrid, RefusesAbsurdBoxesBeforeAllocating) {
  const Voxels none = [](int, int, int) { return 0.f; };
  EXPECT_THROW(make({{0, 0, 0}, {1 << 20, 1 << 20, 1 << 20}}, 0, none), std::length_error);
  EXPECT_THROW(make({{INT_MIN, 0, 0}, {0, 0, 0}}, 0, none), std::length_error);
  EXPECT_THROW(make({{0, 0, 0}, {0, INT_MAX, 0}}, 0, none), std::length_error);
  EXPECT_THROW(make({{1, 0, 0}, {0, 0, 0}}, 0, none), std::length_error);
}

}  // namespace
}  // namespace nullmark
