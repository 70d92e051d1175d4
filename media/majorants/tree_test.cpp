// What kd-trees and octrees of bounds share: true bounds on contiguous segments, whatever the partition and the ray.

#include "media/majorants/tree.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <functional>
#include <random>

#include "harness/testing/built_media.h"
#include "media/base/channels.h"
#include "media/checkerboard.h"
#include "media/exponential_cube.h"
#include "media/fractal_noise.h"
#include "media/gaussian_bump.h"
#include "media/majorants/kd_tree.h"
#include "media/majorants/octree.h"

namespace nullmark {
namespace {

using MediumPointer = std::shared_ptr<const Medium>;

/// A medium in another frame.
class Placed final : public Medium {
 public:
  Placed(MediumPointer inner, const Affine& to_world) : inner_(std::move(inner)), to_local_(to_world.inverse()) {}
  int channels() const override { return inner_->channels(); }
  Box bounds() const override { return inner_->bounds(); }
  Affine world_to_local() const override { return to_local_; }
  void extinction(const Points& points, Real* out) const override { inner_->extinction(points, out); }
  Extrema extrema(const Box& box) const override { return inner_->extrema(box); }

 private:
  MediumPointer inner_;
  Affine to_local_;
};

MediumPointer bump(Real amplitude) {
  GaussianBump field;
  field.profile.amplitude = amplitude;
  return built(field);
}

MediumPointer noise(Real peak) {
  FractalNoise field;
  field.peak = peak;
  field.sharpness = 4;
  return built(field);
}

MediumPointer board(Real extinction, const std::array<int, 3>& cells = {3, 3, 3}) {
  Checkerboard field;
  field.even = extinction;
  field.cells = cells;
  return built(field);
}

Affine sheared() {
  Affine map = Affine::Identity();
  map.linear() << 2, 0.3, 0, 0, 1, -0.4, 0.1, 0, 3;
  map.translation() << 5, -1, 2;
  return map;
}

/// The second checkerboard jumps at planes of the lattice that `trees` has of 13 x 7 x 2 cells: segments end on either side.
std::vector<MediumPointer> tree_media() {
  return {built(Linear{}),
          bump(60),
          noise(200),
          board(50),
          board(2, {13, 7, 2}),
          std::make_shared<Placed>(noise(60), sheared()),
          std::make_shared<Spectral>(noise(80), std::vector<Real>{1, 0, 2})};
}

std::vector<std::unique_ptr<TreeMajorant>> trees(const Medium& medium, Real looseness = 1) {
  std::vector<std::unique_ptr<TreeMajorant>> all;
  const auto kd = [&](const KdTreeOptions& options) {
    all.push_back(std::make_unique<KdTreeMajorant>(medium, options, looseness));
  };
  const auto oct = [&](const OctreeOptions& options) {
    all.push_back(std::make_unique<OctreeMajorant>(medium, options, looseness));
  };
  kd({.resolution = {16, 16, 16}});
  kd({.resolution = {13, 7, 2}, .forced_depth = 6});
  kd({.resolution = {16, 16, 16}, .lookahead = 4});
  kd({.resolution = {1, 1, 1}, .forced_depth = 6});
  kd({.resolution = {32, 32, 32}, .max_depth = TreeMajorant::kDeepest, .crossing_cost = 0});
  oct({.max_depth = 4});
  oct({.max_depth = 0, .forced_depth = 3});
  oct({.max_depth = 3, .forced_depth = 3});
  oct({.max_depth = 4, .rule = OctreeRule::range});
  return all;
}

void expect_sound(const Medium& medium, const TreeMajorant& tree, Ray world, std::mt19937_64& random) {
  const Ray local = clipped(transformed(world, medium.world_to_local()), medium.bounds());
  world.begin = local.begin;
  world.end = local.end;
  SegmentBuffer buffer;
  tree.segments(world, local, buffer);
  if (!(world.length() > 0)) {
    EXPECT_TRUE(buffer.segments.empty());
    return;
  }
  ASSERT_FALSE(buffer.segments.empty());
  EXPECT_LE(buffer.segments.size(), tree.size().cells);
  EXPECT_EQ(buffer.segments.front().begin, world.begin);
  EXPECT_EQ(buffer.segments.back().end, world.end);
  std::uniform_real_distribution<Real> uniform(0, 1);
  const int channels = medium.channels();
  std::vector<Real> mu(static_cast<std::size_t>(channels));
  for (std::size_t i = 0; i < buffer.segments.size(); ++i) {
    const Segment& segment = buffer.segments[i];
    EXPECT_LT(segment.begin, segment.end);
    if (i > 0) {
      EXPECT_EQ(buffer.segments[i - 1].end, segment.begin);
    }
    EXPECT_GT(segment.diagonal, 0);
    for (const Real s : {Real{0}, uniform(random), uniform(random), uniform(random), Real{1}}) {
      const Vec3 p = local.at(segment.begin + s * (segment.end - segment.begin));
      medium.extinction({&p.x(), &p.y(), &p.z(), 1}, mu.data());
      for (int c = 0; c < channels; ++c) {
        EXPECT_LE(mu[static_cast<std::size_t>(c)], segment.extinction.maximum[c] * (1 + 1e-12) + 1e-300);
        EXPECT_GE(mu[static_cast<std::size_t>(c)], segment.extinction.minimum[c] * (1 - 1e-12));
        EXPECT_LE(mu[static_cast<std::size_t>(c)], segment.majorant * (1 + 1e-12) + 1e-300);
        EXPECT_LE(segment.extinction.minimum[c], segment.extinction.average[c]);
        EXPECT_GE(segment.extinction.maximum[c], segment.extinction.average[c]);
      }
    }
  }
}

/// Points through which rays of a medium are laid, in the world.
Vec3 world_point(const Medium& medium, const Vec3& fraction) {
  const Box box = medium.bounds();
  return medium.world_to_local().inverse() * Vec3(box.lo + fraction.cwiseProduct(box.extent()));
}

TEST(TreeMajorant, BoundsEveryRayOnContiguousSegments) {
  std::mt19937_64 random(1);
  std::normal_distribution<Real> normal;
  std::uniform_real_distribution<Real> uniform(0, 1);
  for (const MediumPointer& medium : tree_media())
    for (const auto& tree : trees(*medium))
      for (int i = 0; i < 100; ++i) {
        const Vec3 direction = Vec3(normal(random), normal(random), normal(random)).normalized();
        const Vec3 at = world_point(*medium, {uniform(random), uniform(random), uniform(random)});
        expect_sound(*medium, *tree,
                     i % 2 == 0 ? Ray{at, direction, 0, kInfinity} : Ray{at - 20 * direction, direction, 0, kInfinity}, random);
      }
}

/// Rays along axes with components of either zero, inside planes of the partition, along edges and faces of the box, through
/// corners, nearly parallel to planes, and past the box.
TEST(TreeMajorant, BoundsRaysThatGrazeItsPlanes) {
  std::mt19937_64 random(2);
  const Real fractions[] = {0, 0.25, 0.5, 1. / 3, 1};
  for (const MediumPointer& medium : tree_media())
    for (const auto& tree : trees(*medium))
      for (int axis = 0; axis < 3; ++axis)
        for (const Real u : fractions)
          for (const Real v : fractions) {
            Vec3 at;
            at[axis] = 0;
            at[(axis + 1) % 3] = u;
            at[(axis + 2) % 3] = v;
            const Vec3 from = world_point(*medium, at);
            at[axis] = 1;
            const Vec3 along = (world_point(*medium, at) - from).normalized();
            for (const Real sign : {1., -1.})
              for (const Real tilt : {0., -0., 1e-17, 1e-300}) {
                Vec3 direction = sign * along;
                for (int k = 0; k < 3; ++k)
                  if (direction[k] == 0) direction[k] = tilt;
                expect_sound(*medium, *tree, {from - 5 * direction, direction, 0, kInfinity}, random);
                expect_sound(*medium, *tree, {from, direction, 0, kInfinity}, random);
              }
            // Diagonals from the face's points cross several planes at once.
            expect_sound(*medium, *tree, {from, Vec3(1, 1, 1).normalized(), 0, kInfinity}, random);
            expect_sound(*medium, *tree, {from, Vec3(-1, 1, 0).normalized(), 0, kInfinity}, random);
          }
}

TEST(TreeMajorant, HomogeneousMediaAreNeverCut) {
  for (const Real extinction : {0., 1e-3, 1., 15.1, 1e3, 1e9})
    for (const Real looseness : {1., 5., 1 / 3.})
      for (const Affine& frame : {Affine(Affine::Identity()), sheared()})
        for (const MediumPointer& medium : {constant(extinction), MediumPointer(std::make_shared<Spectral>(
                                                                      constant(extinction), std::vector<Real>{1, 0.3, 2}))}) {
          const Placed placed(medium, frame);
          EXPECT_EQ(KdTreeMajorant(placed, {.resolution = {16, 16, 16}}, looseness).size().cells, 1u);
          EXPECT_EQ(KdTreeMajorant(placed, {.resolution = {7, 3, 5}, .lookahead = 9}, looseness).size().nodes, 1u);
          EXPECT_EQ(KdTreeMajorant(placed, {.resolution = {4, 4, 4}, .lookahead = 9, .crossing_cost = 0}, looseness).size().nodes,
                    1u);
          EXPECT_EQ(OctreeMajorant(placed, {.max_depth = 4}, looseness).size().cells, 1u);
          EXPECT_EQ(OctreeMajorant(placed, {.max_depth = 4, .rule = OctreeRule::range}, looseness).size().cells, 1u);
        }
}

TEST(TreeMajorant, SizesAreThoseOfABinaryTree) {
  const MediumPointer medium = noise(200);
  for (const auto& tree : trees(*medium)) {
    const StructureSize size = tree->size();
    EXPECT_EQ(size.nodes, 2 * size.cells - 1);
    EXPECT_GE(size.bytes, size.cells * 4 * sizeof(Real) + size.nodes * 2 * sizeof(Real));
  }
  EXPECT_EQ(OctreeMajorant(*medium, {.max_depth = 3, .forced_depth = 3}, 1).size().cells, 512u);
  EXPECT_EQ(KdTreeMajorant(*medium, {.resolution = {64, 64, 64}, .max_depth = 5, .forced_depth = 5}, 1).size().cells, 32u);
}

TEST(TreeMajorant, LoosenessScalesTheRateAndLeavesTheExtrema) {
  const MediumPointer medium = bump(40);
  const KdTreeOptions options{.resolution = {16, 16, 16}, .max_depth = 3, .forced_depth = 3, .crossing_cost = 1};
  const OctreeOptions octants{.max_depth = 2, .forced_depth = 2};
  const Ray ray{{0, 0.4, 0.4}, {1, 0, 0}, 0, 1};
  const auto expect_scaled = [&](const TreeMajorant& tight, const TreeMajorant& loose) {
    SegmentBuffer a, b;
    tight.segments(ray, ray, a);
    loose.segments(ray, ray, b);
    ASSERT_GT(a.segments.size(), 1u);
    ASSERT_EQ(a.segments.size(), b.segments.size());
    for (std::size_t i = 0; i < a.segments.size(); ++i) {
      EXPECT_DOUBLE_EQ(b.segments[i].majorant, 0.5 * a.segments[i].majorant);
      EXPECT_EQ(b.segments[i].extinction.maximum[0], a.segments[i].extinction.maximum[0]);
    }
  };
  expect_scaled(OctreeMajorant(*medium, octants, 1), OctreeMajorant(*medium, octants, 0.5));
  // Where bounds are halved lookups save half as much: the same cuts cost half as much.
  KdTreeOptions cheaper = options;
  cheaper.crossing_cost = 0.5;
  expect_scaled(KdTreeMajorant(*medium, options, 1), KdTreeMajorant(*medium, cheaper, 0.5));
}

TEST(TreeMajorant, SegmentsTellTheCrossingRule) {
  const MediumPointer medium = bump(40);
  const Ray ray{{0, 0.4, 0.4}, {1, 0, 0}, 0, 1};
  SegmentBuffer buffer;
  KdTreeMajorant(*medium, {}, 1, Crossing::rewind).segments(ray, ray, buffer);
  EXPECT_EQ(buffer.crossing, Crossing::rewind);
  KdTreeMajorant(*medium, {}, 1).segments(ray, ray, buffer);
  EXPECT_EQ(buffer.crossing, Crossing::carry);
  OctreeMajorant(*medium, {}, 1, Crossing::rewind).segments(ray, ray, buffer);
  EXPECT_EQ(buffer.crossing, Crossing::rewind);
}

TEST(TreeMajorant, AnUnboundedMediumNeedsAPrescribedRate) {
  const MediumPointer cube = built(AlongAxis<ExponentialCubeProfile>{});
  EXPECT_THROW(KdTreeMajorant(*cube, {}, 1), ParameterError);
  EXPECT_THROW(OctreeMajorant(*cube, {}, 1), ParameterError);
}

TEST(TreeMajorant, AreTheSameForAnyNumberOfThreads) {
  const MediumPointer medium = noise(300);
  const auto told = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    std::vector<Real> numbers;
    for (const auto& tree : {std::unique_ptr<TreeMajorant>(new KdTreeMajorant(*medium, {.resolution = {48, 48, 48}}, 1)),
                             std::unique_ptr<TreeMajorant>(new OctreeMajorant(*medium, {.max_depth = 5}, 1))}) {
      numbers.push_back(static_cast<Real>(tree->size().cells));
      numbers.push_back(tree->expected_cost());
      EXPECT_GT(tree->size().cells, 100u);
      for (int y = 0; y < 16; ++y)
        for (int z = 0; z < 16; ++z) {
          const Ray ray = clipped({{-1, y / 16., z / 16.}, Vec3(1, 0.1, -0.2).normalized(), 0, kInfinity}, Box{});
          SegmentBuffer buffer;
          tree->segments(ray, ray, buffer);
          for (const Segment& segment : buffer.segments)
            numbers.insert(numbers.end(),
                           {segment.begin, segment.end, segment.majorant, segment.extinction.average[0], segment.diagonal});
        }
    }
    return numbers;
  };
  EXPECT_EQ(told(1), told(2));
}

/// Isotropic uniform lines through the box of a placed medium, by rejection from its bounding sphere.
class Lines {
 public:
  explicit Lines(const Medium& medium) : medium_(medium), centre_(world_point(medium, Vec3::Constant(0.5))) {
    for (int corner = 0; corner < 8; ++corner)
      radius_ = std::max(radius_, (world_point(medium, Vec3(corner & 1, corner >> 1 & 1, corner >> 2)) - centre_).norm());
  }

  /// Mean over n lines that hit the box.
  Real mean(int n, const std::function<Real(const Ray& world, const Ray& local)>& f) {
    std::normal_distribution<Real> normal;
    std::uniform_real_distribution<Real> uniform(-1, 1);
    Real sum = 0;
    for (int hits = 0; hits < n;) {
      const Vec3 direction = Vec3(normal(random_), normal(random_), normal(random_)).normalized();
      const Vec3 side = direction.unitOrthogonal(), other = direction.cross(side);
      const Real u = uniform(random_), v = uniform(random_);
      if (u * u + v * v > 1) continue;
      Ray world{centre_ + radius_ * (u * side + v * other - direction), direction, 0, 2 * radius_};
      const Ray local = clipped(transformed(world, medium_.world_to_local()), medium_.bounds());
      if (!(local.length() > 0)) continue;
      world.begin = local.begin;
      world.end = local.end;
      sum += f(world, local);
      ++hits;
    }
    return sum / n;
  }

 private:
  const Medium& medium_;
  Vec3 centre_;
  Real radius_ = 0;
  std::mt19937_64 random_{3};
};

/// Lookups of ratio tracking (the majorant's depth) and crossings, over 20000 lines, against the cost the trees were cut by.  The
/// standard errors of either mean are below 1.5 % here.
TEST(TreeMajorant, CostPredictsLookupsAndCrossingsOfRandomLines) {
  for (const MediumPointer& medium :
       {bump(60), noise(200), board(50), MediumPointer(std::make_shared<Placed>(noise(60), sheared()))})
    for (const auto& tree : trees(*medium)) {
      SegmentBuffer buffer;
      const Real measured = Lines(*medium).mean(20000, [&](const Ray& world, const Ray& local) {
        tree->segments(world, local, buffer);
        Real cost = static_cast<Real>(buffer.segments.size()) - 1;
        for (const Segment& segment : buffer.segments) cost += segment.majorant * (segment.end - segment.begin);
        return cost;
      });
      EXPECT_NEAR(tree->expected_cost() / measured, 1, 0.1);
    }
}

}  // namespace
}  // namespace nullmark
