#include "media/majorants/kd_tree.h"

#include <gtest/gtest.h>

#include "media/fractal_noise.h"

namespace nullmark {
namespace {

/// Extinction k beyond x = step, nothing before; on a box [0, length] x [0,1]^2.
struct Step {
  Real k = 1, step = 0.5, length = 1;
  Box bounds() const { return {Vec3::Zero(), {length, 1, 1}}; }
  Real extinction(const Vec3& p) const { return p.x() > step ? k : 0; }
  Extrema extrema(const Box& box) const {
    const Real low = box.lo.x() > step ? k : 0, high = box.hi.x() > step ? k : 0;
    return Extrema::grey(low, (low + high) / 2, high);
  }
};

KdTreeMajorant tree_over(const Step& field, Real looseness = 1, Real crossing_cost = 1) {
  return {FieldMedium<Step>(field), {.resolution = {5, 1, 1}, .crossing_cost = crossing_cost}, looseness};
}

/// By hand: five slabs, the step inside the third, so the best plane is at 2/5.  The cut saves 4 k (2/5) L lookups and adds 2
/// crossings (area 1): it pays for k L > 5/4.
TEST(KdTree, CutsWhereTheLookupsSavedPayForTheCrossing) {
  EXPECT_EQ(tree_over({.k = 1.24}).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 1.26}).size().cells, 2u);
  EXPECT_EQ(tree_over({.k = 0.62, .step = 1, .length = 2}).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 0.63, .step = 1, .length = 2}).size().cells, 2u);
  EXPECT_EQ(tree_over({.k = 0.62}, 2).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 0.63}, 2).size().cells, 2u);
  EXPECT_EQ(tree_over({.k = 3.7}, 1, 3).size().cells, 1u);
  EXPECT_EQ(tree_over({.k = 3.8}, 1, 3).size().cells, 2u);

  // S = 6 for the cube.
  EXPECT_NEAR(tree_over({.k = 1.24}).expected_cost(), 4 * 1.24 / 6, 1e-12);
  EXPECT_NEAR(tree_over({.k = 1.26}).expected_cost(), (4 * 1.26 * 0.6 + 2) / 6, 1e-12);
  const Ray ray{{0, 0.5, 0.5}, {1, 0, 0}, 0, 1};
  SegmentBuffer buffer;
  tree_over({.k = 1.26}).segments(ray, ray, buffer);
  ASSERT_EQ(buffer.segments.size(), 2u);
  EXPECT_DOUBLE_EQ(buffer.segments[0].end, 0.4);
  EXPECT_EQ(buffer.segments[0].majorant, 0);
  EXPECT_DOUBLE_EQ(buffer.segments[0].diagonal, std::sqrt(2 + 0.16));
}

/// All planes of all axes, bounds by looking at every lattice cell.
TEST(KdTree, TheBestCutIsTheBestOfAllPlanes) {
  FractalNoise field;
  field.peak = 100;
  field.sharpness = 4;
  field.prepare();
  const BoundLattice lattice(FieldMedium<FractalNoise>(field), {9, 7, 8});
  for (const Block& block : {lattice.whole(), Block{{2, 1, 3}, {9, 4, 8}}, Block{{0, 0, 0}, {1, 7, 1}}}) {
    const auto rate = [&](const Block& part) { return lattice.bounds(part).maximum[0]; };
    Real best = -kInfinity;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int plane = block.lo[axis] + 1; plane < block.hi[axis]; ++plane) {
        const Block below = block.below(axis, plane), above = block.above(axis, plane);
        best = std::max(best, 4 * (rate(block) * lattice.volume(block) - rate(below) * lattice.volume(below) -
                                   rate(above) * lattice.volume(above)) -
                                  2 * lattice.cut(block, axis));
      }
    const KdCut cut = best_kd_cut(lattice, block, 1, 1);
    EXPECT_NEAR(cut.gain, best, 1e-12 * rate(block));
    const Block below = block.below(cut.axis, cut.plane), above = block.above(cut.axis, cut.plane);
    EXPECT_NEAR(
        4 * (rate(block) * lattice.volume(block) - rate(below) * lattice.volume(below) - rate(above) * lattice.volume(above)) -
            2 * lattice.cut(block, cut.axis),
        best, 1e-12 * rate(block));
  }
  EXPECT_EQ(best_kd_cut(lattice, {{3, 3, 3}, {4, 4, 4}}, 1, 1).gain, -kInfinity);
}

/// Homogeneous stretches by 2 : 1 : 1 are cut across the longest axis first, in the middle.
TEST(KdTree, ForcedCutsHalveTheLongestAxis) {
  const KdTreeMajorant tree(FieldMedium<Step>({.k = 1, .step = -1, .length = 2}),
                            {.resolution = {8, 8, 8}, .max_depth = 40, .forced_depth = 1}, 1);
  EXPECT_EQ(tree.size().cells, 2u);
  const Ray ray{{0, 0.4, 0.4}, {1, 0, 0}, 0, 2};
  SegmentBuffer buffer;
  tree.segments(ray, ray, buffer);
  ASSERT_EQ(buffer.segments.size(), 2u);
  EXPECT_DOUBLE_EQ(buffer.segments[0].end, 1);
}

/// Extinction k in every second of 16 slabs of the unit cube, the second one first.
struct Comb {
  Real k = 1;
  Box bounds() const { return {}; }
  Real extinction(const Vec3& p) const { return static_cast<int>(p.x() * 16) % 2 == 1 ? k : 0; }
  Extrema extrema(const Box& box) const {
    const Real value = extinction((box.lo + box.hi) / 2);
    return box.extent().x() < 1.1 / 16 ? Extrema::grey(value, value, value) : Extrema::grey(0, k / 2, k);
  }
};

/// By hand: the empty slab at the end saves 4 k/16 lookups for one plane's 2 crossings, so from k = 8; each one between teeth
/// needs two planes, so from k = 16, and the first of the two always loses.
TEST(KdTree, LookaheadTakesLossesThatOtherCutsRepay) {
  const auto cells = [](Real k, int lookahead) {
    return KdTreeMajorant(FieldMedium<Comb>({.k = k}), {.resolution = {16, 1, 1}, .lookahead = lookahead}, 1).size().cells;
  };
  EXPECT_EQ(cells(7.9, 0), 1u);
  EXPECT_EQ(cells(8.1, 0), 2u);
  EXPECT_EQ(cells(100, 0), 2u);
  for (const int lookahead : {3, 15}) {
    EXPECT_EQ(cells(7.9, lookahead), 1u);
    EXPECT_EQ(cells(15.9, lookahead), 2u);
    EXPECT_EQ(cells(16.1, lookahead), 16u);
  }
  EXPECT_EQ(cells(16.1, 1), 8u);  // middle cuts come first, and where two of them would have to lose in a row none is made
}

}  // namespace
}  // namespace nullmark
