// Trackers guided by what a majorant leaves over, or that learn one: theory against other programs and direct sums, closed forms,
// zero variance where promised, media at the ends of the number range.

#include <gtest/gtest.h>

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>
#include <random>

#include "estimators/majorant_guided_ratio.h"
#include "estimators/progressive_majorant.h"
#include "estimators/taylor_pink_noise.h"
#include "estimators/theory/guided_theory.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "media/base/channels.h"
#include "media/exponential.h"
#include "media/layers.h"

namespace nullmark {
namespace {

MajorantGuidedRatio<Real> guided(const char* start) {
  MajorantGuidedRatio<Real> tracker;
  tracker.start = start;
  return tracker;
}

TaylorPinkNoise<Real> pink(Real c) {
  TaylorPinkNoise<Real> tracker;
  tracker.c = c;
  return tracker;
}

ProgressiveMajorant<Real> learned(int passes, Real initial = 0.01, Real margin = 0.2) {
  ProgressiveMajorant<Real> tracker;
  tracker.passes = passes;
  tracker.initial = initial;
  tracker.margin = margin;
  return tracker;
}

/// Mean and variance about a known mean, and the mean of another number, each with its error.
struct Sampled {
  Estimate value, square, lookups;

  void add(Real error, Real count) {
    value.add(error);
    square.add(error * error);
    lookups.add(count);
  }
  void expect(Real mean_error, Real variance, Real mean_lookups) const {
    EXPECT_NEAR(value.mean(), mean_error, kSigmas * value.error());
    EXPECT_NEAR(square.mean(), variance, kSigmas * square.error());
    EXPECT_NEAR(lookups.mean(), mean_lookups, kSigmas * lookups.error());
  }
};

TEST(MajorantGuidedRatio, ReferenceValuesOnTheLinearMedium) {
  const Theory theory = HandWalked<MajorantGuidedRatio>(guided("majorant"), linear(0, 1, kLog2), 1).theory();
  EXPECT_NEAR(*theory.variance, 0.1230, 2e-4);
  EXPECT_NEAR(*theory.lookups, 1.163, 2e-3);
}

/// By another program: in distance, with the tracking rate m itself, redrawn at the ends of cells.
TEST(MajorantGuidedRatio, TheoryAgreesWithAnIndependentProgram) {
  const auto mu = [](long double x) { return 5 * std::exp(-3 * x) + .2L * x; };
  std::mt19937_64 generator(7);
  std::exponential_distribution<long double> exponential;
  Exponential field;
  field.profile = {5, -3};
  for (const int pieces : {1, 4})
    for (const bool looked_up : {false, true}) {
      const HandWalked<MajorantGuidedRatio> walked(guided(looked_up ? "lookup" : "majorant"), built(field), 1, 1.1, pieces);
      const Theory theory = walked.theory();
      const Real truth = std::exp(5. / 3 * std::expm1(-3.));
      const auto extinction = [&](long double x) { return mu(x) - .2L * x; };
      Sampled program, own;
      for (int sample = 0; sample < 400000; ++sample) {
        long double t = 0, weight = 1, share = 1;
        int lookups = 0, cell = 0;
        const auto bound = [&] { return static_cast<long double>(walked.ray.majorant.rate(static_cast<std::size_t>(cell))); };
        if (looked_up) {
          share = std::max(.1L, 1 - extinction(0) / bound());
          ++lookups;
        }
        while (cell < pieces) {
          const long double end = static_cast<long double>(cell + 1) / pieces, mub = bound(), m = share * mub;
          const long double dt = exponential(generator) / m;
          if (t + dt >= end) {
            weight *= std::exp((m - mub) * (end - t));
            t = end;
            ++cell;
            continue;
          }
          t += dt;
          ++lookups;
          weight *= (mub - extinction(t)) / m * std::exp((m - mub) * dt);
          share = std::max(.1L, 1 - extinction(t) / mub);
        }
        program.add(static_cast<Real>(weight) - truth, lookups);
        const auto outcome = walked.walk(static_cast<std::uint64_t>(sample));
        own.add(outcome.result - truth, outcome.lookups);
        ASSERT_GE(outcome.result, 0);
        ASSERT_LE(outcome.result, looked_up ? 10 : 1);
      }
      SCOPED_TRACE(testing::Message() << pieces << " cells, start " << looked_up);
      program.expect(0, *theory.variance, *theory.lookups);
      own.expect(0, *theory.variance, *theory.lookups);
      EXPECT_NEAR(own.lookups.variance() / *theory.lookups_variance, 1, 0.05);
    }
}

TEST(MajorantGuidedRatio, NoVarianceOnConstantExtinctionWithAStartThatWasLookedUp) {
  for (const Real looseness : {1.12, 2., 50.}) {
    const HandWalked<MajorantGuidedRatio> walked(guided("lookup"), constant(kLog2), 1, looseness);
    EXPECT_EQ(*walked.theory().variance, 0);
    for (std::uint64_t sample = 0; sample < 3000; ++sample) ASSERT_NEAR(walked.walk(sample).result, 0.5, 1e-13);
  }
  // Where the least rate takes over, or the first flight is not guided, there is some.
  EXPECT_GT(*HandWalked<MajorantGuidedRatio>(guided("lookup"), constant(kLog2), 1, 1.1).theory().variance, 1e-5);
  EXPECT_GT(*HandWalked<MajorantGuidedRatio>(guided("majorant"), constant(kLog2), 1, 2).theory().variance, 1e-2);
}

/// sum_i A_i m2^i + 2 sum_{i<j} A_j m2^i m1^{j-i}, term by term.
TEST(TaylorPinkNoise, VarianceAndLookupsAreTheSeries) {
  using Rule = boost::math::quadrature::gauss_kronrod<Real, 61>;
  for (const Real c : {0.3, 0.8})
    for (const Real looseness : {0.7, 1., 1.3}) {
      const HandWalked<TaylorPinkNoise> walked(pink(c), linear(0, 1, kLog2), 1, looseness);
      const Real square = c * c, depth = 2 * kLog2 * looseness, scale = 1 / (1 + depth * square);
      const auto moment = [&](int power) {
        return Rule::integrate([&](Real x) { return std::pow((depth - 2 * kLog2 * x) * scale, power); }, 0., 1.);
      };
      const Real m1 = moment(1), m2 = moment(2), start = std::pow(1 + depth * square, -1 / square);
      Real mean = 0, second = 0, lookups = -1, chance = 1, inner = 0;  // inner: sum_{i<j} m2^i m1^{j-i}
      for (int j = 0; j < 4000; ++j) {
        if (j > 0) {
          chance *= (1 + (j - 1) * square) / j;
          inner = (inner + std::pow(m2, j - 1)) * m1;
        }
        mean += chance * std::pow(m1, j);
        second += chance * (std::pow(m2, j) + 2 * inner);
        lookups += chance;
      }
      mean *= start;
      const Theory theory = walked.theory();
      EXPECT_NEAR(mean, std::pow(1 + kLog2 * square, -1 / square), 1e-12);
      EXPECT_NEAR(*theory.variance, second * start * start - mean * mean, 1e-10);
      EXPECT_NEAR(*theory.lookups, lookups, 1e-9);
      EXPECT_NEAR(walked.estimator.expected(kLog2, walked.ray), mean, 1e-12);
      Sampled sampled;
      for (std::uint64_t sample = 0; sample < 300000; ++sample) {
        const auto outcome = walked.walk(sample);
        sampled.add(outcome.result - mean, outcome.lookups);
      }
      sampled.expect(0, *theory.variance, *theory.lookups);
      EXPECT_NEAR(sampled.lookups.variance() / *theory.lookups_variance, 1, 0.05);
    }
}

TEST(TaylorPinkNoise, LocalBoundsAreWeighedByTheirDepth) {
  const HandWalked<TaylorPinkNoise> walked(pink(0.5), linear(0, 3), 1, 1, 4);
  const Real truth = std::pow(1 + 1.5 * 0.25, -4);
  Sampled sampled;
  for (std::uint64_t sample = 0; sample < 300000; ++sample) {
    const auto outcome = walked.walk(sample);
    sampled.add(outcome.result - truth, outcome.lookups);
  }
  sampled.expect(0, *walked.theory().variance, *walked.theory().lookups);
}

TEST(TaylorPinkNoise, NoVarianceUnderATightBoundAndNoneThatIsFiniteUnderALooseOne) {
  const HandWalked<TaylorPinkNoise> tight(pink(0.3), constant(2), 1);
  EXPECT_NEAR(*tight.theory().variance, 0, 1e-16);
  for (std::uint64_t sample = 0; sample < 1000; ++sample)
    ASSERT_NEAR(tight.walk(sample).result, std::pow(1.18, -1 / 0.09), 1e-15);
  EXPECT_EQ(*HandWalked<TaylorPinkNoise>(pink(0.3), constant(2), 1, 5).theory().variance, kInfinity);
  const HandWalked<TaylorPinkNoise> vacuum(pink(0.3), constant(0), 1);
  EXPECT_EQ(vacuum.walk(0).result, 1);
  EXPECT_EQ(vacuum.walk(0).lookups, 0);
}

/// After n passes the medium is still unseen with chance e^{-n B d}; a bound that is seen to be too low is never so again.
TEST(ProgressiveMajorant, BiasOnConstantExtinctionIsThatOfAMediumNotYetSeen) {
  constexpr Real kInitial = 0.25;
  const auto medium = constant(kLog2);
  for (const int passes : {0, 1, 4, 16, 40}) {
    const HandWalked<ProgressiveMajorant> walked(learned(passes, kInitial), medium, 1);
    Estimate bias;
    for (std::uint64_t sample = 0; sample < 200000; ++sample) bias.add(walked.walk(sample).result - 0.5);
    EXPECT_NEAR(bias.mean(), std::exp(-passes * kInitial) * (std::exp(-kInitial) - 0.5), kSigmas * bias.error()) << passes;
  }
}

TEST(ProgressiveMajorant, TheFirstPassMeetsItsTheory) {
  for (const int pieces : {1, 3}) {
    const HandWalked<ProgressiveMajorant> walked(learned(0, 0.8), linear(0, 2), 1, 1, pieces);
    const Theory theory = walked.theory();
    // int min(2x, .8) = .16 + .48; lookups .8 (.4 + int_0^.6 e^{-.8 x}).
    EXPECT_NEAR(*theory.mean, std::exp(-.64), 1e-12);
    EXPECT_NEAR(*theory.lookups, .32 - std::expm1(-.48), 1e-12);
    Sampled sampled;
    for (std::uint64_t sample = 0; sample < 300000; ++sample) {
      const auto outcome = walked.walk(sample);
      sampled.add(outcome.result - *theory.mean, outcome.lookups);
    }
    sampled.expect(0, *theory.variance, *theory.lookups);
  }
}

/// The bias falls to nothing with the passes, for one cell and for several; each sample pays for all of its passes.
TEST(ProgressiveMajorant, BiasFallsToNothingWithPasses) {
  for (const int pieces : {1, 4}) {
    Real before = kInfinity, lookups = 0;
    for (const int passes : {0, 8, 64, 1024}) {
      const HandWalked<ProgressiveMajorant> walked(learned(passes, 0.05), linear(0.2, 2), 1, 1, pieces);
      Estimate bias, cost;
      const std::uint64_t samples = passes < 1000 ? 100000 : 40000;
      for (std::uint64_t sample = 0; sample < samples; ++sample) {
        const auto outcome = walked.walk(sample);
        bias.add(outcome.result - std::exp(-1.1));
        cost.add(outcome.lookups);
      }
      EXPECT_LT(bias.mean() + kSigmas * bias.error(), before) << passes;
      EXPECT_GT(cost.mean(), lookups);
      before = bias.mean() - kSigmas * bias.error();
      lookups = cost.mean();
      if (passes == 1024) {
        EXPECT_NEAR(bias.mean(), 0, kSigmas * bias.error());
      }
    }
  }
}

TEST(ProgressiveMajorant, ChannelsShareWhatIsLearned) {
  const auto medium = std::make_shared<Spectral>(constant(1), std::vector<Real>{0.3, 1.5});
  ProgressiveMajorant<Spectrum> tracker;
  tracker.passes = 200;
  tracker.initial = 0.1;
  const HandWalked<ProgressiveMajorant, Spectrum> walked(tracker, medium, 1);
  Estimate bias[2];
  for (std::uint64_t sample = 0; sample < 50000; ++sample) {
    const auto outcome = walked.walk(sample);
    bias[0].add(outcome.result[0] - std::exp(-.3));
    bias[1].add(outcome.result[1] - std::exp(-1.5));
  }
  for (const Estimate& one : bias) EXPECT_NEAR(one.mean(), 0, kSigmas * one.error());
}

TEST(Guided, ExtremeDepthsStayFinite) {
  Layers steps;
  steps.profile.values = {0, 2e6, 0, 1e-310};
  for (const auto& medium : {constant(1e6), linear(0, 2e6), linear(2e6, 0), constant(5e-324), linear(0, 1e-310), built(steps)}) {
    for (const char* start : {"majorant", "lookup"})
      for (const int pieces : {1, 4}) {
        const HandWalked<MajorantGuidedRatio> walked(guided(start), medium, 1, 1, pieces);
        const auto outcome = walked.walk(1);
        ASSERT_TRUE(std::isfinite(outcome.result));
        ASSERT_GE(outcome.result, 0);
      }
    const HandWalked<TaylorPinkNoise> noise(pink(0.3), medium, 1);
    const HandWalked<ProgressiveMajorant> progressive(learned(3), medium, 1);
    for (std::uint64_t sample = 0; sample < 300; ++sample) {
      ASSERT_TRUE(std::isfinite(noise.walk(sample).result));
      if (sample < 3) {
        ASSERT_TRUE(std::isfinite(progressive.walk(sample).result));
      }
    }
  }
}

}  // namespace
}  // namespace nullmark
