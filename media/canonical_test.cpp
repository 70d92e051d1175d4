#include "media/canonical.h"

#include <gtest/gtest.h>

#include <boost/math/quadrature/gauss_kronrod.hpp>

#include "media/majorants/ray_maximum.h"

namespace nullmark {
namespace {

std::shared_ptr<const Medium> canonical(const std::string& profile, const std::string& ramp, Real from, Real to,
                                        Real length = 1) {
  CanonicalMediumSource source;
  source.profile = profile;
  source.ramp = ramp;
  source.from = from;
  source.to = to;
  source.length = length;
  return source.build();
}

Real at(const Medium& medium, const Vec3& p) {
  Real out = 0;
  medium.extinction({&p.x(), &p.y(), &p.z(), 1}, &out);
  return out;
}

const std::vector<std::string> kProfiles = {"constant", "linear",        "trapezoid",    "parabolic",
                                            "cosine",   "gaussian_bump", "gaussian_hole"};

TEST(Canonical, TransmittanceFallsLinearlyAcrossThePicture) {
  for (const std::string& profile : kProfiles) {
    const auto medium = canonical(profile, "transmittance", 0.99, 0.01, 2);
    for (const Real x : {0., 0.25, 0.7, 1.}) {
      const Ray ray{{x, 0.3, 0}, {0, 0, 1}, 0, 2};
      EXPECT_NEAR(std::exp(-(*medium->optical_depth(ray))[0]), 0.99 - 0.98 * x, 1e-13) << profile;
      const auto along = [&](Real z) { return at(*medium, {x, 0.3, z}); };
      Real depth = 0;
      for (int i = 0; i < 64; ++i)
        depth += boost::math::quadrature::gauss_kronrod<Real, 15>::integrate(along, 2 * i / 64., 2 * (i + 1) / 64., 0);
      EXPECT_NEAR(depth, (*medium->optical_depth(ray))[0], 1e-9 * depth) << profile;
    }
  }
}

TEST(Canonical, ExtinctionFallsGeometrically) {
  const auto medium = canonical("parabolic", "extinction", std::exp(-2.), 1, 2);
  for (const Real x : {0., 0.5, 1.}) EXPECT_NEAR(at(*medium, {x, 0.5, 1}), std::exp(-2 + 2 * x) / 4, 1e-14);
}

TEST(Canonical, BoundsHoldOnEveryBox) {
  for (const std::string& profile : kProfiles)
    for (const char* ramp : {"transmittance", "extinction"}) {
      const auto medium = canonical(profile, ramp, 0.99, 0.01);
      for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 8; ++k) {
          const Box box{{i / 4., 0, k / 8.}, {(i + 1) / 4., 1, (k + 1) / 8.}};
          const Extrema extrema = medium->extrema(box);
          for (int s = 0; s <= 6; ++s)
            for (int t = 0; t <= 6; ++t) {
              const Real mu = at(*medium, {box.lo.x() + s / 24., 0.5, box.lo.z() + t / 48.});
              EXPECT_LE(mu, extrema.maximum[0]) << profile;
              EXPECT_GE(mu, extrema.minimum[0] * (1 - 1e-12)) << profile;
            }
        }
    }
}

TEST(Canonical, ObliqueRaysHaveNoClosedForm) {
  const auto medium = canonical("cosine", "transmittance", 0.99, 0.01);
  EXPECT_FALSE(medium->optical_depth({{0.2, 0.5, 0}, Vec3(1, 0, 1).normalized(), 0, 1}));
}

TEST(Canonical, ATransmittanceAboveOneIsRefused) {
  EXPECT_THROW(canonical("cosine", "transmittance", 1.1, 0.01), ParameterError);
  EXPECT_THROW(canonical("cosine", "transmittance", 0.9, 2), ParameterError);
}

TEST(RayMaximum, IsTheRaysMaximumOverTheEfficiency) {
  const auto medium = canonical("linear", "extinction", 0.5, 2);
  RayMaximumSource source;
  source.from = 0.9;
  source.to = 0.1;
  const auto structure = source.build(medium);
  SegmentBuffer buffer;
  for (const Real x : {0., 0.5, 1.})
    for (const Real y : {0., 0.25, 1.}) {
      const Ray ray{{x, y, 0}, {0, 0, 1}, 0, 1};
      structure->segments(ray, ray, buffer);
      ASSERT_EQ(buffer.segments.size(), 1u);
      const Real maximum = 0.5 * std::pow(4, x);
      EXPECT_NEAR(buffer.segments[0].majorant, maximum / (0.9 - 0.8 * y), 1e-12);
      EXPECT_NEAR(buffer.segments[0].extinction.maximum[0], maximum, 1e-12);
      EXPECT_EQ(buffer.segments[0].begin, 0);
      EXPECT_EQ(buffer.segments[0].end, 1);
    }
}

}  // namespace
}  // namespace nullmark
