// The power-series family, against sums written out from the formulas in long double and Boost's special functions.

#include <gtest/gtest.h>

#include <boost/math/distributions/poisson.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>

#include "estimators/p_series_cmf.h"
#include "estimators/p_series_cumulative.h"
#include "estimators/p_series_next_flight.h"
#include "estimators/p_series_ratio.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "media/base/channels.h"

namespace nullmark {
namespace {

using Long = long double;

std::shared_ptr<const Medium> rising_line() { return linear(0, 2 * kLog2); }

TEST(PoissonTail, IsTheIncompleteGammaFunctionAndShort) {
  for (const Real mean : {1e-320, 1e-300, 1e-12, 0.1, 1., 5., 99., 101., 1e3, 1e4, 1e6}) {
    PoissonTail tail;
    tail.set_up(mean);
    const auto middle = static_cast<std::int64_t>(mean), reach = static_cast<std::int64_t>(12 * std::sqrt(mean)) + 60;
    std::int64_t told = 0;
    for (std::int64_t i = std::max<std::int64_t>(1, middle - reach); i <= middle + reach; ++i) {
      const Real exact = boost::math::gamma_p(static_cast<Real>(i), mean), stated = tail.at_least(i);
      if (stated == 0) {
        EXPECT_LT(exact, 0x1p-99) << mean << " " << i;
      } else {
        EXPECT_NEAR(stated, exact, 1e-11 * exact) << mean << " " << i;
      }
      if (exact > 1e-290 && mean > 1e-290) {
        EXPECT_NEAR(tail.log_at_least(i), std::log(exact), 1e-9 * (1 + std::abs(std::log(exact))));
      }
      told += stated > 0 && stated < 1;
    }
    EXPECT_EQ(tail.at_least(0), 1);
    EXPECT_LT(static_cast<Real>(told), 25 * std::sqrt(mean) + 60);
  }
}

/// n0 by the sum that the listing takes.
TEST(PoissonTail, PrefixIsTheNumberOfTermsThatHoldTheShare) {
  for (const Real mean : {1e-3, 0.1, 0.5, 1., kLog2, 2 * kLog2, 2., 5., 10., 20., 50., 100., 600.}) {
    Long term = std::exp(static_cast<Long>(-mean)), held = 0;
    std::int64_t n0 = 0;
    while (held < 0.99L) {
      held += term;
      term *= mean / static_cast<Long>(++n0);
    }
    PoissonTail tail;
    tail.set_up(mean);
    EXPECT_EQ(tail.first_at_most(0.01), n0) << mean;
  }
  // And beyond where e^{-M} is 0: Boost's quantile rounds up.
  for (const Real mean : {1e3, 1e4, 1e6}) {
    PoissonTail tail;
    tail.set_up(mean);
    EXPECT_EQ(static_cast<Real>(tail.first_at_most(0.01)), 1 + boost::math::quantile(boost::math::poisson(mean), 0.99)) << mean;
  }
}

/// M2 - T^2 of e^{-M} sum_{i<=K} W_i/P_i by the double sum over i and j.
Real listed_variance(Long depth, Long m1, Long m2, const std::function<Long(int)>& chance, int terms = 150) {
  const auto f = [](int i) { return std::tgamma(static_cast<Long>(i) + 1); };
  Long sum = 0;
  for (int i = 0; i < terms; ++i) {
    sum += std::pow(m2, static_cast<Long>(i)) / (f(i) * f(i) * chance(i));
    for (int j = i + 1; j < terms; ++j)
      sum += 2 * std::pow(m2, static_cast<Long>(i)) * std::pow(m1, static_cast<Long>(j - i)) / (f(i) * f(j) * chance(i));
  }
  return static_cast<Real>(std::exp(-2 * depth) * (sum - std::exp(2 * m1)));
}

Long poisson_at_least(int i, Long mean) { return i == 0 ? 1 : boost::math::gamma_p(static_cast<Long>(i), mean); }

/// P_i of the CMF walk, by its listing.
std::function<Long(int)> cmf_chance(Long mean) {
  int n0 = 0;
  for (Long term = std::exp(-mean), held = 0; held < 0.99L; term *= mean / ++n0) held += term;
  return [n0, mean](int i) {
    Long p = 1;
    for (int k = n0 + 1; k <= i; ++k) p *= mean / k;
    return p;
  };
}

/// m1 and m2 of mu = begin + (end - begin) x under bounds over equal pieces, by Boost's quadrature.
struct Moments {
  Long depth = 0, m1 = 0, m2 = 0;
};
Moments moments_of(Real begin, Real end, Real looseness, int pieces) {
  Moments m;
  const auto mu = [&](Long x) { return begin + (end - begin) * x; };
  Long square = 0;
  for (int i = 0; i < pieces; ++i) {
    const Long a = static_cast<Long>(i) / pieces, b = static_cast<Long>(i + 1) / pieces;
    const Long bound = looseness * std::max(mu(a), mu(b));
    using Rule = boost::math::quadrature::gauss_kronrod<Long, 31>;
    m.depth += bound * (b - a);
    m.m1 += Rule::integrate([&](Long x) { return bound - mu(x); }, a, b);
    square += Rule::integrate([&](Long x) { return (bound - mu(x)) * (bound - mu(x)) / bound; }, a, b);
  }
  m.m2 = m.depth * square;
  return m;
}

TEST(PowerSeries, TheoryIsTheDoubleSumOverTerms) {
  struct Case {
    Real begin, end, looseness;
    int pieces;
  };
  for (const Case& c :
       {Case{0, 2 * kLog2, 1, 1}, Case{0, 2 * kLog2, 2, 1}, Case{0, 2 * kLog2, 0.9, 1}, Case{0, 2 * kLog2, 0.5, 1},
        Case{kLog2, kLog2, 2, 1}, Case{0.5, 1.5, 1, 4}, Case{0.5, 1.5, 3, 4}, Case{2, 6, 3, 5}}) {
    SCOPED_TRACE(testing::Message() << c.begin << " to " << c.end << ", " << c.looseness << " x " << c.pieces);
    const Moments m = moments_of(c.begin, c.end, c.looseness, c.pieces);
    const Real square = static_cast<Real>(std::exp(-2 * m.depth + 2 * m.m1));
    const HandWalked<PowerSeriesNextFlight> flight({}, linear(c.begin, c.end), 1, c.looseness, c.pieces);
    const Real expected = listed_variance(m.depth, m.m1, m.m2, [&](int i) { return poisson_at_least(i, m.depth); });
    EXPECT_NEAR(*flight.theory().variance, expected, 1e-9 * expected + 1e-16 * square);
    EXPECT_NEAR(*flight.theory().lookups, static_cast<Real>(m.depth), 1e-12 * static_cast<Real>(m.depth));
    const HandWalked<PowerSeriesCmf> cmf({}, linear(c.begin, c.end), 1, c.looseness, c.pieces);
    const Real tight = listed_variance(m.depth, m.m1, m.m2, cmf_chance(m.depth));
    EXPECT_NEAR(*cmf.theory().variance, tight, 1e-9 * tight + 1e-16 * square);
    Long lookups = 0;
    for (int i = 1; i < 150; ++i) lookups += cmf_chance(m.depth)(i);
    EXPECT_NEAR(*cmf.theory().lookups, static_cast<Real>(lookups), 1e-12 * static_cast<Real>(lookups));
  }
}

TEST(PowerSeries, TheoryHasThePublishedValues) {
  struct Case {
    Real looseness;
    bool rises;
    Real cmf, cmf_lookups, flight;
  };
  for (const Case& c : {Case{1, false, 0, 4.1564, 0}, Case{2, false, 7.4e-11, 6.2385, .028695},
                        Case{1, true, .023620, 6.2385, .067283}, Case{2, true, .012205, 8.4213, .086115}}) {
    const auto medium = c.rises ? rising_line() : constant(kLog2);
    const Theory cmf = HandWalked<PowerSeriesCmf>({}, medium, 1, c.looseness).theory();
    EXPECT_NEAR(*cmf.variance, c.cmf, c.rises ? 5e-7 : 5e-13);
    EXPECT_NEAR(*cmf.lookups, c.cmf_lookups, 6e-5);
    EXPECT_NEAR(*HandWalked<PowerSeriesNextFlight>({}, medium, 1, c.looseness).theory().variance, c.flight, 5e-7);
    const Theory ratio = HandWalked<PowerSeriesRatio>({}, medium, 1, c.looseness).theory();
    const Real mub = c.looseness * kLog2 * (c.rises ? 2 : 1), squares = kLog2 * kLog2 * (c.rises ? 4. / 3 : 1);
    EXPECT_NEAR(*ratio.variance, 0.25 * std::expm1(squares / mub), 1e-14);
  }
  for (const auto& [depth, lookups] : {std::pair{.1, 2.034},
                                       {.5, 4.109},
                                       {1., 5.194},
                                       {2., 7.319},
                                       {5., 12.588},
                                       {10., 19.926},
                                       {20., 33.405},
                                       {50., 70.37},
                                       {100., 128.44}})
    EXPECT_NEAR(*HandWalked<PowerSeriesCmf>({}, constant(depth / 2), 1, 2).theory().lookups, lookups, 6e-4 * (1 + lookups / 10));
}

/// Constant ratio: P_k = min(1, m^k/k!) until the terms fall below 1 and the product of chances from there on, which is the same.
Theory listed_cumulative(Long mub, Long mu) {
  const Long m = mub - mu;
  Long variance = -std::exp(2 * m), lookups = 1, before = 0, term = 1;
  for (int k = 0; k < 200; ++k) {
    if (k > 0) term *= m / k;
    const Long p = std::min<Long>(1, term), w = term / p;
    if (!(p > 0)) break;
    variance += p * (w * w + 2 * w * before);
    before += w;
    if (k > 0) lookups += p;
  }
  return {.variance = static_cast<Real>(std::exp(-2 * mub) * variance), .lookups = static_cast<Real>(lookups)};
}

TEST(Cumulative, ConstantRatiosHaveTheClosedForm) {
  for (const auto& [mub, mu] : {std::pair{5., 1.}, {2 * kLog2, kLog2}, {2., 1.99}, {10., 1.}, {40., 2.}}) {
    const Theory theory = HandWalked<PowerSeriesCumulative>({}, constant(mu), 1, mub / mu).theory(),
                 listed = listed_cumulative(mub, mu);
    EXPECT_NEAR(*theory.variance, *listed.variance, 1e-9 * *listed.variance + 1e-17) << mub;
    EXPECT_NEAR(*theory.lookups, *listed.lookups, 1e-12 * *listed.lookups) << mub;
  }
  const Theory published = HandWalked<PowerSeriesCumulative>({}, constant(1), 1, 5).theory();
  EXPECT_NEAR(*published.variance, 5.1985e-5, 5e-10);
  EXPECT_NEAR(*published.lookups, 10.166, 5e-4);
}

TEST(Cumulative, RouletteThroughoutHasTheClosedForm) {
  // (mub - mu) M <= 1 on all of the ray
  const HandWalked<PowerSeriesCumulative> hand({}, linear(0.5, 0.9), 1, 1.2, 3);
  const Moments moments = moments_of(0.5, 0.9, 1.2, 3);
  const auto depth = static_cast<Real>(moments.depth), m = static_cast<Real>(moments.m1);
  EXPECT_NEAR(*hand.theory().variance, std::exp(-2 * depth) * ((2 * m + 1) * std::exp(m) - std::exp(2 * m)), 1e-13);
  EXPECT_NEAR(*hand.theory().lookups, std::exp(m), 1e-12);
}

TEST(Cumulative, SaysNothingWhereItsChancesDependOnThePoints) {
  const HandWalked<PowerSeriesCumulative> hand({}, rising_line(), 1, 2);
  EXPECT_FALSE(hand.theory().variance);
  EXPECT_FALSE(hand.theory().lookups);
  Estimate result, square, lookups;
  for (std::uint64_t sample = 0; sample < 1 << 20; ++sample) {
    const auto walk = hand.walk(sample);
    result.add(walk.result);
    square.add((walk.result - 0.5) * (walk.result - 0.5));
    lookups.add(walk.lookups);
  }
  EXPECT_NEAR(result.mean(), 0.5, kSigmas * result.error());
  EXPECT_NEAR(square.mean(), .01622, kSigmas * square.error() + 5e-6);
  EXPECT_NEAR(lookups.mean(), 5.181, kSigmas * lookups.error() + 5e-4);
}

/// Channels with one roulette: theory of both closed forms against samples, channel by channel, above and below the bound.
TEST(Cumulative, ChannelsShareTheRoulette) {
  const auto expect = [](const std::shared_ptr<const Medium>& medium, Real looseness, int pieces) {
    const HandWalked<PowerSeriesCumulative, Spectrum> hand({}, medium, 1, looseness, pieces);
    constexpr std::uint64_t kSamples = 1 << 18;
    std::vector<Estimate> result(3), square(3);
    Estimate lookups;
    for (std::uint64_t sample = 0; sample < kSamples; ++sample) {
      const auto walk = hand.walk(sample);
      for (int c = 0; c < 3; ++c) {
        const Real error = walk.result[c] - hand.transmittance(1)[c];
        result[static_cast<std::size_t>(c)].add(error);
        square[static_cast<std::size_t>(c)].add(error * error);
      }
      lookups.add(walk.lookups);
    }
    for (int c = 0; c < 3; ++c) {
      const Theory theory = hand.theory(c);
      ASSERT_TRUE(theory.variance && theory.lookups);
      const auto k = static_cast<std::size_t>(c);
      EXPECT_NEAR(result[k].mean(), 0, kSigmas * std::sqrt(*theory.variance / kSamples) + 1e-15) << c;
      EXPECT_NEAR(square[k].mean(), *theory.variance, kSigmas * square[k].error() + 1e-15) << c;
      EXPECT_NEAR(lookups.mean(), *theory.lookups, kSigmas * std::sqrt(*theory.lookups_variance / kSamples) + 1e-12) << c;
    }
  };
  std::vector<std::shared_ptr<const Medium>> flat, ramps;
  for (const Real value : {1., 0.4, 0.}) flat.push_back(constant(value));
  for (const auto& [begin, end] : {std::pair{0.3, 0.6}, {0.5, 0.2}, {0.1, 0.1}}) ramps.push_back(linear(begin, end));
  expect(std::make_shared<PerChannel>(flat), 1, 1);
  expect(std::make_shared<PerChannel>(flat), 2.5, 1);
  expect(std::make_shared<PerChannel>(flat), 0.8, 1);
  expect(std::make_shared<PerChannel>(ramps), 1, 1);
  expect(std::make_shared<PerChannel>(ramps), 1.2, 3);
}

/// e^{-M} underflows, W overflows: T must come out, e^-1 of a thin medium under a bound that is a thousand times too loose and
/// more.
TEST(PowerSeries, DeepLooseBoundsKeepTheMean) {
  const auto expect = [](const auto& hand, int samples, Real least) {
    Estimate result;
    for (int sample = 0; sample < samples; ++sample) result.add(hand.walk(static_cast<std::uint64_t>(sample)).result);
    const Theory theory = hand.theory();
    ASSERT_TRUE(theory.variance);
    const Real error = std::sqrt(*theory.variance / samples);
    EXPECT_NEAR(result.mean(), std::exp(-1.), kSigmas * error + 1e-10);
    EXPECT_LT(error, least);
  };
  for (const auto& [depth, samples] : {std::pair{1e3, 6000}, {1e4, 600}}) {
    expect(HandWalked<PowerSeriesRatio>({}, constant(1), 1, depth), samples, 1e-3);
    expect(HandWalked<PowerSeriesNextFlight>({}, constant(1), 1, depth), samples, 4e-2);
    expect(HandWalked<PowerSeriesCmf>({}, constant(1), 1, depth), samples / 10, 1e-3);
    expect(HandWalked<PowerSeriesCumulative>({}, constant(1), 1, depth), samples / 10, 1e-12);
    // 10 pieces, some of them far looser than others
    expect(HandWalked<PowerSeriesRatio>({}, linear(0.1, 1.9), 1, depth, 10), samples, 1e-3);
    expect(HandWalked<PowerSeriesNextFlight>({}, linear(0.1, 1.9), 1, depth, 10), samples, 4e-2);
    expect(HandWalked<PowerSeriesCmf>({}, linear(0.1, 1.9), 1, depth, 10), samples / 10, 1e-1);
  }
}

/// A million deep: the set-up of a ray is short, one sample is finite and where it should be.
TEST(PowerSeries, AMillionDeep) {
  EXPECT_NEAR(HandWalked<PowerSeriesCmf>({}, constant(1), 1, 1e6).walk(1).result, std::exp(-1.), 2e-2);
  EXPECT_NEAR(HandWalked<PowerSeriesCumulative>({}, constant(1), 1, 1e6).walk(1).result, std::exp(-1.), 1e-8);
  EXPECT_NEAR(HandWalked<PowerSeriesRatio>({}, constant(1), 1, 1e6).walk(1).result, std::exp(-1.), 0.01);
  const Real flight = HandWalked<PowerSeriesNextFlight>({}, constant(1), 1, 1e6).walk(1).result;
  EXPECT_TRUE(flight >= 0 && flight < 10) << flight;
}

template <template <class> class Estimator>
void expect_series_limits() {
  for (const Real depth : {1e6, 1e4, 800.}) {
    const HandWalked<Estimator> opaque({}, constant(depth), 1), uneven({}, linear(depth, 2 * depth), 1);
    EXPECT_EQ(opaque.walk(1).result, 0) << depth;
    const Real result = uneven.walk(1).result;
    EXPECT_TRUE(result >= 0 && result < 1e-200) << depth << " " << result;
  }
  for (const Real value : {0., 5e-324, 1e-310, 1e-300, 1e-17})
    for (const Real looseness : {1., 1.7}) {
      const HandWalked<Estimator> thin({}, constant(value), 1, looseness);
      for (std::uint64_t sample = 0; sample < 20; ++sample) EXPECT_NEAR(thin.walk(sample).result, 1, 1e-15) << value;
      EXPECT_TRUE(!thin.theory().variance || *thin.theory().variance < 1e-15) << value;
    }
}

TEST(PowerSeries, LimitsAreFinite) {
  expect_series_limits<PowerSeriesRatio>();
  expect_series_limits<PowerSeriesNextFlight>();
  expect_series_limits<PowerSeriesCmf>();
  expect_series_limits<PowerSeriesCumulative>();
}

/// The sum as it is listed, without the powers of 2 set aside.
TEST(PowerSeries, ScalingChangesNoDigitWhereNothingOverflows) {
  const HandWalked<PowerSeriesCmf> hand({}, linear(0.2, 1.8), 1, 50);  // W up to e^88, e^-90
  for (std::uint64_t sample = 0; sample < 200; ++sample) {
    Rng one(SampleAddress{7, 8, sample}), other(SampleAddress{7, 8, sample});
    const Real depth = hand.ray.majorant.total_depth();
    Real u = one.uniform(), w = 1, s = 1;
    for (std::int64_t i = 1;; ++i) {
      const bool always = static_cast<Real>(i) <= hand.ray.always;
      if (!always) {
        if (!(u < depth / static_cast<Real>(i))) break;
        u /= depth / static_cast<Real>(i);
      }
      const Real x = one.uniform();
      w *= (!always ? 1 : depth / static_cast<Real>(i)) * (1 - (0.2 + 1.6 * x) / depth);
      s += w;
    }
    const Real result = hand.walk(other).result;
    ASSERT_NEAR(result, s * std::exp(-depth), 1e-12 * result) << sample;
  }
}

}  // namespace
}  // namespace nullmark
