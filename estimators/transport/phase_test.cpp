#include "estimators/transport/phase.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <vector>

#include "estimators/walk/rng.h"

namespace nullmark {
namespace {

constexpr Real kPi = std::numbers::pi;
const std::vector<Real> kCosines = {-0.999, -0.6, -0.1, -1e-3, -1e-9, 0, 1e-9, 1e-3, 0.1, 0.5, 0.8, 0.99, 0.99999};

Vec3 at_cosine(const Vec3& in, Real cosine) {
  return cosine * in + std::sqrt(std::max<Real>(0, 1 - cosine * cosine)) * Frame(in).first;
}

/// 2 pi int f(cos) d cos, the sphere's integral of what depends on the angle to `in` alone; log-spaced panels where the lobe is.
template <class Function>
Real sphere_integral(Real g, const Function& f) {
  const Real side = g < 0 ? -1 : 1;
  Real sum = 0, inner = 0;
  const auto panel = [&](Real a, Real b) {
    sum += boost::math::quadrature::gauss_kronrod<Real, 61>::integrate([&](Real x) { return f(side * (1 - x)); }, a, b, 5, 1e-13);
  };
  for (Real outer = 1e-14; outer < 2; outer *= 4) {
    panel(inner, outer);
    inner = outer;
  }
  panel(inner, 2);
  return 2 * kPi * sum;
}

TEST(Phase, FrameIsRightHandedAndOrthonormalInEveryDirection) {
  Rng rng(SampleAddress{1, 0, 0});
  std::vector<Vec3> directions = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ(), -Vec3::UnitX(), -Vec3::UnitY(), -Vec3::UnitZ()};
  for (int i = 0; i < 1000; ++i) directions.push_back(Isotropic{}.sample(Vec3::UnitZ(), rng));
  for (const Vec3& n : directions) {
    const Frame frame(n);
    EXPECT_NEAR(frame.first.norm(), 1, 1e-15);
    EXPECT_LT((frame.first.cross(frame.second) - n).norm(), 2e-15);
  }
}

TEST(Phase, IntegratesToOneWithItsMeanCosine) {
  const Vec3 in = Vec3(1, -2, 0.5).normalized();
  for (const Real g : {-0.99, -0.6, -0.1, 0., 1e-9, 0.1, 0.5, 0.8, 0.99}) {
    const HenyeyGreenstein phase(g);
    const auto p = [&](Real cosine) { return phase.value(in, at_cosine(in, cosine)); };
    EXPECT_NEAR(sphere_integral(g, p), 1, 1e-9) << g;
    EXPECT_NEAR(sphere_integral(g, [&](Real cosine) { return cosine * p(cosine); }), g, 1e-9) << g;
  }
  EXPECT_NEAR(sphere_integral(0, [&](Real cosine) { return Isotropic{}.value(in, at_cosine(in, cosine)); }), 1, 1e-12);
  EXPECT_DOUBLE_EQ(HenyeyGreenstein(0).value(in, -in), Isotropic{}.value(in, in));
}

TEST(Phase, IsSymmetricUnderReversalOfThePath) {
  const Vec3 in = Vec3(1, -2, 0.5).normalized(), out = Vec3(0.2, 1, 3).normalized();
  for (const Real g : kCosines) EXPECT_DOUBLE_EQ(HenyeyGreenstein(g).value(in, out), HenyeyGreenstein(g).value(-out, -in)) << g;
}

TEST(Phase, InverseAgreesWithFiftyDigits) {
  using Exact = boost::multiprecision::cpp_bin_float_50;
  for (const Real g : kCosines) {
    for (const Real u : {0., 0x1p-53, 1e-12, 0.001, 0.3, 0.5, 0.9, 0.999, 1 - 0x1p-53}) {
      const Exact h = g, s = 1 - 2 * Exact(u), q = (1 - h * h) / (1 + h * s);
      const Exact cosine = g == 0 ? s : Exact((1 + h * h - q * q) / (2 * h));
      const Exact difference = 1 - cosine, sine = sqrt(Exact(1 - cosine * cosine > 0 ? 1 - cosine * cosine : Exact(0)));
      const HenyeyGreenstein::Deflection by = HenyeyGreenstein(g).deflection(u);
      EXPECT_NEAR(by.one_minus_cosine, static_cast<Real>(difference), 1e-14 * static_cast<Real>(difference)) << g << ' ' << u;
      EXPECT_NEAR(by.sine, static_cast<Real>(sine), 1e-14 * static_cast<Real>(sine)) << g << ' ' << u;
    }
  }
}

/// Chi-square over 64 bins that the closed distribution function makes equally probable, and the mean cosine within 5.5 standard
/// errors: false alarms below 1e-6 a test and 4e-8 a mean.
template <class Phase>
void expect_law(const Phase& phase, Real g, std::uint64_t key) {
  constexpr int kBins = 64, kSamples = 400000;
  const Vec3 in = Vec3(1, -2, 0.5).normalized();
  const auto distribution = [&](Real cosine) {
    if (g == 0) return (1 + cosine) / 2;
    return (1 - g * g) / (2 * g) * (1 / std::sqrt(1 + g * g - 2 * g * cosine) - 1 / (1 + g));
  };
  std::vector<int> cosines(kBins), azimuths(kBins);
  Real sum = 0, squares = 0;
  for (std::uint64_t i = 0; i < kSamples; ++i) {
    Rng rng(SampleAddress{key, 0, i});
    const Vec3 out = phase.sample(in, rng);
    ASSERT_EQ(rng.draws(), 2u);
    ASSERT_NEAR(out.norm(), 1, 1e-14);
    const Real cosine = in.dot(out);
    sum += cosine;
    squares += cosine * cosine;
    const Frame frame(in);
    const Real turn = std::atan2(out.dot(frame.second), out.dot(frame.first)) / (2 * kPi);
    const auto bin = [&](Real u) { return static_cast<std::size_t>(std::clamp<int>(static_cast<int>(u * kBins), 0, kBins - 1)); };
    ++cosines[bin(distribution(cosine))];
    ++azimuths[bin(turn < 0 ? turn + 1 : turn)];
  }
  for (const std::vector<int>* counts : {&cosines, &azimuths}) {
    Real chi = 0;
    for (const int n : *counts) chi += (n - Real{kSamples} / kBins) * (n - Real{kSamples} / kBins) / (Real{kSamples} / kBins);
    EXPECT_GT(boost::math::cdf(complement(boost::math::chi_squared(kBins - 1), chi)), 1e-6) << g;
  }
  const Real mean = sum / kSamples, error = std::sqrt((squares / kSamples - mean * mean) / kSamples);
  EXPECT_LT(std::abs(mean - g), 5.5 * error) << g;
}

TEST(Phase, SamplesFollowTheValue) {
  expect_law(Isotropic{}, 0, 7);
  for (const Real g : {-0.9, -0.3, 0., 1e-7, 0.3, 0.8, 0.98}) expect_law(HenyeyGreenstein(g), g, 8);
}

TEST(Phase, MeanCosinesOutsideTheirRangeAreRefused) {
  for (const Real g : {-1., 1., 1.5, std::nan("")}) EXPECT_THROW(HenyeyGreenstein{g}, ParameterError);
}

}  // namespace
}  // namespace nullmark
