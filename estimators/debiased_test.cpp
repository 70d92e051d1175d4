// Estimators that put right what a march is off: theory against brute force, published values, zero variance where promised, the
// laws of their random orders, and media at the ends of the number range.

#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>
#include <random>

#include "estimators/jackknife.h"
#include "estimators/telescoping.h"
#include "estimators/theory/debiased_theory.h"
#include "estimators/unbiased_ray_marching.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "media/exponential.h"
#include "media/layers.h"

namespace nullmark {
namespace {

/// Level of chi-square tests, on fixed streams.
constexpr Real kLevel = 1e-7;

const Real kTenth = std::log(10.);

/// 3 e^{-3x}.
std::shared_ptr<const Medium> falling() {
  Exponential field;
  field.profile = {3, -3};
  return built(field);
}

/// Observed counts against expected ones, the last of which takes all that is left.
Real chi_square_tail(const std::vector<Real>& seen, const std::vector<Real>& expected) {
  Real sum = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) sum += (seen[i] - expected[i]) * (seen[i] - expected[i]) / expected[i];
  return boost::math::cdf(complement(boost::math::chi_squared(static_cast<Real>(seen.size() - 1)), sum));
}

UnbiasedRayMarching<Real> combs(bool endpoint_matching = false, const char* control = "majorant") {
  UnbiasedRayMarching<Real> tracker;
  tracker.endpoint_matching = endpoint_matching;
  tracker.control = control;
  return tracker;
}

Jackknife<Real> marches(int m, int steps, const char* jitter = "stratified", const char* mean = "jackknife") {
  Jackknife<Real> tracker;
  tracker.m = m;
  tracker.steps = steps;
  tracker.jitter = jitter;
  tracker.mean = mean;
  return tracker;
}

TEST(UnbiasedRayMarching, LookupsAndVariancesArePublishedOnes) {
  // Kettunen et al. 2021: M (1 + E n) by control optical thickness.
  for (const auto& [thickness, lookups] :
       {std::pair{kLog2, 3.958}, {2 * kLog2, 6.597}, {4 * kLog2, 9.236}, {5., 13.19}, {10., 19.79}, {20., 32.99}})
    EXPECT_NEAR(*HandWalked<UnbiasedRayMarching>(combs(), constant(thickness), 1).theory().lookups, lookups, 6e-3);
  EXPECT_NEAR(*HandWalked<UnbiasedRayMarching>(combs(true), constant(5), 1).theory().lookups, 15.19, 6e-3);
  EXPECT_NEAR(*HandWalked<UnbiasedRayMarching>(combs(), linear(0, 1, kLog2), 1).theory().variance, 1.52e-3, 3e-5);
  EXPECT_NEAR(*HandWalked<UnbiasedRayMarching>(combs(), linear(0, 1, kLog2), 1, 2).theory().variance, 7.66e-4, 1.6e-5);
  EXPECT_NEAR(*HandWalked<UnbiasedRayMarching>(combs(), linear(0, 1, kTenth), 1).theory().variance, 2.20e-4, 5e-6);
}

TEST(UnbiasedRayMarching, LocalBoundsAndMinorantsShortenTheComb) {
  const auto lookups = [](const char* control, int pieces) {
    return *HandWalked<UnbiasedRayMarching>(combs(false, control), linear(1, 21), 1, 1, pieces).theory().lookups;
  };
  EXPECT_NEAR(lookups("majorant", 1), 26 * 1.3194528, 1e-5);           // t_c = 21
  EXPECT_NEAR(lookups("majorant", 10), 17 * 1.3194528, 1e-5);          // 12
  EXPECT_NEAR(lookups("majorant_minorant", 1), 25 * 1.3194528, 1e-5);  // 20
  EXPECT_NEAR(lookups("majorant_minorant", 10), 5 * 1.3194528, 1e-5);  // 2
}

/// By another program: long double, a generator of its own, elementary symmetric polynomials as coefficients of prod (1 + t y),
/// roulette by one number as in the paper's listing.
TEST(UnbiasedRayMarching, MeanAndVarianceAgreeWithAnIndependentProgram) {
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<long double> uniform;
  const auto mu = [](long double x) { return 3 * std::exp(-3 * x); };
  constexpr int kSteps = 3;  // t_c = .6: N = 4
  Estimate values, squares;
  const HandWalked<UnbiasedRayMarching> walked(combs(), falling(), 1, 0.2);
  ASSERT_EQ(walked.ray.steps, kSteps);
  const Real truth = std::exp(-(1 - std::exp(-3.)));
  for (int sample = 0; sample < 1000000; ++sample) {
    std::vector<long double> p{1};
    const long double u = uniform(generator);
    if (u < .1L) {
      p.insert(p.end(), {.1L, .1L});
      for (int k = 3; u < p.back() * 2 / k; ++k) p.push_back(p.back() * 2 / k);
    }
    const std::size_t n = p.size() - 1;
    std::vector<long double> x;
    for (std::size_t i = 0; i <= n; ++i) {
      const long double o = uniform(generator);
      long double sum = 0;
      for (int j = 0; j < kSteps; ++j) sum -= mu((static_cast<long double>(j) + o) / kSteps) / kSteps;
      x.push_back(sum);
    }
    long double result = 0;
    for (std::size_t j = 0; j <= n; ++j) {
      std::vector<long double> e{1};
      for (std::size_t i = 0; i <= n; ++i) {
        if (i == j) continue;
        e.push_back(0);
        for (std::size_t k = e.size() - 1; k > 0; --k) e[k] += e[k - 1] * (x[i] - x[j]);
      }
      long double choose = 1, factorial = 1, series = 1;
      for (std::size_t k = 1; k <= n; ++k) {
        choose = choose * static_cast<long double>(n - k + 1) / static_cast<long double>(k);
        factorial *= static_cast<long double>(k);
        series += e[k] / choose / (factorial * p[k]);
      }
      result += std::exp(x[j]) * series / static_cast<long double>(n + 1);
    }
    const Real error = static_cast<Real>(result) - truth;
    values.add(error);
    squares.add(error * error);
  }
  EXPECT_NEAR(values.mean(), 0, kSigmas * values.error());
  EXPECT_NEAR(squares.mean(), *walked.theory().variance, kSigmas * squares.error());
  // And the tracker itself by the same yardstick.
  Estimate own, own_squares;
  for (std::uint64_t sample = 0; sample < 1000000; ++sample) {
    const Real error = walked.walk(sample).result - truth;
    own.add(error);
    own_squares.add(error * error);
  }
  EXPECT_NEAR(own.mean(), 0, kSigmas * own.error());
  EXPECT_NEAR(own_squares.mean(), *walked.theory().variance, kSigmas * own_squares.error());
}

TEST(UnbiasedRayMarching, OrdersFollowTheRoulette) {
  const HandWalked<UnbiasedRayMarching> walked(combs(), linear(0, 1, kLog2), 1);
  constexpr std::uint64_t kSamples = 400000;
  std::vector<Real> seen(7), at_least{1, .1, .1};  // n = 0, 2, ..., 6, 7 and more
  for (int k = 3; k < 8; ++k) at_least.push_back(at_least.back() * 2 / k);
  for (std::uint64_t sample = 0; sample < kSamples; ++sample) {
    const auto order = static_cast<std::size_t>(walked.walk(sample).lookups / walked.ray.steps) - 1;
    ASSERT_NE(order, 1u);
    ++seen[order == 0 ? 0 : std::min<std::size_t>(order, 7) - 1];
  }
  std::vector<Real> expected{kSamples * .9};
  for (std::size_t n = 2; n < 7; ++n) expected.push_back(kSamples * (at_least[n] - at_least[n + 1]));
  expected.push_back(kSamples * at_least[7]);
  EXPECT_GT(chi_square_tail(seen, expected), kLevel);
}

TEST(UnbiasedRayMarching, NoVarianceOnConstantAndWithEndsOnAffineExtinction) {
  for (const Real looseness : {0.1, 1., 2., 30.})
    for (const bool ends : {false, true}) {
      const HandWalked<UnbiasedRayMarching> flat(combs(ends), constant(kLog2), 1, looseness);
      const HandWalked<UnbiasedRayMarching> affine(combs(ends), linear(3, 0.5), 1, looseness);
      EXPECT_EQ(*flat.theory().variance, 0);
      EXPECT_EQ(*affine.theory().variance == 0, ends);
      bool varies = false;
      for (std::uint64_t sample = 0; sample < 3000; ++sample) {
        EXPECT_NEAR(flat.walk(sample).result, 0.5, 1e-14);
        const Real error = affine.walk(sample).result / std::exp(-1.75) - 1;
        if (ends) {
          EXPECT_NEAR(error, 0, 1e-12);
        }
        varies = varies || std::abs(error) > 1e-3;
      }
      EXPECT_EQ(varies, !ends);
    }
}

TEST(UnbiasedRayMarching, NothingToLookUpWithoutABound) {
  const HandWalked<UnbiasedRayMarching> vacuum(combs(true), constant(0), 1);
  EXPECT_EQ(vacuum.walk(0).lookups, 0);
  EXPECT_EQ(vacuum.walk(0).result, 1);
  EXPECT_EQ(*vacuum.theory().variance, 0);
  // A control without thickness is still one lookup a march.
  const HandWalked<UnbiasedRayMarching> constant_control(combs(false, "majorant_minorant"), constant(kLog2), 1);
  EXPECT_EQ(constant_control.ray.steps, 1);
  EXPECT_NEAR(constant_control.walk(0).result, 0.5, 1e-15);
}

/// As far as doubles go: 0 is right where T underflows, NaN never.
TEST(Debiased, ExtremeDepthsStayFinite) {
  Layers steps;
  steps.profile.values = {0, 2e6, 0, 1e-310};
  for (const auto& medium : {constant(1e6), linear(0, 2e6), linear(2e6, 0), constant(5e-324), linear(0, 1e-310), built(steps)}) {
    for (const bool ends : {false, true})
      for (const Real looseness : {1e-6, 1e-4}) {
        const HandWalked<UnbiasedRayMarching> walked(combs(ends), medium, 1, looseness);
        for (std::uint64_t sample = 0; sample < 300; ++sample) ASSERT_TRUE(std::isfinite(walked.walk(sample).result));
      }
    const HandWalked<Telescoping> telescoping({}, medium, 1);
    for (std::uint64_t sample = 0; sample < 300; ++sample) ASSERT_TRUE(std::isfinite(telescoping.walk(sample).result));
    for (const int m : {2, 3, 4}) {
      const HandWalked<Jackknife> walked(marches(m, 3), medium, 1);
      for (std::uint64_t sample = 0; sample < 300; ++sample) ASSERT_TRUE(std::isfinite(walked.walk(sample).result));
    }
  }
  const HandWalked<UnbiasedRayMarching> deep(combs(), constant(1e6), 1, 1e-3);
  EXPECT_EQ(deep.walk(0).result, 0);
}

/// sum_n p(n) E_o[(base + D/p - T)^2] by adaptive quadrature in long double, differences as they are defined.
TEST(Telescoping, VarianceAgreesWithAdaptiveQuadrature) {
  using Rule = boost::math::quadrature::gauss_kronrod<long double, 31>;
  const auto oracle = [](const auto& mu, long double truth) {
    long double variance = 0;
    for (int n = 0; n < 14; ++n) {
      const long double p = .65L * std::pow(.35L, static_cast<long double>(n));
      const int count = 2 << n;
      variance += p * Rule::integrate(
                          [&](long double o) {
                            long double base = 0, even = 0, odd = 0;
                            for (int i = 0; i < count; ++i) {
                              const long double v = mu((static_cast<long double>(i) + o) / count);
                              base += std::exp(-v) / count;
                              (i % 2 ? odd : even) += v * 2 / count;
                            }
                            const long double d = std::exp(-(even + odd) / 2) - (std::exp(-even) + std::exp(-odd)) / 2;
                            return (base + d / p - truth) * (base + d / p - truth);
                          },
                          0.L, 1.L, 6, 1e-9L);
    }
    return static_cast<Real>(variance);
  };
  const Real half = *HandWalked<Telescoping>({}, linear(0, 1, kLog2), 1).theory().variance;
  EXPECT_NEAR(half, 7.026e-3, 5e-7);
  EXPECT_NEAR(oracle([](long double x) { return 2 * std::log(2.L) * x; }, .5L) / half, 1, 1e-4);
  EXPECT_NEAR(oracle([](long double x) { return 3 * std::exp(-3 * x); }, std::exp(std::expm1(-3.L))) /
                  *HandWalked<Telescoping>({}, falling(), 1).theory().variance,
              1, 1e-4);
}

TEST(Telescoping, NoVarianceOnConstantExtinctionAndNeverAboveOne) {
  const HandWalked<Telescoping> flat({}, constant(kLog2), 1), rising({}, linear(0, 9), 1);
  EXPECT_EQ(*flat.theory().variance, 0);
  Real most = -kInfinity, least = kInfinity;
  for (std::uint64_t sample = 0; sample < 100000; ++sample) {
    if (sample < 3000) {
      ASSERT_NEAR(flat.walk(sample).result, 0.5, 1e-13);
    }
    const Real x = rising.walk(sample).result;
    most = std::max(most, x);
    least = std::min(least, x);
  }
  EXPECT_LE(most, 1);
  EXPECT_LT(least, 0);
}

/// Lookups have no variance to test their mean by; the law of n is tested itself: 2^{n+1} lookups with chance r (1 - r)^n.
TEST(Telescoping, LevelsAreGeometric) {
  for (const Real r : {0.65, 0.9}) {
    Telescoping<Real> tracker;
    tracker.r = r;
    const HandWalked<Telescoping> walked(tracker, linear(0, 1, kLog2), 1);
    constexpr std::uint64_t kSamples = 200000;
    const std::size_t bins = r < 0.8 ? 8 : 4;
    std::vector<Real> seen(bins), expected;
    for (std::uint64_t sample = 0; sample < kSamples; ++sample) {
      const Real level = std::log2(walked.walk(sample).lookups) - 1;
      ASSERT_EQ(level, std::floor(level));
      ++seen[std::min(static_cast<std::size_t>(level), bins - 1)];
    }
    for (std::size_t n = 0; n < bins; ++n)
      expected.push_back(kSamples * std::pow(1 - r, static_cast<Real>(n)) * (n + 1 < bins ? r : 1));
    EXPECT_GT(chi_square_tail(seen, expected), kLevel);
    const Theory theory = walked.theory();
    EXPECT_NEAR(*theory.lookups, 2 * r / (2 * r - 1), 1e-12);
    EXPECT_EQ(std::isinf(*theory.lookups_variance), r < 0.75);
  }
}

TEST(Jackknife, BiasAndVarianceArePublishedOnes) {
  const Theory two = HandWalked<Jackknife>(marches(2, 10), linear(0, 1, kLog2), 1).theory();
  EXPECT_NEAR(*two.mean - 0.5, 3.2e-11, 1e-12);
  EXPECT_NEAR(*two.variance, 2.0020e-5, 1e-9);
  const Real truth = std::exp(std::expm1(-3.));
  const auto bias = [&](const char* jitter, const char* mean) {
    return std::abs(*HandWalked<Jackknife>(marches(2, 4, jitter, mean), falling(), 1).theory().mean - truth);
  };
  EXPECT_NEAR(bias("stratified", "jackknife"), 1.5e-5, 5e-7);
  EXPECT_NEAR(bias("uniform", "jackknife"), 8.7e-5, 1e-6);
  EXPECT_NEAR(bias("stratified", "naive"), 1.6e-3, 5e-5);
}

/// Every lookup integrated over its own offset: one step a march, so m dimensions.
TEST(Jackknife, TheoryAgreesWithTensorQuadrature) {
  using Rule = boost::math::quadrature::gauss<Real, 15>;
  std::vector<Real> x, w;
  for (std::size_t i = 0; i < Rule::abscissa().size(); ++i)
    for (const int side : {-1, 1}) {
      if (i == 0 && side > 0) continue;
      x.push_back((1 + side * Rule::abscissa()[i]) / 2);
      w.push_back(Rule::weights()[i] / 2);
    }
  for (const int m : {2, 3, 4})
    for (const char* mean : {"jackknife", "naive"}) {
      Real first = 0, second = 0;
      std::vector<std::size_t> at(static_cast<std::size_t>(m), 0);
      for (;;) {
        Real weight = 1, sum = 0, squares = 0;
        for (const std::size_t i : at) {
          const Real depth = 3 * std::exp(-3 * x[i]);
          weight *= w[i];
          sum += depth / m;
          squares += depth * depth / m;
        }
        const Real s = std::sqrt(std::max<Real>(0, squares - sum * sum)), order = (m - 3) / 2.;
        // The general form; of order -1/2 Bessel's function is no std:: one.
        Real factor = 1;
        if (std::string_view(mean) == "jackknife" && s > 1e-8)
          factor = m == 2 ? std::cos(s) : std::tgamma(order + 1) * std::pow(2 / s, order) * std::cyl_bessel_j(order, s);
        first += weight * factor * std::exp(-sum);
        second += weight * factor * factor * std::exp(-2 * sum);
        std::size_t digit = 0;
        while (digit < at.size() && ++at[digit] == x.size()) at[digit++] = 0;
        if (digit == at.size()) break;
      }
      for (const char* jitter : {"stratified", "uniform"}) {
        const Theory theory = HandWalked<Jackknife>(marches(m, 1, jitter, mean), falling(), 1).theory();
        EXPECT_NEAR(*theory.mean, first, 1e-9) << m << mean << jitter;
        EXPECT_NEAR(*theory.variance, second - first * first, 1e-9) << m << mean << jitter;
      }
    }
}

/// Orders of the bias from exact means, and the ordering of biases.
TEST(Jackknife, ExactBiasesFallAsStated) {
  const Real truth = std::exp(std::expm1(-3.));
  for (const int m : {2, 3, 4})
    for (const char* jitter : {"stratified", "uniform"})
      for (const char* mean : {"jackknife", "naive"}) {
        const Jackknife<Real> tracker = marches(m, 8, jitter, mean);
        const auto bias = [&](int steps) {
          return std::abs(*HandWalked<Jackknife>(marches(m, steps, jitter, mean), falling(), 1).theory().mean - truth);
        };
        EXPECT_NEAR(std::log2(bias(8) / bias(16)), tracker.order(Quantity::transmittance), 0.3) << m << jitter << mean;
        if (tracker.mean == "jackknife") {
          EXPECT_LT(bias(8),
                    std::abs(*HandWalked<Jackknife>(marches(m, 8, jitter, "naive"), falling(), 1).theory().mean - truth));
        }
      }
}

TEST(Jackknife, WalksMeetTheoryAndStayInTheirRange) {
  for (const int m : {2, 3, 4})
    for (const char* jitter : {"stratified", "uniform"})
      for (const char* mean : {"jackknife", "naive"}) {
        const HandWalked<Jackknife> walked(marches(m, 2, jitter, mean), falling(), 1);
        Estimate values, squares;
        Real least = 1;
        const Theory theory = walked.theory();
        for (std::uint64_t sample = 0; sample < 100000; ++sample) {
          const auto outcome = walked.walk(sample);
          ASSERT_EQ(outcome.lookups, 2 * m);
          ASSERT_LE(outcome.result, 1);
          least = std::min(least, outcome.result);
          const Real error = outcome.result - *theory.mean;
          values.add(error);
          squares.add(error * error);
        }
        EXPECT_NEAR(values.mean(), 0, kSigmas * values.error()) << m << jitter << mean;
        EXPECT_NEAR(squares.mean(), *theory.variance, kSigmas * squares.error()) << m << jitter << mean;
        EXPECT_GT(least, m == 2 ? -0.06703 : -1);
        if (walked.estimator.mean == "naive") {
          EXPECT_GE(least, 0);
        }
      }
}

TEST(Jackknife, OfEqualMarchesItIsTheirExponential) {
  for (const int m : {2, 3, 4}) {
    const HandWalked<Jackknife> walked(marches(m, 7), constant(kLog2), 1);
    EXPECT_EQ(*walked.theory().variance, 0);
    for (std::uint64_t sample = 0; sample < 100; ++sample) EXPECT_NEAR(walked.walk(sample).result, 0.5, 1e-15);
  }
}

}  // namespace
}  // namespace nullmark
