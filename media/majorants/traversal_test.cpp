// Cells that flights find on their way are those that are listed.

#include <gtest/gtest.h>

#include <random>

#include "harness/testing/built_media.h"
#include "media/base/channels.h"
#include "media/fractal_noise.h"
#include "media/gaussian_bump.h"
#include "media/majorants/bounds_table.h"
#include "media/majorants/global.h"
#include "media/majorants/grid.h"
#include "media/majorants/kd_tree.h"
#include "media/majorants/octree.h"
#include "media/majorants/ray_bounds.h"
#include "media/majorants/ray_maximum.h"

namespace nullmark {
namespace {

std::shared_ptr<const Medium> noise() {
  FractalNoise field;
  field.peak = 50;
  field.sharpness = 4;
  return built(field);
}

std::vector<std::shared_ptr<const MajorantStructure>> structures(const std::shared_ptr<const Medium>& medium) {
  return {std::make_shared<GlobalMajorant>(*medium, 1.5),
          std::make_shared<RayMaximumMajorant>(medium, 0.5, 1),
          std::make_shared<GridMajorant>(*medium, std::array{7, 1, 12}, 1),
          std::make_shared<GridMajorant>(*medium, std::array{16, 16, 16}, 0.5, Crossing::rewind),
          std::make_shared<KdTreeMajorant>(*medium, KdTreeOptions{.crossing_cost = 0.01}, 1),
          std::make_shared<OctreeMajorant>(*medium, OctreeOptions{.max_depth = 4, .crossing_cost = 0.01}, 1)};
}

/// Rays from outside, from inside, and along the axes, planes of cells included; some miss.
Ray any_ray(std::mt19937_64& random) {
  std::normal_distribution<Real> normal;
  std::uniform_real_distribution<Real> uniform(0, 1);
  Vec3 direction = Vec3(normal(random), normal(random), normal(random)).normalized();
  Vec3 at(uniform(random), uniform(random), uniform(random));
  const auto kind = random() % 6;
  if (kind == 0) direction = Vec3::Unit(static_cast<Eigen::Index>(random() % 3)) * (random() % 2 ? 1 : -1);
  if (kind == 1) at = (8 * at).array().round() / 8;
  if (kind == 2) at += 1.2 * direction;
  if (kind > 3) at -= 3 * direction;
  return clipped({at, direction, 0, kInfinity}, Box{});
}

TEST(Traversal, FindsTheSegmentsThatAreListed) {
  std::mt19937_64 random(3);
  std::exponential_distribution<Real> exponential;
  for (const auto& medium :
       {noise(), constant(3), std::shared_ptr<const Medium>(std::make_shared<Spectral>(noise(), std::vector<Real>{0.5, 2, 1}))})
    for (const auto& structure : structures(medium)) {
      RayBounds bounds;
      Rates rates;
      for (int i = 0; i < 2000; ++i) {
        const Ray ray = any_ray(random);
        SegmentBuffer listed;
        structure->segments(ray, ray, listed);
        bounds.start(*structure, ray, ray);
        bounds.start_rates(ray.begin, rates);
        Real depth = 0;
        while (random() % 8 && rates.reaches(depth)) depth += exponential(random);
        ASSERT_EQ(rates.size(), listed.segments.size());
        ASSERT_EQ(rates.crossing(), listed.crossing);
        for (std::size_t k = 0; k < listed.segments.size(); ++k) {
          ASSERT_EQ(rates.end(k), listed.segments[k].end);
          ASSERT_EQ(rates.rate(k), listed.segments[k].majorant);
        }
        ASSERT_EQ(rates.end(), ray.end > ray.begin ? ray.end : ray.begin);
        ASSERT_FALSE(rates.reaches(rates.total_depth()));
        ASSERT_FALSE(rates.has(listed.segments.size()));
      }
    }
}

/// Counts the cells that a traversal is asked for.
class Counted final : public Traversal {
 public:
  Counted(std::unique_ptr<Traversal> inner, std::size_t& cells) : inner_(std::move(inner)), cells_(cells) {}
  void start(const Ray& world, const Ray& local) override { inner_->start(world, local); }
  bool extend(RatePieces& pieces, Real depth) override {
    const std::size_t before = pieces.size();
    const bool goes_on = inner_->extend(pieces, depth);
    cells_ += pieces.size() - before;
    return goes_on;
  }

 private:
  std::unique_ptr<Traversal> inner_;
  std::size_t& cells_;
};

TEST(Traversal, StopsInTheCellOfTheDepth) {
  const auto medium = constant(64);
  const GridMajorant grid(*medium, {64, 1, 1}, 1);
  const Ray ray{{0, 0.5, 0.5}, Vec3::UnitX(), 0, 1};
  std::size_t cells = 0;
  Counted counted(grid.traversal(), cells);
  counted.start(ray, ray);
  Rates rates;
  rates.start(0, Crossing::carry, counted);
  EXPECT_TRUE(rates.reaches(4.5));
  EXPECT_EQ(cells, 5u);
  EXPECT_TRUE(rates.reaches(2));
  EXPECT_EQ(rates.rate(4), 64);
  EXPECT_EQ(cells, 5u);
  const Rates copy = rates;
  EXPECT_EQ(cells, 64u) << "a copy has no traversal of its own";
  EXPECT_EQ(copy.size(), 64u);
  EXPECT_EQ(rates.size(), 64u);
}

TEST(Traversal, RatesOfAPieceAreFoundWhenAskedFor) {
  const auto medium = constant(64);
  const GridMajorant grid(*medium, {64, 1, 1}, 2);
  RayBounds bounds;
  const Ray ray{{0, 0.5, 0.5}, Vec3::UnitX(), 0, 1};
  bounds.start(grid, ray, ray);
  Rates rates;
  bounds.start_rates(0, rates);
  EXPECT_EQ(rates.rate(0), 128);
  EXPECT_EQ(rates.depth_after(63), 128);
}

TEST(BoundsTable, GivesBackTheExtremaOfTheMedium) {
  const auto grey = noise();
  GaussianBump bump;
  bump.profile.amplitude = 5;
  const std::vector<std::shared_ptr<const Medium>> media = {
      grey, std::make_shared<Spectral>(grey, std::vector<Real>{0.1, 3, 0, 7}),
      std::make_shared<PerChannel>(std::vector<std::shared_ptr<const Medium>>{grey, built(bump)})};
  for (const auto& medium : media) {
    constexpr std::size_t kCells = 20;
    BoundsTable table(*medium, kCells);
    const auto box = [](std::size_t cell) {
      const Vec3 lo = Vec3::Constant(static_cast<Real>(cell) / kCells);
      return Box{lo, lo + Vec3::Constant(1. / kCells)};
    };
    for (std::size_t cell = 0; cell < kCells; ++cell) table.put(cell, BoundsTable::source(*medium).extrema(box(cell)));
    for (std::size_t cell = 0; cell < kCells; ++cell) {
      const Extrema expected = medium->extrema(box(cell)), found = table[cell];
      EXPECT_TRUE((found.minimum == expected.minimum).all());
      EXPECT_TRUE((found.average == expected.average).all());
      EXPECT_TRUE((found.maximum == expected.maximum).all());
      EXPECT_EQ(table.largest(cell), expected.maximum.maxCoeff());
    }
  }
}

TEST(BoundsTable, AGridHolds24BytesACell) {
  const auto spectral = std::make_shared<Spectral>(constant(1), std::vector<Real>(16, 1));
  for (const auto& medium : {constant(1), std::shared_ptr<const Medium>(spectral)}) {
    const StructureSize size = GridMajorant(*medium, {32, 32, 32}, 1).size();
    EXPECT_LT(size.bytes, 25 * size.cells);
  }
}

}  // namespace
}  // namespace nullmark
