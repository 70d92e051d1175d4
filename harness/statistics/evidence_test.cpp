// Wealth of the bets against the plain product over single errors, in extended precision.

#include "harness/statistics/evidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "estimators/walk/rng.h"

namespace nullmark {
namespace {

/// Logs of a bet on sums of so many errors.
std::vector<Real> bet_on(Bet bet, std::span<const Real> sums, int together) {
  bet.errors_per_sum = together;
  std::vector<Real> logs(bet.rates.size());
  nullmark::bet_on(bet, sums, logs);
  return logs;
}

Real log_denominator(Bet bet, Real rate, std::uint64_t sums, int together) {
  bet.errors_per_sum = together;
  return nullmark::log_denominator(bet, rate, sums);
}

constexpr Real kMost = std::numeric_limits<Real>::max();

long double factor(const Bet& bet, Real rate, long double sum, int together) {
  const long double y = static_cast<long double>(rate) * bet.side * (sum - static_cast<long double>(bet.limit) * together);
  if (bet.kind == Bet::Kind::betting) return 1 + y;
  const long double f = 1 + std::abs(y) + y * y / 2;
  return y < 0 ? 1 / f : f;
}

/// log of the product, factor by factor.
long double plain(const Bet& bet, Real rate, const std::vector<Real>& sums, int together = 1) {
  long double log = 0;
  for (const Real sum : sums) log += std::log(factor(bet, rate, sum, together));
  return log;
}

std::vector<Real> uniforms(std::size_t count, Real low, Real high, std::uint64_t key = 1) {
  Rng rng(SampleAddress{key, 0, 0});
  std::vector<Real> values(count);
  for (Real& value : values) value = low + (high - low) * rng.uniform();
  return values;
}

void expect_plain(const Bet& bet, const std::vector<Real>& sums, int together = 1) {
  const std::vector<Real> logs = bet_on(bet, sums, together);
  ASSERT_EQ(logs.size(), bet.rates.size());
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const long double expected = plain(bet, bet.rates[i], sums, together);
    // Rounding of a factor, of its place in a product and of the logarithms, at most once per error each.
    EXPECT_NEAR(logs[i], static_cast<Real>(expected), 1e-15 * (static_cast<Real>(sums.size()) + std::abs(logs[i])))
        << "rate " << bet.rates[i] << ", side " << bet.side << ", " << sums.size() << " sums";
  }
}

TEST(Evidence, IsTheProductOverSingleErrors) {
  for (const std::size_t count : {1u, 2u, 63u, 64u, 65u, 2047u, 2048u, 2049u, 10000u})
    for (const int side : {-1, 1}) {
      expect_plain({Bet::Kind::betting, side, 0, 0, {1e-6, 0.01, 0.3, 0.5}}, uniforms(count, -1, 1));
      expect_plain({Bet::Kind::betting, side, 0.02 * side, 0, {1e-6, 0.01, 0.3, 0.5}}, uniforms(count, -0.1, 1));
      expect_plain({Bet::Kind::catoni, side, 0, 0.3, {1e-6, 0.01, 0.3, 2}}, uniforms(count, -1, 1));
      expect_plain({Bet::Kind::catoni, side, -0.1, 7, {1e-6, 0.01, 0.3}}, uniforms(count, -5, 20));
    }
}

/// The same factor thousands of times, on both sides of what is multiplied without a second look.
TEST(Evidence, LargeAndSmallFactorsNeitherOverflowNorVanish) {
  for (const Real f : {1e-4, 1 / 17., 1 / 15.5, 15.5, 17., 1e5})
    for (const int side : {-1, 1})
      expect_plain({Bet::Kind::betting, side, 0, 0, {1, 1}}, std::vector<Real>(5000, side * (f - 1)));
  for (const Real y : {-300., -5., -4.2, 4.2, 5., 300.})
    for (const int side : {-1, 1}) expect_plain({Bet::Kind::catoni, side, 0, 1, {1, 0.9}}, std::vector<Real>(5000, y));
}

TEST(Evidence, OfSumsIsTheProductOverSums) {
  const std::vector<Real> errors = uniforms(6400, -1, 1);
  for (const int together : {2, 16, 64}) {
    std::vector<Real> sums(errors.size() / static_cast<std::size_t>(together), 0);
    for (std::size_t i = 0; i < errors.size(); ++i) sums[i / static_cast<std::size_t>(together)] += errors[i];
    for (const int side : {-1, 1}) {
      expect_plain({Bet::Kind::betting, side, 0.003 * side, 0, {1e-4, 0.5 / together / 1.1}}, sums, together);
      expect_plain({Bet::Kind::catoni, side, 0.003 * side, 0.4, {1e-4, 0.1}}, sums, together);
    }
    // At rates far below 1/together a sum stands for its errors.
    const Bet slow{Bet::Kind::betting, 1, 0, 0, {1e-5}};
    EXPECT_NEAR(bet_on(slow, sums, together)[0], bet_on(slow, errors, 1)[0], 1e-4);
  }
}

/// Against a law known exactly: the expectation of one factor is at most 1 where the claim holds, and is 1 on its edge.
TEST(Evidence, AFactorIsWorthAtMostOne) {
  // +9 with probability .1, else -1: mean 0, variance 9.
  const auto worth = [](const Bet& bet) {
    const auto one = [&](Real error) { return std::exp(bet_on(bet, std::vector{error}, 1)[0]); };
    return (0.1 * one(9) + 0.9 * one(-1)) / std::exp(log_denominator(bet, bet.rates[0], 1, 1));
  };
  for (const Real rate : {0.001, 0.01, 0.05, 0.1}) {
    for (const int side : {-1, 1}) {
      EXPECT_NEAR(worth({Bet::Kind::betting, side, 0, 0, {rate}}), 1, 1e-14);
      EXPECT_LT(worth({Bet::Kind::betting, side, 0.1 * side, 0, {rate}}), 1);
      EXPECT_LE(worth({Bet::Kind::catoni, side, 0, 9, {rate}}), 1 + 1e-14);
      EXPECT_GT(worth({Bet::Kind::catoni, side, 0, 9, {rate}}), 1 - 40 * rate * rate * rate * 81);
      EXPECT_GT(worth({Bet::Kind::betting, side, -0.1 * side, 0, {rate}}), 1) << "a claim that is wrong loses";
    }
    EXPECT_GT(worth({Bet::Kind::catoni, -1, 0, 0, {rate}}) + worth({Bet::Kind::catoni, 1, 0, 0, {rate}}), 2)
        << "the denominator is what makes it fair";
  }
}

TEST(Evidence, ShardsAdd) {
  const std::vector<Real> errors = uniforms(5000, -1, 1, 3);
  for (const Bet::Kind kind : {Bet::Kind::betting, Bet::Kind::catoni}) {
    const Bet bet{kind, 1, 0.01, 0.5, {0.01, 0.4}};
    const std::vector<Real> whole = bet_on(bet, errors, 1);
    for (const std::size_t cut : {std::size_t{0}, std::size_t{1}, std::size_t{100}, std::size_t{4096}, errors.size()}) {
      const std::vector<Real> first = bet_on(bet, std::span(errors).first(cut), 1);
      const std::vector<Real> second = bet_on(bet, std::span(errors).subspan(cut), 1);
      for (std::size_t i = 0; i < whole.size(); ++i) EXPECT_NEAR(first[i] + second[i], whole[i], 1e-11);
    }
    EXPECT_NEAR(log_denominator(bet, 0.4, 5000, 8), log_denominator(bet, 0.4, 1234, 8) + log_denominator(bet, 0.4, 3766, 8),
                1e-9);
  }
}

TEST(Evidence, Denominator) {
  const Bet bet{Bet::Kind::catoni, 1, 0, 3, {0.2}};
  EXPECT_NEAR(log_denominator(bet, 0.2, 10, 4), 10 * std::log(1 + 0.2 * 0.2 * 4 * 3 / 2), 1e-12);
  // Where 1 + l^2 v/2 rounds to 1.
  EXPECT_NEAR(log_denominator(bet, 1e-9, 1'000'000'000'000, 1), 1.5e-6, 1e-18);
  EXPECT_EQ(log_denominator(bet, 0.2, 0, 4), 0);
  EXPECT_EQ(log_denominator({Bet::Kind::betting, 1, 0, 3, {0.2}}, 0.2, 10, 4), 0);
}

TEST(Evidence, NothingIsWorthNothing) {
  for (const Bet::Kind kind : {Bet::Kind::betting, Bet::Kind::catoni})
    EXPECT_EQ(bet_on({kind, 1, 0, 1, {0.1, 0.2}}, {}, 1), (std::vector<Real>{0, 0}));
  EXPECT_TRUE(bet_on({Bet::Kind::betting, 1, 0, 0, {}}, std::vector<Real>{1}, 1).empty());
}

/// Whatever the errors, wealth stays a number that further errors may add to: never more than was won, and lost for good at
/// worst.
TEST(Evidence, HugeErrorsAreFinite) {
  for (const Bet::Kind kind : {Bet::Kind::betting, Bet::Kind::catoni})
    for (const std::size_t count : {1u, 64u, 5000u}) {
      const Bet up{kind, 1, 0, 1, {1e-3, 0.5}};
      for (const Real huge : {1e10, 1e155, 1e300, kMost}) {
        const std::vector<Real> won = bet_on(up, std::vector<Real>(count, huge), 1);
        for (std::size_t i = 0; i < won.size(); ++i) {
          // A factor is capped at 2^30.
          const Real least = kind == Bet::Kind::catoni || huge > 1e13 ? 30 * std::log(2.) : std::log(1 + up.rates[i] * huge);
          const Real capped = static_cast<Real>(count) * std::min(least, 30 * std::log(2.));
          EXPECT_NEAR(won[i], capped, 1e-9 * capped) << huge;
        }
        if (kind == Bet::Kind::betting) continue;
        const std::vector<Real> lost = bet_on(up, std::vector<Real>(count, -huge), 1);
        for (const Real log : lost) {
          EXPECT_TRUE(std::isfinite(log)) << huge;
          EXPECT_LT(log, -10);
        }
      }
    }
  // One that is none of the numbers among tame ones.
  for (const Real odd : {std::numeric_limits<Real>::quiet_NaN(), kInfinity, -kInfinity})
    for (const std::size_t at : {0u, 70u, 4095u, 4100u})
      for (const int side : {-1, 1})
        for (const Bet::Kind kind : {Bet::Kind::betting, Bet::Kind::catoni}) {
          const Bet bet{kind, side, 0, 1, {1e-3, 0.3}};
          std::vector<Real> sums = uniforms(4101, -1, 1);
          sums[at] = 0;
          const std::vector<Real> without = bet_on(bet, sums, 1);
          sums[at] = odd;
          const std::vector<Real> with = bet_on(bet, sums, 1);
          for (std::size_t i = 0; i < with.size(); ++i) {
            EXPECT_TRUE(std::isfinite(with[i])) << odd;
            EXPECT_LE(with[i], without[i] + 30 * std::log(2.) + 1e-9) << odd;
          }
        }
  // Ruined twice in one lane, not made rich by it.
  for (const Real ruin : {-3., -1e300, -kInfinity})
    for (const std::size_t apart : {8u, 16u, 32u, 256u}) {
      std::vector<Real> sums(600, 0);
      sums[1] = sums[1 + apart] = ruin;
      EXPECT_LT(bet_on({Bet::Kind::betting, 1, 0, 0, {0.5}}, sums, 1)[0], -600) << ruin << ", " << apart;
    }
  // The cap lowers wealth: what a single error wins is bounded, what it loses is not forgotten.
  const Bet down{Bet::Kind::betting, -1, 0, 0, {0.25}};
  const std::vector<Real> ruin(3000, 4 - 1e-12);
  EXPECT_LT(bet_on(down, ruin, 1)[0], -20000);
  EXPECT_LT(log_mean_exp(bet_on({Bet::Kind::catoni, 1, 0, 1, {0.5}}, std::vector<Real>{-1e200, 1e200}, 1)), 0);
}

TEST(Evidence, MeanOfExponentials) {
  EXPECT_EQ(log_mean_exp({}), -kInfinity);
  EXPECT_EQ(log_mean_exp(std::vector<Real>{3.5}), 3.5);
  EXPECT_NEAR(log_mean_exp(std::vector<Real>{0, std::log(3.)}), std::log(2.), 1e-15);
  EXPECT_NEAR(log_mean_exp(std::vector<Real>{1e4, 1e4 + std::log(3.)}), 1e4 + std::log(2.), 1e-11);
  EXPECT_NEAR(log_mean_exp(std::vector<Real>{-1e4, -2e4}), -1e4 - std::log(2.), 1e-11);
  EXPECT_NEAR(log_mean_exp(std::vector<Real>{-kInfinity, 1}), 1 - std::log(2.), 1e-15);
  EXPECT_EQ(log_mean_exp(std::vector<Real>{-kInfinity, -kInfinity}), -kInfinity);
}

}  // namespace
}  // namespace nullmark
