#include "estimators/walk/rng.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

namespace nullmark {
namespace {

/// Reject at sup |F_n - F| > sqrt(ln(2/alpha) / 2n): exact at any n [Massart 1990], alpha = 1e-6.
void expect_uniform(std::vector<Real> u) {
  std::sort(u.begin(), u.end());
  const auto n = static_cast<Real>(u.size());
  Real gap = 0;
  for (std::size_t i = 0; i < u.size(); ++i)
    gap = std::max({gap, static_cast<Real>(i + 1) / n - u[i], u[i] - static_cast<Real>(i) / n});
  EXPECT_LT(gap, std::sqrt(std::log(2e6) / (2 * n)));
}

TEST(Rng, IsUniformWithinAStreamAndAcrossAddresses) {
  constexpr int kCount = 200'000;
  std::vector<Real> within, samples, rays, keys;
  Rng rng(SampleAddress{1, 1, 1});
  for (int i = 0; i < kCount; ++i) {
    const auto k = static_cast<std::uint64_t>(i);
    within.push_back(rng.uniform());
    samples.push_back(Rng(SampleAddress{1, 1, k}).uniform());
    rays.push_back(Rng(SampleAddress{1, static_cast<std::uint32_t>(i), 1}).uniform());
    keys.push_back(Rng(SampleAddress{k, 1, 1}).uniform());
  }
  for (const auto& values : {within, samples, rays, keys}) expect_uniform(values);
}

TEST(Rng, DifferentAddressesGiveDifferentStreams) {
  std::set<Real> first;
  for (std::uint64_t key : {1u, 2u})
    for (std::uint32_t ray : {0u, 1u, 2u})
      for (std::uint64_t sample : {0ull, 1ull, 1ull << 32}) first.insert(Rng(SampleAddress{key, ray, sample}).uniform());
  EXPECT_EQ(first.size(), 18u);
}

TEST(Rng, CountsItsDraws) {
  Rng rng(SampleAddress{1, 2, 3});
  rng.uniform();
  rng.exponential();
  EXPECT_EQ(rng.draws(), 2u);
}

TEST(Rng, ExponentialsHaveTheirLaw) {
  Rng rng(SampleAddress{3, 1, 4});
  std::vector<Real> u;
  for (int i = 0; i < 200'000; ++i) u.push_back(-std::expm1(-rng.exponential()));
  expect_uniform(u);
}

}  // namespace
}  // namespace nullmark
