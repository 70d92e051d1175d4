// Unidirectional and bidirectional MIS, against loops written by hand from the paper's listings.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimators/mis_bidirectional.h"
#include "estimators/mis_unidirectional.h"
#include "estimators/next_flight_ratio.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"

namespace nullmark {
namespace {

std::shared_ptr<const Medium> rising() { return linear(0, 2 * kLog2); }

TEST(UnidirectionalMis, TheoryHasTheValuesOfTheClosedForms) {
  const auto expect = [](const std::shared_ptr<const Medium>& medium, Real looseness, Real variance, Real tolerance) {
    const HandWalked<UnidirectionalMis> hand({}, medium, 1, looseness);
    EXPECT_NEAR(*hand.theory().variance, variance, tolerance);
    EXPECT_NEAR(*hand.theory().lookups, looseness * hand.ray.medium->maximum[0], 1e-12);
  };
  expect(constant(kLog2), 2, .007383, 5e-7);
  expect(rising(), 1, .018306, 5e-7);
  expect(rising(), 2, .024153, 5e-7);
  // Where the bound is tight a walk ends its weight at the first collision: S is c, or 2 c with probability T.
  for (const Real tau : {1e-6, 0.1, 1., 5., 30.}) {
    const Real t = std::exp(-tau);
    const Real exact = t * (1 - t) * t * t / ((1 + t) * (1 + t));
    expect(constant(tau), 1, exact, 1e-14 * t);
  }
}

/// The listing as it is printed: balance heuristic of escape and next flight at every vertex, over a global bound.
Real listed_unidirectional(std::mt19937_64& random, Real mub, Real d, const auto& mu) {
  std::exponential_distribution<Real> flight(mub);
  Real x = 0, w = 1, s = 0;
  for (;;) {
    const Real v = std::exp(-mub * (d - x));
    s += w * v / (1 + v);
    x += flight(random);
    if (x >= d) return s + w * v / (1 + v);
    w *= 1 - mu(x) / mub;
  }
}

/// Var's own standard error is sqrt((m4 - Var^2)/n).
struct Spread {
  Real mean, mean_error, variance, variance_error;
};
Spread spread_of(std::size_t samples, const auto& draw) {
  std::vector<Real> x(samples);
  for (Real& one : x) one = draw();
  const auto n = static_cast<Real>(samples);
  Real mean = 0, second = 0, fourth = 0;
  for (const Real one : x) mean += one / n;
  for (const Real one : x) {
    const Real square = (one - mean) * (one - mean);
    second += square / n;
    fourth += square * square / n;
  }
  return {mean, std::sqrt(second / n), second, std::sqrt((fourth - second * second) / n)};
}

TEST(UnidirectionalMis, ListingAndTrackerMeetTheoryBelowAndAboveTheBound) {
  constexpr std::size_t kSamples = 1 << 20;
  for (const Real looseness : {0.6, 1., 3.}) {
    const HandWalked<UnidirectionalMis> hand({}, linear(0.5, 1.5), 1, looseness);
    const Real variance = *hand.theory().variance;
    std::mt19937_64 random(3);
    std::uint64_t sample = 0;
    for (const Spread& spread :
         {spread_of(kSamples, [&] { return listed_unidirectional(random, 1.5 * looseness, 1, [](Real x) { return 0.5 + x; }); }),
          spread_of(kSamples, [&] { return hand.walk(sample++).result; })}) {
      EXPECT_NEAR(spread.mean, std::exp(-1.), kSigmas * spread.mean_error);
      EXPECT_NEAR(spread.variance, variance, kSigmas * spread.variance_error);
    }
  }
}

/// A piecewise bound: the same law as in the medium stretched to majorant depth, where the bound is 1 everywhere.
TEST(UnidirectionalMis, LocalBoundsAreTheGlobalFormInMajorantDepth) {
  const HandWalked<UnidirectionalMis> hand({}, linear(0.5, 1.5), 1, 1.2, 4);
  const Rates& bounds = hand.ray.majorant;
  std::mt19937_64 random(5);
  const auto ratio = [&](Real depth) {
    std::size_t piece = 0;
    while (depth >= bounds.depth_after(piece)) ++piece;
    return (0.5 + bounds.position(piece, depth)) / bounds.rate(piece);
  };
  const Spread spread = spread_of(1 << 20, [&] { return listed_unidirectional(random, 1, bounds.total_depth(), ratio); });
  EXPECT_NEAR(spread.mean, std::exp(-1.), kSigmas * spread.mean_error);
  EXPECT_NEAR(spread.variance, *hand.theory().variance, kSigmas * spread.variance_error);
}

/// All techniques of one pair of walks, each as its density over those of all techniques that make the same path, as the paper
/// has it; n^3 work.  Walks are drawn as the tracker draws them.
Real listed_bidirectional(Rng& random, Real mub, Real d, const auto& mu) {
  std::vector<Real> a{0}, b{d}, A{1}, B{1};
  for (Real x = random.exponential() / mub; x < d; x += random.exponential() / mub) {
    a.push_back(x);
    A.push_back(A.back() * (1 - mu(x) / mub));
  }
  for (Real x = d - random.exponential() / mub; x > 0; x -= random.exponential() / mub) {
    b.push_back(x);
    B.push_back(B.back() * (1 - mu(x) / mub));
  }
  const Real whole = std::exp(-mub * d);
  const auto p = [&](Real gap) { return whole / std::exp(-mub * gap); };
  const auto gaps = [&](const std::vector<Real>& x, std::size_t last) {
    Real sum = 0;
    for (std::size_t k = 1; k <= last; ++k) sum += p(std::abs(x[k] - x[k - 1]));
    return sum;
  };
  Real s = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (!(b[j] > a[i])) continue;
      const Real gap = b[j] - a[i];
      s += A[i] * B[j] * std::exp(-mub * gap) * p(gap) / (p(gap) + gaps(a, i) + gaps(b, j) + 2 * whole);
    }
  s += A.back() * whole / (2 * whole + gaps(a, a.size() - 1) + p(d - a.back()));
  s += B.back() * whole / (2 * whole + gaps(b, b.size() - 1) + p(b.back()));
  return s;
}

TEST(BidirectionalMis, EverySampleIsThatOfTheListing) {
  for (const Real mub : {1., 1.5, 6., 40.}) {
    const HandWalked<BidirectionalMis> hand({}, linear(0.5, 1.5), 1, mub / 1.5);
    for (std::uint64_t sample = 0; sample < 2000; ++sample) {
      Rng one(SampleAddress{1, 2, sample}), other(SampleAddress{1, 2, sample});
      const Real listed = listed_bidirectional(one, mub, 1, [](Real x) { return 0.5 + x; });
      ASSERT_NEAR(hand.walk(other).result, listed, 1e-12 * (1 + listed)) << mub << ", sample " << sample;
      ASSERT_EQ(one.draws(), other.draws());
    }
  }
}

TEST(BidirectionalMis, MeanAndVarianceOnTheReferenceMedium) {
  for (const auto& [looseness, variance] : {std::pair{1., .0181}, {2., .0288}}) {
    const HandWalked<BidirectionalMis> hand({}, rising(), 1, looseness);
    std::uint64_t sample = 0;
    const Spread spread = spread_of(1 << 20, [&] { return hand.walk(sample++).result; });
    EXPECT_NEAR(spread.mean, 0.5, kSigmas * spread.mean_error);
    EXPECT_NEAR(spread.variance, variance, kSigmas * spread.variance_error + 5e-5);
  }
}

/// Where the bound is tight only whole gaps carry weight: S = (1 + [walk gets through] + [the other does])/(2 + e^tau).
TEST(BidirectionalMis, TightBoundsHaveTheLawOfTwoCoins) {
  constexpr Real kTau = 0.8;
  const HandWalked<BidirectionalMis> hand({}, constant(kTau), 1);
  const Real t = std::exp(-kTau), unit = 1 / (2 + 1 / t);
  std::uint64_t sample = 0;
  const Spread spread = spread_of(1 << 18, [&] { return hand.walk(sample++).result; });
  EXPECT_NEAR(spread.mean, t, kSigmas * spread.mean_error);
  EXPECT_NEAR(spread.variance, 2 * t * (1 - t) * unit * unit, kSigmas * spread.variance_error);
}

/// Constant mu = 1 over a length of 1 below mub = 1 + d: Var = d^2/e int_0^1 e^-s (1 - s)^2 ds = d^2 (1 - 2/e)/e up to d^3.
TEST(NextFlightRatio, VarianceBelowABoundThatIsHardlyLoose) {
  for (const Real d : {1e-4, 1e-6, 1e-8, 1e-11}) {
    const Real variance = *HandWalked<NextFlightRatioTracking>({}, constant(1), 1, 1 + d).theory().variance;
    const Real loose = (1 + d) - 1;  // as it is in double
    EXPECT_NEAR(variance / (loose * loose), (1 - 2 * std::exp(-1.)) * std::exp(-1.), 1e-4 + 4 * d) << d;
  }
  // 0 as well where T^2 is far below the rounding of what is left of a deep ray.
  for (const Real depth : {1., 100.})
    EXPECT_EQ(*HandWalked<NextFlightRatioTracking>({}, constant(depth), 1, 1).theory().variance, 0) << depth;
}

/// Thick bounds: e^gap overflows, pairs are many, T is not small.
TEST(Mis, DeepLooseBoundsKeepTheMean) {
  const auto expect = [](const auto& hand, std::size_t samples) {
    std::uint64_t sample = 0;
    const Spread spread = spread_of(samples, [&] { return hand.walk(sample++).result; });
    EXPECT_NEAR(spread.mean, std::exp(-1.), kSigmas * spread.mean_error);
    EXPECT_LT(spread.mean_error, 0.04);
  };
  for (const auto& [depth, samples] : {std::pair{1e3, 2000}, {1e4, 500}}) {
    expect(HandWalked<UnidirectionalMis>({}, constant(1), 1, depth), static_cast<std::size_t>(samples));
    expect(HandWalked<BidirectionalMis>({}, constant(1), 1, depth), static_cast<std::size_t>(samples) / 2);
  }
}

template <template <class> class Estimator>
void expect_limits() {
  for (const Real depth : {1e6, 1e3}) {
    const HandWalked<Estimator> opaque({}, constant(depth), 1);
    EXPECT_EQ(opaque.walk(1).result, 0) << depth;
  }
  for (const Real value : {0., 5e-324, 1e-310, 1e-300, 1e-17}) {
    const HandWalked<Estimator> thin({}, constant(value), 1);
    EXPECT_NEAR(thin.walk(1).result, 1, 4e-16) << value;
  }
}

TEST(Mis, LimitsAreFinite) {
  expect_limits<UnidirectionalMis>();
  expect_limits<BidirectionalMis>();
}

}  // namespace
}  // namespace nullmark
