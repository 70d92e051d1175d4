#include "media/majorants/octree.h"

#include <gtest/gtest.h>

#include "media/base/field.h"

namespace nullmark {
namespace {

/// Extinction k in the corner [0, .45 side]^3 of [0, side]^3, nothing elsewhere.
struct Corner {
  Real k = 1, side = 1;
  Box bounds() const { return {Vec3::Zero(), Vec3::Constant(side)}; }
  Real extinction(const Vec3& p) const { return (p.array() < 0.45 * side).all() ? k : 0; }
  Extrema extrema(const Box& box) const {
    const Real low = (box.hi.array() < 0.45 * side).all() ? k : 0, high = (box.lo.array() < 0.45 * side).all() ? k : 0;
    return Extrema::grey(low, (low + high) / 2, high);
  }
};

OctreeMajorant tree_over(const Corner& field, const OctreeOptions& options, Real looseness = 1) {
  return {FieldMedium<Corner>(field), options, looseness};
}

/// By hand, unit cube: N_merged S = 4k, N_split S = 4k/8 + 2 * 3.  Merged while 1.1 * 4k < k/2 + 6, so k < 6/3.9.
TEST(Octree, MergesWhereTheCostSaysSo) {
  EXPECT_EQ(tree_over({.k = 1.53}, {.max_depth = 1}).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 1.55}, {.max_depth = 1}).size().cells, 8u);
  EXPECT_EQ(tree_over({.k = 1.53 / 2, .side = 2}, {.max_depth = 1}).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 1.55 / 2, .side = 2}, {.max_depth = 1}).size().cells, 8u);
  EXPECT_EQ(tree_over({.k = 1.55 / 2}, {.max_depth = 1}, 2).size().cells, 8u);
  // 6/3.5 without the factor.
  EXPECT_EQ(tree_over({.k = 1.71}, {.max_depth = 1, .merge_factor = 1}).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 1.72}, {.max_depth = 1, .merge_factor = 1}).size().cells, 8u);
  // Half the crossing cost: 3/3.5.
  EXPECT_EQ(tree_over({.k = 0.85}, {.max_depth = 1, .merge_factor = 1, .crossing_cost = 0.5}).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 0.86}, {.max_depth = 1, .merge_factor = 1, .crossing_cost = 0.5}).size().cells, 8u);

  EXPECT_NEAR(tree_over({.k = 1.55}, {.max_depth = 1}).expected_cost(), (1.55 / 2 + 6) / 6, 1e-12);
}

/// Two levels by hand, factor 1: the corner fills its octant but for a rest of .05, so the inner split saves nothing where all 8
/// of its octants meet the corner; the outer one is judged with its parts merged.
TEST(Octree, JudgesASplitByWhatItsOctantsCameTo) {
  EXPECT_EQ(tree_over({.k = 1.72}, {.max_depth = 2, .merge_factor = 1}).size().cells, 8u);
  EXPECT_EQ(tree_over({.k = 1e6}, {.max_depth = 2}).size().cells, 8u);
  // At depth 3 the rest of .05 is told apart nowhere, at depth 5 (cells of 1/32) it is.
  EXPECT_EQ(tree_over({.k = 1e6}, {.max_depth = 3}).size().cells, 8u);
  EXPECT_GT(tree_over({.k = 1e6}, {.max_depth = 5}).size().cells, 8u);
}

/// (max - min) diagonal: k sqrt(3) reaches 1.442 at k = .8326.
TEST(Octree, TheRangeRuleSplitsWhereTheRangeIsOpticallyThick) {
  const OctreeOptions range{.max_depth = 1, .rule = OctreeRule::range};
  EXPECT_EQ(tree_over({.k = 0.83}, range).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 0.84}, range).size().cells, 8u);
  EXPECT_EQ(tree_over({.k = 0.84 / 2, .side = 2}, range).size().cells, 8u);
  EXPECT_EQ(tree_over({.k = 0.41}, {.max_depth = 1, .rule = OctreeRule::range, .range_limit = 0.72}).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 0.42}, {.max_depth = 1, .rule = OctreeRule::range, .range_limit = 0.72}).size().cells, 8u);
}

TEST(Octree, ForcedSplitsHalveEveryAxis) {
  const OctreeMajorant tree = tree_over({.k = 0}, {.max_depth = 4, .forced_depth = 2});
  EXPECT_EQ(tree.size().cells, 64u);
  const Ray ray{{0, 0.4, 0.9}, {1, 0, 0}, 0, 1};
  SegmentBuffer buffer;
  tree.segments(ray, ray, buffer);
  ASSERT_EQ(buffer.segments.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_DOUBLE_EQ(buffer.segments[i].end, static_cast<Real>(i + 1) / 4);
    EXPECT_DOUBLE_EQ(buffer.segments[i].diagonal, std::sqrt(3) / 4);
  }
  EXPECT_EQ(tree_over({.k = 0}, {.max_depth = 4, .forced_depth = 2, .rule = OctreeRule::range}).size().cells, 64u);
}

}  // namespace
}  // namespace nullmark
