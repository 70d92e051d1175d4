// Values of single media that are known in another way.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "media/base/philox.h"
#include "media/media_test.h"

namespace nullmark {
namespace {

using namespace media_test;

TEST(ExponentialCube, PerpendicularRaysHaveThePowerLaw) {
  const auto medium = make("exponential_cube");
  for (const Real x : {1e-12, 0.1, 0.5, 0.999}) {
    const auto depth = medium->optical_depth({{x, 0.3, 0}, {0, 0, 1}, 0, 0.75});
    EXPECT_NEAR(std::exp(-(*depth)[0]), std::pow(x, 0.75), 1e-15);
  }
  EXPECT_EQ(medium->extrema({{0, 0, 0}, {0.5, 1, 1}}).maximum[0], kInfinity);
  EXPECT_TRUE(std::isfinite(medium->extrema({{1e-9, 0, 0}, {0.5, 1, 1}}).maximum[0]));
  EXPECT_NEAR(medium->extrema({{0, 0, 0}, {1, 1, 1}}).average[0], 1, 1e-15);
}

TEST(Cosine, BoundsHaveTheInnerExtrema) {
  const auto medium = make("cosine");
  const Real crest = (2 * std::numbers::pi - 0.8) / 20, trough = (std::numbers::pi - 0.8) / 20;
  EXPECT_EQ(medium->extrema({{crest - 1e-3, 0, 0}, {crest + 2e-3, 1, 1}}).maximum[0], 2);
  EXPECT_EQ(medium->extrema({{trough - 1e-3, 0, 0}, {trough + 2e-3, 1, 1}}).minimum[0], 0);
}

// Far in the tail the difference of error functions keeps its digits: the first terms of the asymptotic series say what it is.
TEST(GaussianBump, TailKeepsRelativeAccuracy) {
  const auto medium = make("gaussian_bump", {{"sigma", 0.02}});
  const Real found = (*medium->optical_depth({{0.8, 0.5, 0.5}, {1, 0, 0}, 0, 0.2}))[0];
  const long double z = (static_cast<long double>(0.8) - static_cast<long double>(0.32)) / static_cast<long double>(0.02),
                    q = 1 / (z * z);
  long double term = 1, series = 0;
  for (int k = 0; k < 20; ++k, term *= -(2 * k - 1) * q) series += term;
  const auto expected = static_cast<Real>(static_cast<long double>(0.02) * std::exp(-z * z / 2) / z * series);
  EXPECT_NEAR(found / expected, 1, 1e-12);
}

// A majorant grid aligned with the cells has tight bounds in every one of them.
TEST(StepMedia, AlignedBoxesHaveTightBounds) {
  for (const int n : {3, 7, 10, 12}) {
    std::vector<Real> values;
    for (int i = 0; i < n; ++i) values.push_back(1 + i % 3);
    const Settings where = {{"lo", kLo}, {"hi", kHi}};
    Settings layers = where, board = where;
    layers["values"] = values;
    board["cells_x"] = board["cells_y"] = board["cells_z"] = n;
    for (const auto& medium : {make("layers", layers), make("checkerboard", board)})
      for (int i = 0; i < n; ++i) {
        const Vec3 step = (kHi - kLo) / n;
        const Vec3 lo = kLo + i * step, hi = kLo + (i + 1) * step;
        const Extrema e = medium->extrema({lo, hi});
        EXPECT_EQ(e.minimum[0], e.maximum[0]) << n << ", " << i;
      }
  }
}

TEST(StepMedia, EdgesBelongToTheCellAbove) {
  const Vec3 p(0.25, 0.1, 0.1);
  Real value = -1;
  make("layers")->extinction({&p[0], &p[1], &p[2], 1}, &value);
  EXPECT_EQ(value, 2);
  make("checkerboard")->extinction({&p[0], &p[1], &p[2], 1}, &value);
  EXPECT_EQ(value, 2);
  const Vec3 top = Vec3::Ones();
  make("checkerboard", {{"cells_x", 3}, {"cells_y", 3}, {"cells_z", 3}})->extinction({&top[0], &top[1], &top[2], 1}, &value);
  EXPECT_EQ(value, 2);
}

TEST(FractalNoise, EqualsThePlainSumOfOctaves) {
  const auto medium = make("fractal_noise", {{"seed", 5}, {"octaves", 3}, {"gain", 0.25}});
  std::mt19937_64 random(3);
  std::uniform_real_distribution<Real> uniform(0, 1);
  for (int i = 0; i < 500; ++i) {
    const Vec3 p(uniform(random), uniform(random), uniform(random));
    Real n = 0;
    for (int o = 0; o < 3; ++o) {
      const Vec3 q = p * (4 << o), cell = q.array().floor(), t = q - cell;
      const Vec3 w = t.array().square() * (3 - 2 * t.array());
      Real noise = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 c(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        const auto index = [&](int axis) { return static_cast<std::uint32_t>(cell[axis] + c[axis]); };
        const Real value = philox4x32({index(0), index(1), index(2), static_cast<std::uint32_t>(o)}, {5, 0})[0] * 0x1p-32;
        noise += value * (c.array() * w.array() + (1 - c.array()) * (1 - w.array())).prod();
      }
      n += noise * std::pow(0.25, o) / 1.3125;
    }
    Real found = 0;
    medium->extinction({&p[0], &p[1], &p[2], 1}, &found);
    ASSERT_NEAR(found, 10 * n * n, 1e-5);  // lattice values keep 24 bits
  }
}

TEST(FractalNoise, SeedsDiffer) {
  std::set<Real> values;
  const Vec3 p(0.3, 0.4, 0.5);
  for (int seed = 0; seed < 20; ++seed) {
    Real value = 0;
    make("fractal_noise", {{"seed", seed}})->extinction({&p[0], &p[1], &p[2], 1}, &value);
    values.insert(value);
  }
  EXPECT_EQ(values.size(), 20u);
}

}  // namespace
}  // namespace nullmark
