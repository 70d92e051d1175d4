#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "estimators/walk/rng.h"
#include "media/base/elementary.h"

namespace nullmark {
namespace {

TEST(Logarithm, AgreeWithLongDoubleToAFewUlp) {
  std::vector<Real> x{1, 1 - 0x1p-53, 0x1p-53, 0.5, 0.75, 1e-3};
  Rng rng(SampleAddress{1, 2, 3});
  while (x.size() < 16 * 4096) x.push_back(1 - rng.uniform());
  std::vector<Real> e(x.size());
  negative_logarithms(x.data(), x.size(), e.data());
  EXPECT_EQ(e[0], 0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto exact = static_cast<Real>(-std::log(static_cast<long double>(x[i])));
    ASSERT_NEAR(e[i], exact, 4 * std::numeric_limits<Real>::epsilon() * exact) << x[i];
    ASSERT_GE(e[i], 0);
  }
}

TEST(Logarithm, DoNotDependOnTheirPlaceOrNumber) {
  std::vector<Real> x(64), all(64), one(16), padded(16, 1);
  Rng rng(SampleAddress{4, 5, 6});
  for (Real& value : x) value = 1 - rng.uniform();
  negative_logarithms(x.data(), x.size(), all.data());
  for (std::size_t i = 0; i < x.size(); ++i) {
    padded[i % 16] = x[i];
    for (const std::size_t n : {i % 16 + 1, std::size_t{16}}) {
      negative_logarithms(padded.data(), n, one.data());
      EXPECT_EQ(one[i % 16], all[i]);
    }
  }
}

/// What is drawn ahead serves an exponential and leaves every other draw as it was.
TEST(DrawnAhead, AReadyExponentialIsForgottenWhenSomethingElseIsDrawnFirst) {
  const SampleAddress address{7, 8, 9};
  Rng plain(address), ahead(address);
  for (int i = 0; i < 100; ++i) {
    std::vector<Real> x(16, ahead.peek()), e(16);
    negative_logarithms(x.data(), 16, e.data());
    ahead.make_ready(e[0]);
    if (i % 3 == 0) {
      ASSERT_EQ(ahead.uniform(), plain.uniform());
    } else {
      ASSERT_NEAR(ahead.exponential(), plain.exponential(), 1e-14);
    }
    ASSERT_EQ(ahead.draws(), plain.draws());
    ASSERT_EQ(ahead.peek(), plain.peek());
  }
}

}  // namespace
}  // namespace nullmark
