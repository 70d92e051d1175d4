#include "media/base/channels.h"

#include <gtest/gtest.h>

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <random>

#include "harness/testing/built_media.h"
#include "media/cosine.h"
#include "media/exponential_cube.h"
#include "media/fractal_noise.h"
#include "media/homogeneous.h"
#include "media/linear.h"

namespace nullmark {
namespace {

template <class Field>
std::shared_ptr<const Medium> in_box(const Vec3& lo, const Vec3& hi, Field field = {}) {
  field.lo = lo;
  field.hi = hi;
  return built(std::move(field));
}

/// A homogeneous medium in another frame.
class Moved final : public Medium {
 public:
  Box bounds() const override { return {}; }
  Affine world_to_local() const override { return Affine(Eigen::Translation3d(1, 0, 0)); }
  void extinction(const Points& points, Real* out) const override { std::fill_n(out, points.size, 1); }
  Extrema extrema(const Box&) const override { return Extrema::grey(1, 1, 1); }
};

/// Complains about lookups outside its box, as a voxel grid would by reading foreign memory.
class Strict final : public Medium {
 public:
  Box bounds() const override { return {Vec3(0.5, 0, 0), Vec3(1, 2, 1)}; }
  void extinction(const Points& points, Real* out) const override {
    for (std::size_t i = 0; i < points.size; ++i) {
      EXPECT_TRUE((points[i].array() >= bounds().lo.array()).all() && (points[i].array() <= bounds().hi.array()).all());
      out[i] = 3;
    }
  }
  std::uint64_t content_hash() const override { return 77; }
  Extrema extrema(const Box& box) const override {
    EXPECT_TRUE((box.lo.array() >= bounds().lo.array()).all() && (box.hi.array() <= bounds().hi.array()).all());
    return Extrema::grey(3, 3, 3);
  }
};

std::shared_ptr<const Medium> three() {
  return std::make_shared<PerChannel>(std::vector<std::shared_ptr<const Medium>>{
      in_box<Linear>({0, 0, 0}, {1, 1, 1}), in_box<Cosine>({0.5, -1, 0.25}, {2, 0.5, 0.75}),
      in_box<Homogeneous>({-1, 0.25, 0}, {0.75, 1.5, 0.5})});
}

/// Channel c of `three`, told by hand.
Real expected(int c, const Vec3& p) {
  const auto inside = [&](const Vec3& lo, const Vec3& hi) {
    return (p.array() >= lo.array()).all() && (p.array() <= hi.array()).all();
  };
  if (c == 0) return inside({0, 0, 0}, {1, 1, 1}) ? p[0] : 0;
  if (c == 1) return inside({0.5, -1, 0.25}, {2, 0.5, 0.75}) ? 1 + std::cos(20 * (p[0] - 0.5) / 1.5 + 0.8) : 0;
  return inside({-1, 0.25, 0}, {0.75, 1.5, 0.5}) ? 1 : 0;
}

Vec3 point(std::mt19937& random, const Box& box) {
  std::uniform_real_distribution<Real> u(0, 1);
  return box.lo + Vec3(u(random), u(random), u(random)).cwiseProduct(box.extent());
}

void look_up(const Medium& medium, const std::vector<Vec3>& points, std::vector<Real>& out) {
  std::vector<Real> x, y, z;
  for (const Vec3& p : points) {
    x.push_back(p[0]);
    y.push_back(p[1]);
    z.push_back(p[2]);
  }
  out.assign(points.size() * static_cast<std::size_t>(medium.channels()), -1);
  medium.extinction({x.data(), y.data(), z.data(), points.size()}, out.data());
}

void expect_bounds(const Medium& medium, std::mt19937& random) {
  std::vector<Real> out;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 a = point(random, medium.bounds()), b = point(random, medium.bounds());
    const Real shrink = i % 2 == 0 ? 1 : 0.1;
    const Box box = {a.cwiseMin(b), a.cwiseMin(b) + shrink * (a - b).cwiseAbs()};
    const Extrema e = medium.extrema(box);
    std::vector<Vec3> points;
    for (int k = 0; k < 40; ++k) points.push_back(point(random, box));
    look_up(medium, points, out);
    for (std::size_t k = 0; k < out.size(); ++k) {
      const auto c = static_cast<Eigen::Index>(k % static_cast<std::size_t>(medium.channels()));
      ASSERT_TRUE(e.minimum[c] <= out[k] && out[k] <= e.maximum[c]) << "channel " << c;
      ASSERT_TRUE(e.minimum[c] <= e.average[c] && e.average[c] <= e.maximum[c]) << "channel " << c;
    }
  }
}

void expect_depths(const Medium& medium, std::mt19937& random) {
  std::normal_distribution<Real> normal;
  for (int i = 0; i < 300; ++i) {
    Ray ray;
    ray.origin = point(random, medium.bounds());
    ray.direction = Vec3(normal(random), normal(random), i % 5 == 0 ? -0. : normal(random)).normalized();
    if (i % 7 == 0) ray.direction = Vec3(1e-9, -0., 1).normalized();
    ray.begin = -10;
    ray.end = 10;
    ray = clipped(ray, medium.bounds());
    std::vector<Real> t = {ray.begin, ray.end};
    medium.knots(ray, t);
    std::sort(t.begin(), t.end());
    ASSERT_TRUE(t.front() == ray.begin && t.back() == ray.end);
    const auto found = medium.optical_depth(ray);
    ASSERT_TRUE(found.has_value());
    ASSERT_EQ(found->size(), medium.channels());
    for (int c = 0; c < medium.channels(); ++c) {
      Real sum = 0;
      std::vector<Real> out;
      for (std::size_t k = 1; k < t.size(); ++k)
        if (t[k] > t[k - 1])
          sum += boost::math::quadrature::gauss_kronrod<Real, 15>::integrate(
              [&](Real at) {
                look_up(medium, {ray.at(at)}, out);
                return out[static_cast<std::size_t>(c)];
              },
              t[k - 1], t[k], 4, 1e-12);
      ASSERT_NEAR((*found)[c], sum, 1e-13 * (1 + sum)) << "channel " << c;
    }
  }
}

TEST(Spectral, ScalesTheGreyMedium) {
  std::mt19937 random(1);
  const auto base = built(Cosine{});
  const std::vector<Real> spectrum = {1, 0, 100, 0.25};
  const Spectral medium(base, spectrum);
  ASSERT_EQ(medium.channels(), 4);
  std::vector<Vec3> points;
  for (int i = 0; i < 200; ++i) points.push_back(point(random, medium.bounds()));
  std::vector<Real> one, all;
  look_up(*base, points, one);
  look_up(medium, points, all);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t c = 0; c < 4; ++c) ASSERT_EQ(all[4 * i + c], one[i] * spectrum[c]);
  expect_bounds(medium, random);
  expect_depths(medium, random);
  EXPECT_FALSE(medium.polynomial_degree());
  EXPECT_EQ(Spectral(built(Linear{}), {1, 2}).polynomial_degree(), 1);
  EXPECT_FALSE(Spectral(built(FractalNoise{}), {1, 2}).optical_depth({{0, 0.5, 0.5}, {1, 0, 0}, 0, 1}));
}

TEST(Spectral, UnboundedTimesZeroIsZero) {
  const Spectral medium(built(ExponentialCube{}), {0, 2});
  const Extrema e = medium.extrema(medium.bounds());
  EXPECT_EQ(e.maximum[0], 0);
  EXPECT_EQ(e.maximum[1], kInfinity);
}

TEST(Spectral, RefusesWhatIsNoSpectrum) {
  const auto base = built(Linear{});
  EXPECT_THROW(Spectral(base, {}), ParameterError);
  EXPECT_THROW(Spectral(base, std::vector<Real>(17, 1)), ParameterError);
  EXPECT_NO_THROW(Spectral(base, std::vector<Real>(16, 1)));
  EXPECT_THROW(Spectral(base, {1, -1}), ParameterError);
  EXPECT_THROW(Spectral(base, {1, kInfinity}), ParameterError);
  EXPECT_THROW(Spectral(std::make_shared<Spectral>(base, std::vector<Real>{1, 2}), {1}), ParameterError);
}

TEST(PerChannel, IsZeroOutsideEachBox) {
  std::mt19937 random(2);
  const auto medium = three();
  ASSERT_EQ(medium->channels(), 3);
  EXPECT_EQ(medium->bounds().lo, Vec3(-1, -1, 0));
  EXPECT_EQ(medium->bounds().hi, Vec3(2, 1.5, 1));
  std::vector<Vec3> points;
  for (int i = 0; i < 2000; ++i) points.push_back(point(random, medium->bounds()));
  std::vector<Real> out;
  look_up(*medium, points, out);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(out[3 * i + static_cast<std::size_t>(c)], expected(c, points[i]), 1e-14);
}

TEST(PerChannel, PointsJustOutsideTheUnionBelongToItsFace) {
  std::vector<Real> out;
  look_up(*three(), {{2 + 1e-15, -0.5, 0.5}, {-1 - 1e-15, 1, 0.25}}, out);
  EXPECT_GT(out[1], 0);
  EXPECT_EQ(out[5], 1);
}

TEST(PerChannel, BoundsAndDepthsHold) {
  std::mt19937 random(3);
  const auto medium = three();
  expect_bounds(*medium, random);
  expect_depths(*medium, random);
  EXPECT_FALSE(medium->polynomial_degree());
  EXPECT_EQ(PerChannel({built(Linear{}), built(Homogeneous{})}).polynomial_degree(), 1);
}

TEST(PerChannel, PartlyCoveredBoxesReachZero) {
  const auto medium = three();
  const Extrema e = medium->extrema({{0.5, 0.25, 0.25}, {1, 0.75, 0.5}});
  EXPECT_EQ(e.minimum[0], 0.5);  // inside
  EXPECT_EQ(e.maximum[0], 1);
  EXPECT_EQ(e.minimum[1], 0);  // half of it, in y
  EXPECT_EQ(e.minimum[2], 0);  // half of it, in x
  EXPECT_EQ(e.average[2], 0.5);
  EXPECT_EQ(e.maximum[2], 1);
  // A neighbour in an aligned grid shares no more than a face.
  EXPECT_EQ(medium->extrema({{1, 0, 0}, {2, 1, 1}}).maximum[0], 0);
  EXPECT_EQ(medium->extrema({{1, 0.5, 0}, {1, 0.5, 0}}).maximum[0], 1);
}

TEST(PerChannel, NeverLooksUpOutsideAComponent) {
  std::mt19937 random(4);
  const PerChannel medium({built(Homogeneous{}), std::make_shared<Strict>()});
  std::vector<Vec3> points;
  for (int i = 0; i < 1000; ++i) points.push_back(point(random, medium.bounds()));
  std::vector<Real> out;
  look_up(medium, points, out);
  expect_bounds(medium, random);
}

TEST(Channels, ContentHashesPassThrough) {
  const auto plain = built(Homogeneous{});
  const std::shared_ptr<const Medium> file = std::make_shared<Strict>();
  EXPECT_EQ(PerChannel({plain, plain}).content_hash(), 0u);
  EXPECT_NE(PerChannel({plain, file}).content_hash(), 0u);
  EXPECT_NE(PerChannel({plain, file}).content_hash(), PerChannel({file, plain}).content_hash());
  EXPECT_EQ(Spectral(file, {1, 2}).content_hash(), 77u);
}

TEST(PerChannel, KnotsHoldEntriesAndExits) {
  std::vector<Real> t;
  const Ray ray = {{-1, 0.375, 0.375}, {1, 0, 0}, 0, 3};
  three()->knots(ray, t);
  for (const Real at : {1., 2., 1.5, 1.75})
    EXPECT_TRUE(std::any_of(t.begin(), t.end(), [&](Real k) { return std::abs(k - at) < 1e-15; })) << at;
}

TEST(PerChannel, RefusesWhatDoesNotFit) {
  const auto one = built(Homogeneous{});
  EXPECT_THROW(PerChannel({}), ParameterError);
  EXPECT_THROW(PerChannel(std::vector<std::shared_ptr<const Medium>>(17, one)), ParameterError);
  EXPECT_THROW(PerChannel({one, std::make_shared<Moved>()}), ParameterError);
  EXPECT_THROW(PerChannel({one, std::make_shared<Spectral>(one, std::vector<Real>{1, 2})}), ParameterError);
}

}  // namespace
}  // namespace nullmark
