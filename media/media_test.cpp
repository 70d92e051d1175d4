// What every procedural medium promises: its formula, bounds, average, optical depth, knots.

#include "media/media_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/math/special_functions/legendre.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "media/media_cases_test.h"

namespace nullmark {
namespace {

using namespace media_test;

class MediaTest : public testing::TestWithParam<Case> {
 protected:
  const std::shared_ptr<const Medium> medium_ = make(GetParam().type, GetParam().settings);
  const Box whole_ = medium_->bounds();
  std::mt19937_64 random_{17};

  Real uniform(Real a = 0, Real b = 1) { return std::uniform_real_distribution<Real>(a, b)(random_); }

  Vec3 point(const Box& box) {
    return (box.lo + Vec3(uniform(), uniform(), uniform()).cwiseProduct(box.extent())).cwiseMax(box.lo).cwiseMin(box.hi);
  }

  Real look_up(const Vec3& p) const {
    Real value = -1;
    medium_->extinction({&p[0], &p[1], &p[2], 1}, &value);
    return value;
  }

  /// Sides from a whole axis down to 1e-9 of it, some of them zero, some on the faces.
  Box box() {
    Box b;
    for (int axis = 0; axis < 3; ++axis) {
      const Real size = whole_.extent()[axis], side = uniform() < 0.1 ? 0 : size * std::pow(10., -9 * std::pow(uniform(), 2));
      const Real at = uniform() < 0.1 ? 0 : uniform() < 0.1 ? size - side : uniform() * (size - side);
      b.lo[axis] = std::clamp(whole_.lo[axis] + at, whole_.lo[axis], whole_.hi[axis]);
      b.hi[axis] = std::clamp(b.lo[axis] + side, b.lo[axis], whole_.hi[axis]);
    }
    return b;
  }

  /// Rays through the box in all directions: generic, axis-parallel with +0 and -0, nearly so, either way along it.
  Ray ray() {
    static constexpr Real kSmall[] = {0., -0., 1e-9, -1e-9, 1e-5, -1e-5};
    Ray r;
    r.origin = point(whole_);
    std::normal_distribution<Real> normal;
    r.direction = Vec3(normal(random_), normal(random_), normal(random_)).normalized();
    const int kind = std::uniform_int_distribution<int>(0, 9)(random_);
    for (int axis = 0; axis < 3; ++axis)
      if (kind < 3 ? axis != kind : kind < 6 && axis == kind - 3)
        r.direction[axis] = kSmall[std::uniform_int_distribution<int>(0, 5)(random_)];
    r.direction.normalize();
    // Backed off, so that the interval does not start at 0.
    r.origin -= uniform(0, 2) * r.direction;
    r.begin = 0;
    r = clipped(r, whole_);
    if (uniform() < 0.5) {
      const Real a = uniform(r.begin, r.end), b = uniform(r.begin, r.end);
      r.begin = std::min(a, b);
      r.end = std::max(a, b);
    }
    return r;
  }

  std::vector<Real> pieces(const Ray& r) const {
    std::vector<Real> t;
    medium_->knots(r, t);
    for (const Real at : t) EXPECT_TRUE(at > r.begin && at < r.end);
    t.push_back(r.begin);
    t.push_back(r.end);
    std::sort(t.begin(), t.end());
    return t;
  }

  template <class Rule>
  Real integrate(const Ray& r, const Rule& rule) const {
    const std::vector<Real> t = pieces(r);
    Real sum = 0;
    for (std::size_t i = 1; i < t.size(); ++i)
      if (t[i] > t[i - 1]) sum += rule([&](Real at) { return look_up(r.at(at)); }, t[i - 1], t[i]);
    return sum;
  }

  /// Adaptive Gauss-Kronrod between knots.
  Real oracle(const Ray& r) const {
    return integrate(r, [](const auto& f, Real a, Real b) {
      return boost::math::quadrature::gauss_kronrod<Real, 31>::integrate(f, a, b, 6, 1e-12);
    });
  }

  /// What an error of rounding in the ray's points can do to the optical depth: 1e-14 relative plus the change under shifts of a
  /// few ulps, told from larger shifts where mu is smooth.
  Real tolerance(const Ray& r, Real depth) const {
    constexpr Real kShift = 1e-9, kUlps = 8 * std::numeric_limits<Real>::epsilon();
    Real change = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (const Real side : {-1., 1.}) {
        Ray moved = r;
        moved.origin[axis] += side * kShift;
        const Real size = std::max(std::abs(r.at(r.begin)[axis]), std::abs(r.origin[axis])) + whole_.extent()[axis];
        const Real shifted = integrate(
            moved, [](const auto& f, Real a, Real b) { return boost::math::quadrature::gauss<Real, 30>::integrate(f, a, b); });
        change = std::max(change, std::abs(shifted - depth) / kShift * kUlps * size);
      }
    return 1e-14 * depth + change + 1e-300;
  }
};

TEST_P(MediaTest, ExtinctionIsFiniteAndNotNegative) {
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p = point(i % 2 == 0 ? whole_ : box());
    const Real value = look_up(p);
    ASSERT_TRUE(std::isfinite(value) && value >= 0) << value << " at " << p.transpose();
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p((corner & 1 ? whole_.hi : whole_.lo)[0], (corner & 2 ? whole_.hi : whole_.lo)[1],
                 (corner & 4 ? whole_.hi : whole_.lo)[2]);
    EXPECT_TRUE(std::isfinite(look_up(p)) && look_up(p) >= 0);
    // Points are inside up to rounding only.
    const Vec3 beyond = p + 1e-15 * (p - (whole_.lo + whole_.hi) / 2);
    EXPECT_TRUE(std::isfinite(look_up(beyond)) && look_up(beyond) >= 0);
  }
}

TEST_P(MediaTest, ExtinctionFollowsItsFormula) {
  if (!GetParam().formula) return;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p = point(whole_);
    std::array<long double, 3> s;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      s[a] =
          (static_cast<long double>(p[axis]) - whole_.lo[axis]) / (static_cast<long double>(whole_.hi[axis]) - whole_.lo[axis]);
    }
    const auto expected = static_cast<Real>(GetParam().formula(s));
    ASSERT_NEAR(look_up(p), expected, 1e-13 * std::abs(expected) + 1e-14) << p.transpose();
  }
}

TEST_P(MediaTest, BlockEqualsSingleLookups) {
  std::vector<Real> x, y, z, out(100, -1);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Vec3 p = point(whole_);
    x.push_back(p[0]);
    y.push_back(p[1]);
    z.push_back(p[2]);
  }
  medium_->extinction({x.data(), y.data(), z.data(), out.size()}, out.data());
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_EQ(out[i], look_up({x[i], y[i], z[i]}));
}

TEST_P(MediaTest, ExtremaBoundEveryPoint) {
  for (int i = 0; i < 3000; ++i) {
    const Box b = box();
    const Extrema e = medium_->extrema(b);
    ASSERT_LE(0, e.minimum[0]);
    ASSERT_LE(e.minimum[0], e.average[0]);
    ASSERT_LE(e.average[0], e.maximum[0]);
    for (int k = 0; k < 40; ++k) {
      Vec3 p = point(b);
      // Corners and faces too; where mu jumps, a face that lies in the jump's plane belongs to the next cell.
      if (k < 8 && !GetParam().jumps)
        for (int axis = 0; axis < 3; ++axis) p[axis] = (k >> axis & 1 ? b.hi : b.lo)[axis];
      const Real value = look_up(p);
      ASSERT_TRUE(e.minimum[0] <= value && value <= e.maximum[0])
          << value << " outside [" << e.minimum[0] << ", " << e.maximum[0] << "] at " << p.transpose() << " in box "
          << b.lo.transpose() << " .. " << b.hi.transpose();
    }
  }
}

// Dense sampling comes near both bounds where they are exact; smaller boxes have closer bounds wherever mu is continuous.
TEST_P(MediaTest, ExtremaAreTight) {
  for (int i = 0; i < (GetParam().exact ? 40 : 0); ++i) {
    Box b = box();
    const Extrema e = medium_->extrema(b);
    if (!std::isfinite(e.maximum[0])) continue;
    Real low = kInfinity, high = 0;
    constexpr int kSteps = 24, kFine = 4000;
    const auto see = [&](const Vec3& p) {
      low = std::min(low, look_up(p));
      high = std::max(high, look_up(p));
    };
    const bool solid = GetParam().type == "checkerboard" || GetParam().type == "fractal_noise";
    for (int k = 0; k <= (solid ? 0 : kFine); ++k) see(b.lo + b.extent() * k / kFine);
    // Cells a box barely covers are easily missed.
    if (solid && (GetParam().jumps || e.maximum[0] == 0)) {
      if (e.minimum[0] == e.maximum[0]) continue;
      for (int k = 0; k < 100000 && low == high; ++k) see(point(b));
      if (low == high) continue;
    } else if (solid) {
      for (int x = 0; x <= kSteps; ++x)
        for (int y = 0; y <= kSteps; ++y)
          for (int z = 0; z <= kSteps; ++z) see(b.lo + b.extent().cwiseProduct(Vec3(x, y, z)) / kSteps);
    }
    const Real resolution = solid ? 0.05 : 1e-3;
    ASSERT_NEAR(e.minimum[0], low, resolution * (e.maximum[0] - e.minimum[0]) + 1e-13 * (1 + high));
    ASSERT_NEAR(e.maximum[0], high, resolution * (e.maximum[0] - e.minimum[0]) + 1e-13 * (1 + high));
  }
  if (GetParam().jumps) return;
  for (int i = 0; i < 200; ++i) {
    const Vec3 p = point({whole_.lo + 0.01 * whole_.extent(), whole_.hi - 0.01 * whole_.extent()});
    const Vec3 side = 1e-8 * whole_.extent();
    const Extrema e = medium_->extrema({p - side, p + side});
    ASSERT_LE(e.maximum[0] - e.minimum[0], 1e-4 * (1 + medium_->extrema({p, p}).maximum[0]));
  }
}

TEST_P(MediaTest, AverageIsTheMean) {
  for (int i = 0; i < 5; ++i) {
    Box b = i == 0 ? whole_ : box();
    const Extrema e = medium_->extrema(b);
    Real mean = 0;
    if (GetParam().average_error < 1e-6) {
      Ray diagonal;  // all these media vary along one axis
      diagonal.origin = b.lo;
      diagonal.direction = b.extent();
      diagonal.begin = 0;
      diagonal.end = 1;
      mean = oracle(diagonal);
      ASSERT_NEAR(e.average[0], mean, 1e-12 * mean + tolerance(diagonal, mean));
      continue;
    }
    constexpr int kPoints = 40000;
    for (int k = 0; k < kPoints; ++k) mean += look_up(point(b)) / kPoints;
    ASSERT_NEAR(e.average[0], mean, GetParam().average_error * std::max(mean, 0.5 * e.maximum[0]));
  }
}

TEST_P(MediaTest, BoxesOutsideAreVacuum) {
  const Vec3 far = whole_.hi + Vec3::Ones();
  const Extrema e = medium_->extrema({far, far + Vec3::Ones()});
  EXPECT_EQ(e.maximum[0], 0);
  const Extrema cut = medium_->extrema({whole_.lo - Vec3::Ones(), whole_.hi + Vec3::Ones()}), all = medium_->extrema(whole_);
  EXPECT_EQ(cut.minimum[0], all.minimum[0]);
  EXPECT_EQ(cut.maximum[0], all.maximum[0]);
}

TEST_P(MediaTest, OpticalDepthEqualsQuadrature) {
  for (int i = 0; i < 1000; ++i) {
    const Ray r = ray();
    const auto found = medium_->optical_depth(r);
    ASSERT_EQ(found.has_value(), GetParam().closed);
    if (!found) return;
    ASSERT_EQ(found->size(), 1);
    const Real expected = oracle(r);
    ASSERT_NEAR((*found)[0], expected, tolerance(r, expected))
        << "direction " << r.direction.transpose() << " from " << r.at(r.begin).transpose() << " length " << r.length();
    // The same stretch walked backwards, and uncut: both see the same vacuum outside.
    Ray back = {r.origin, -r.direction, -r.end, -r.begin};
    ASSERT_NEAR((*medium_->optical_depth(back))[0], (*found)[0], 2 * tolerance(r, expected));
    Ray beyond = clipped({r.origin, r.direction, -100, 100}, whole_), endless = {r.origin, r.direction, -100, 100};
    ASSERT_EQ((*medium_->optical_depth(beyond))[0], (*medium_->optical_depth(endless))[0]);
  }
}

TEST_P(MediaTest, EmptyIntervalsHaveNoDepth) {
  Ray r;
  r.origin = point(whole_);
  r.begin = r.end = 0;
  EXPECT_EQ(medium_->optical_depth(r).value_or(Spectrum::Zero(1))[0], 0);
  r.origin = whole_.hi + Vec3::Ones();
  r.end = kInfinity;
  EXPECT_EQ(medium_->optical_depth(r).value_or(Spectrum::Zero(1))[0], 0);
}

TEST_P(MediaTest, FifteenPointsResolveBetweenKnots) {
  for (int i = 0; i < 100; ++i) {
    const Ray r = ray();
    const Real coarse =
        integrate(r, [](const auto& f, Real a, Real b) { return boost::math::quadrature::gauss<Real, 15>::integrate(f, a, b); });
    const Real fine = integrate(r, [](const auto& f, Real a, Real b) {
      Real sum = 0;
      for (int k = 0; k < 4; ++k)
        sum += boost::math::quadrature::gauss<Real, 30>::integrate(f, a + (b - a) * k / 4, a + (b - a) * (k + 1) / 4);
      return sum;
    });
    ASSERT_NEAR(coarse, fine, 1e-11 * fine + tolerance(r, fine));
  }
}

TEST_P(MediaTest, PolynomialDegreeIntegratesExactly) {
  const auto degree = medium_->polynomial_degree();
  if (!degree) return;
  const int n = *degree / 2 + 1;
  std::vector<std::pair<Real, Real>> rule;
  for (const Real x : boost::math::legendre_p_zeros<Real>(n)) {
    const Real slope = boost::math::legendre_p_prime(n, x), weight = 2 / ((1 - x * x) * slope * slope);
    rule.emplace_back(x, weight);
    if (x != 0) rule.emplace_back(-x, weight);
  }
  for (int i = 0; i < 100; ++i) {
    const Ray r = ray();
    const Real found = integrate(r, [&](const auto& f, Real a, Real b) {
      Real sum = 0;
      for (const auto& [x, weight] : rule) sum += weight * f((a + b) / 2 + x * (b - a) / 2);
      return sum * (b - a) / 2;
    });
    const Real expected = oracle(r);
    ASSERT_NEAR(found, expected, 1e-13 * expected + tolerance(r, expected));
  }
}

INSTANTIATE_TEST_SUITE_P(All, MediaTest, testing::ValuesIn(cases()), [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace nullmark
