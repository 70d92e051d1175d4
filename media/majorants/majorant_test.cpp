#include <gtest/gtest.h>

#include <random>

#include "media/checkerboard.h"
#include "media/cosine.h"
#include "media/exponential_cube.h"
#include "media/fractal_noise.h"
#include "media/gaussian_bump.h"
#include "media/linear.h"
#include "media/majorants/global.h"
#include "media/majorants/grid.h"
#include "media/majorants/prescribed.h"

namespace nullmark {
namespace {

template <class Field>
std::shared_ptr<const Medium> build() {
  return FieldSource<Field>().build();
}

std::vector<std::shared_ptr<const Medium>> media() {
  return {build<Linear>(), build<AlongAxis<CosineProfile>>(), build<AlongAxis<GaussianBumpProfile>>(), build<Checkerboard>(),
          build<FractalNoise>()};
}

Ray random_ray(std::mt19937_64& random, bool inside) {
  std::normal_distribution<Real> normal;
  std::uniform_real_distribution<Real> uniform(0, 1);
  const Vec3 direction = Vec3(normal(random), normal(random), normal(random)).normalized();
  const Vec3 at(uniform(random), uniform(random), uniform(random));
  const Ray ray = inside ? Ray{at, direction, 0, kInfinity} : Ray{at - 3 * direction, direction, 0, kInfinity};
  return clipped(ray, Box{});
}

void expect_covers(const SegmentBuffer& buffer, const Ray& ray) {
  ASSERT_FALSE(buffer.segments.empty());
  EXPECT_EQ(buffer.segments.front().begin, ray.begin);
  EXPECT_EQ(buffer.segments.back().end, ray.end);
  for (std::size_t i = 0; i + 1 < buffer.segments.size(); ++i) {
    EXPECT_EQ(buffer.segments[i].end, buffer.segments[i + 1].begin);
    EXPECT_LT(buffer.segments[i].begin, buffer.segments[i].end);
  }
}

void expect_bounds(const Medium& medium, const SegmentBuffer& buffer, const Ray& ray, std::mt19937_64& random) {
  std::uniform_real_distribution<Real> uniform(0, 1);
  for (const Segment& segment : buffer.segments)
    for (int i = 0; i < 8; ++i) {
      const Vec3 p = ray.at(segment.begin + uniform(random) * (segment.end - segment.begin));
      Real mu = 0;
      medium.extinction({&p.x(), &p.y(), &p.z(), 1}, &mu);
      EXPECT_LE(mu, segment.extinction.maximum[0] * (1 + 1e-12) + 1e-300);
      EXPECT_GE(mu, segment.extinction.minimum[0] * (1 - 1e-12));
    }
}

TEST(GridMajorant, CoversEveryRayAndBoundsTheExtinctionOnIt) {
  std::mt19937_64 random(1);
  for (const auto& medium : media())
    for (const std::array<int, 3>& resolution : {std::array{1, 1, 1}, std::array{7, 3, 5}, std::array{16, 16, 16}}) {
      const GridMajorant grid(*medium, resolution, 1);
      for (int i = 0; i < 200; ++i) {
        const Ray ray = random_ray(random, i % 2 == 0);
        SegmentBuffer buffer;
        grid.segments(ray, ray, buffer);
        expect_covers(buffer, ray);
        expect_bounds(*medium, buffer, ray, random);
        EXPECT_LE(buffer.segments.size(), static_cast<std::size_t>(resolution[0] + resolution[1] + resolution[2]));
      }
    }
}

TEST(GridMajorant, CrossesAsManyCellsAsARayHasPlanes) {
  const GridMajorant grid(*build<Linear>(), {8, 8, 8}, 1);
  for (const Real minus_zero : {0., -0.}) {
    const Ray ray = clipped({{-1, 0.4, 0.6}, {1, minus_zero, minus_zero}, 0, kInfinity}, Box{});
    SegmentBuffer buffer;
    grid.segments(ray, ray, buffer);
    ASSERT_EQ(buffer.segments.size(), 8u);
    for (std::size_t i = 0; i < 8; ++i) EXPECT_NEAR(buffer.segments[i].end - 1, static_cast<Real>(i + 1) / 8, 1e-12);
  }
  const Ray diagonal = clipped({{-1, -1, -1}, Vec3(1, 1, 1).normalized(), 0, kInfinity}, Box{});
  SegmentBuffer buffer;
  grid.segments(diagonal, diagonal, buffer);
  expect_covers(buffer, diagonal);
}

TEST(GridMajorant, RaysInACellPlaneOrOnAFaceStayBounded) {
  std::mt19937_64 random(2);
  const auto medium = build<FractalNoise>();
  const GridMajorant grid(*medium, {4, 4, 4}, 1);
  for (const Real y : {0., 0.25, 0.5, 1.}) {
    const Ray ray = clipped({{-1, y, 0.25}, {1, 0, 0}, 0, kInfinity}, Box{});
    SegmentBuffer buffer;
    grid.segments(ray, ray, buffer);
    expect_covers(buffer, ray);
    expect_bounds(*medium, buffer, ray, random);
  }
}

TEST(Majorants, EmptyIntervalsGiveNoSegment) {
  const auto medium = build<Linear>();
  const Ray miss = clipped({{-1, 5, 0}, {1, 0, 0}, 0, kInfinity}, Box{});
  EXPECT_EQ(miss.length(), 0);
  SegmentBuffer buffer;
  GlobalMajorant(*medium, 1).segments(miss, miss, buffer);
  EXPECT_TRUE(buffer.segments.empty());
  GridMajorant(*medium, {4, 4, 4}, 1).segments(miss, miss, buffer);
  EXPECT_TRUE(buffer.segments.empty());
  PrescribedMajorant(*medium, 5, Vec3::Zero()).segments(miss, miss, buffer);
  EXPECT_TRUE(buffer.segments.empty());
}

TEST(Majorants, LoosenessScalesTheRateAndLeavesTheExtrema) {
  const auto medium = build<Linear>();
  const Ray ray{{0, 0.5, 0.5}, {1, 0, 0}, 0, 1};
  SegmentBuffer tight, loose;
  GlobalMajorant(*medium, 1).segments(ray, ray, tight);
  GlobalMajorant(*medium, 5).segments(ray, ray, loose);
  EXPECT_DOUBLE_EQ(loose.segments[0].majorant, 5 * tight.segments[0].majorant);
  EXPECT_EQ(loose.segments[0].extinction.maximum[0], tight.segments[0].extinction.maximum[0]);
}

TEST(Majorants, PrescribedFollowsItsGradientAndRefusesNegativeRates) {
  const auto medium = build<Linear>();
  const Ray ray{{0, 0.25, 0.5}, {1, 0, 0}, 0, 1};
  SegmentBuffer buffer;
  PrescribedMajorant(*medium, 5, {0, 95, 0}).segments(ray, ray, buffer);
  EXPECT_DOUBLE_EQ(buffer.segments[0].majorant, 5 + 95 * 0.25);
  EXPECT_THROW(PrescribedMajorant(*medium, 5, {0, -6, 0}), ParameterError);
  EXPECT_THROW(PrescribedMajorant(*medium, 1e-320, {0, 0, 0}), ParameterError);
}

TEST(Majorants, AnUnboundedMediumNeedsAPrescribedRate) {
  const auto cube = build<AlongAxis<ExponentialCubeProfile>>();
  EXPECT_THROW(GlobalMajorant(*cube, 1), ParameterError);
  EXPECT_THROW(GridMajorant(*cube, {4, 4, 4}, 1), ParameterError);
  EXPECT_NO_THROW(PrescribedMajorant(*cube, 5, {0, 95, 0}));
}

}  // namespace
}  // namespace nullmark
