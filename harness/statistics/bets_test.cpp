// Which bets are placed: what they earn, and what they rest on.

#include "harness/statistics/bets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace nullmark {
namespace {

constexpr std::uint64_t kFirstLook = 4096;

std::vector<std::pair<Role, Bet>> of_role(const std::vector<std::pair<Role, Bet>>& bets, Role role) {
  std::vector<std::pair<Role, Bet>> some;
  std::copy_if(bets.begin(), bets.end(), std::back_inserter(some), [&](const auto& placed) { return placed.first == role; });
  return some;
}

/// Growth an error of a bet at rate l against 0 where the bias is d: l d - l^2 v/2, the best of all rates placed on one side.
Real best_growth(const std::vector<std::pair<Role, Bet>>& bets, Real bias) {
  Real best = -kInfinity;
  for (const auto& [role, bet] : bets)
    for (const Real l : bet.rates)
      if (bet.side > 0) best = std::max(best, l * bias - l * l * bet.variance / 2);
  return best;
}

/// Any bias between what PASS is planned for and what the first look can prove earns .89 of what its best rate would.
TEST(Bets, NoBiasFallsBetweenTheRates) {
  const Real variance = 1.02 * 0.02, epsilon = 1e-4;
  const auto bets = of_role(place_bets({.variance = 0.02}, epsilon, kFirstLook, 64), Role::fail);
  const Real largest = std::sqrt(2 * 30 * variance / static_cast<Real>(kFirstLook));
  for (Real bias = 0.5 * epsilon; bias < largest / 1.5; bias *= 1.1)
    EXPECT_GE(best_growth(bets, bias), 0.88 * bias * bias / (2 * variance)) << bias / epsilon;
}

/// A bias of a hundred epsilon at one standard deviation in ten: the first look proves it, where two rates near epsilon/v did
/// not.
TEST(Bets, AFirstLookProvesALargeBias) {
  const Real epsilon = 1e-4, bias = 0.0276;
  for (const ErrorLaw& law : {ErrorLaw{.variance = 0.02}, ErrorLaw{.below = 0.5, .above = 0.5, .variance = 0.02}}) {
    const auto bets = of_role(place_bets(law, epsilon, kFirstLook, 64), Role::fail);
    EXPECT_GT(best_growth(bets, bias) * kFirstLook, 25);  // the largest families need 22
    Real planned = -kInfinity;
    for (const Real l : {0.4 * epsilon / 0.02, 1.5 * epsilon / 0.02})
      planned = std::max(planned, (l * bias - l * l * 0.02 / 2) * kFirstLook);
    EXPECT_LT(planned, 1);
  }
}

/// Wealth stays positive whatever the range allows, and no bet is on sums that could overdraw it.
TEST(Bets, NoBetCanLoseMoreThanItHas) {
  for (const Real variance : {1e-12, 1e-6, 1e-3, 0.25})
    for (const Real epsilon : {1e-6, 1e-3, 0.1})
      for (const auto basis : {ErrorLaw::Basis::analytic, ErrorLaw::Basis::pilot, ErrorLaw::Basis::none})
        for (const Real above : {0.9, kInfinity}) {
          const ErrorLaw law{0.1, above, variance, basis, 1e-9};
          for (const auto& [role, bet] : place_bets(law, epsilon, kFirstLook, 64)) {
            if (bet.kind != Bet::Kind::betting) continue;
            const Real loss = bet.side > 0 ? law.below + bet.limit : law.above - bet.limit;
            for (const Real rate : bet.rates) {
              EXPECT_GT(rate, 0);
              EXPECT_LT(rate * loss * bet.errors_per_sum, 0.95);
            }
          }
        }
}

TEST(Bets, WithoutARangeOrAVarianceToTrustThereIsNone) {
  EXPECT_TRUE(place_bets({.variance = 1e-9, .basis = ErrorLaw::Basis::none}, 0.01, kFirstLook, 64).empty());
  EXPECT_EQ(basis_of({}), TestBasis::none);
  EXPECT_FALSE(place_bets({.variance = 1e-9, .basis = ErrorLaw::Basis::pilot}, 0.01, kFirstLook, 64).empty());
}

/// A variance far below epsilon: betting alone takes hundreds of samples, whatever they are, Catoni's bet a handful.
TEST(Bets, LowVariancesPassSoon) {
  const Real epsilon = 0.0037, variance = epsilon * epsilon / 4;
  const ErrorLaw known{0.37, 0.63, variance, ErrorLaw::Basis::analytic}, unknown{0.37, 0.63, variance, ErrorLaw::Basis::none};
  const auto samples = [&](const ErrorLaw& law) {
    return errors_to_pass(place_bets(law, epsilon, kFirstLook, 64), law, epsilon, 1e-3, 1.645);
  };
  EXPECT_LT(samples(known), 20);
  EXPECT_GT(samples(unknown), 500);
  EXPECT_LT(samples(unknown), 3000);
}

/// Of rare large losses, a rate of epsilon/v would lose what it wins: 1 or 0 with a chance of .0067, told to 1 %.
TEST(Bets, RareLossesAreReckonedWith) {
  const Real chance = 0.0067, epsilon = 0.01, variance = chance * (1 - chance);
  const ErrorLaw law{1 - chance, kInfinity, variance, ErrorLaw::Basis::none};
  const auto low = of_role(place_bets(law, epsilon, kFirstLook, 64), Role::low);
  ASSERT_EQ(low.size(), 1u);
  const Bet& bet = low[0].second;
  const Real l = bet.rates.at(0);
  const Real growth = (1 - chance) * std::log1p(l * (chance - bet.limit)) + chance * std::log1p(l * (chance - 1 - bet.limit));
  EXPECT_GT(growth, 0.002);
  const Real planned = errors_to_pass(place_bets(law, epsilon, kFirstLook, 64), law, epsilon, 1e-3, 0);
  EXPECT_GT(planned * growth, std::log(1e3) * 0.8);
}

/// The reference's own error widens every claim.
TEST(Bets, ClaimsWidenByTheReferencesError) {
  for (const auto& [role, bet] : place_bets({.variance = 0.1, .reference_error = 0.001}, 0.01, kFirstLook, 64)) {
    const Real limit = bet.side * bet.limit;
    EXPECT_DOUBLE_EQ(limit, role == Role::fail ? 0.001 : role == Role::beyond ? 0.011 : -0.009);
  }
}

}  // namespace
}  // namespace nullmark
