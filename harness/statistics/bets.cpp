#include "harness/statistics/bets.h"

#include <algorithm>
#include <cmath>

namespace nullmark {
namespace {

using Kind = Bet::Kind;
using Basis = ErrorLaw::Basis;

/// Catoni's variance bound over the known variance: quadrature slack, and what PASS concedes ("given Var <= 1.25 sigma^2").
constexpr Real kFailSlack = 1.02, kPassSlack = 1.25, kPilotSlack = 2;

/// A bet may lose so much of its wealth at once: of a planned rate, and of those that only hope.
constexpr Real kMostLost = 0.9, kMostRisked = 0.5;

/// Of epsilon/v: the rate of PASS, and the least against "0"; those of "beyond".
constexpr Real kPassRate = 0.69, kLeastFailRate = 0.4, kMostPlannedRate = 1.6, kBeyondRate = 1;

/// Evidence, in nats, that proves a bias in the largest families: what the highest rate should earn in the first look.
constexpr Real kEvidence = 30;

/// The highest rates bet on sums of so many errors: shorter ones cost more time than they save samples.
constexpr int kShortestSum = 4;

class Placing {
 public:
  Placing(const ErrorLaw& law, Real epsilon, std::uint64_t first_look, int most_per_sum)
      : law_(law), epsilon_(epsilon), first_look_(static_cast<Real>(first_look)), most_per_sum_(most_per_sum) {}

  std::vector<std::pair<Role, Bet>> all() {
    const bool unbounded = !std::isfinite(law_.below) || !std::isfinite(law_.above);
    for (const Role role : {Role::fail, Role::beyond})
      for (const int side : {1, -1}) {
        const Real limit = side * (law_.reference_error + (role == Role::beyond ? epsilon_ : 0));
        if (unbounded && trusted()) place(role, Kind::catoni, side, limit);
        if (std::isfinite(lost(side, limit))) place(role, Kind::betting, side, limit);
      }
    const Real limit = epsilon_ - law_.reference_error;
    place_pass(Role::low, 1, -limit);
    place_pass(Role::high, -1, limit);
    return std::move(bets_);
  }

  std::vector<std::pair<Role, Bet>> blind() {
    constexpr int kRates = 5;
    for (const int side : {1, -1}) {
      Bet bet{Kind::betting, side, side * law_.reference_error, 0, {}, 1};
      const Real loss = lost(side, bet.limit);
      if (!std::isfinite(loss) || !(loss > 0)) continue;
      std::vector<Real> rates;
      for (Real rate = kMostRisked / (kShortestSum * loss); rates.size() < kRates; rate /= 4) rates.push_back(rate);
      append(Role::fail, bet, rates);
    }
    return std::move(bets_);
  }

 private:
  bool trusted() const { return law_.basis != Basis::none; }

  /// The most that a bet of this side loses per rate: the largest error against it.
  Real lost(int side, Real limit) const { return side > 0 ? law_.below + limit : law_.above - limit; }

  void place_pass(Role role, int side, Real limit) {
    const Real loss = lost(side, limit);
    constexpr Real kHeldBack = 0.5;
    const bool held_back = law_.basis == Basis::analytic && law_.variance < kHeldBack * epsilon_ * loss;
    if (std::isfinite(loss) && !held_back)
      place(role, Kind::betting, side, limit);
    else if (trusted())
      place(role, Kind::catoni, side, limit);
  }

  void place(Role role, Kind kind, int side, Real limit) {
    const bool passes = role == Role::low || role == Role::high;
    const Real slack = law_.basis == Basis::pilot ? kPilotSlack : kind == Kind::betting ? 1 : passes ? kPassSlack : kFailSlack;
    Bet bet{kind, side, limit, law_.variance * slack, {}, 1};
    const Real unit = epsilon_ / bet.variance, loss = kind == Kind::catoni ? 0 : std::max<Real>(0, lost(side, limit));
    if (passes) {
      // Of all laws of this variance the one of two values, -loss and near 0, loses most: for it l = d/(v + d loss) is best.
      const Real rate = kPassRate * unit;
      append(role, bet, {std::min(rate / (1 + rate * loss), loss > 0 ? kMostLost / loss : kInfinity)});
      return;
    }
    const Real most = loss > 0 ? kMostRisked / loss : kInfinity;
    std::vector<Real> rates = role == Role::beyond ? std::vector{kBeyondRate * unit} : ladder(bet, unit);
    for (Real& rate : rates) rate = std::min(rate, most);
    rates.erase(std::unique(rates.begin(), rates.end()), rates.end());
    append(role, bet, rates);
  }

  /// Rates against "0".  The best one for a bias d is d/v, which earns d^2/2v an error.
  std::vector<Real> ladder(const Bet& bet, Real unit) const {
    constexpr Real kBetweenSteps = 1.41;
    const Real seen_at_once = first_look_ > 0 ? std::sqrt(2 * kEvidence / (first_look_ * bet.variance)) : 0;
    const Real top = std::max(kMostPlannedRate * unit, std::min(seen_at_once, most_for(bet, kShortestSum)));
    std::vector<Real> rates;
    for (Real rate = kLeastFailRate * unit; rate < kBetweenSteps * top; rate *= 2) rates.push_back(rate);
    return rates;
  }

  /// Rates that may bet on sums of as many errors share a bet.
  void append(Role role, const Bet& like, const std::vector<Real>& rates) {
    for (const Real rate : rates) {
      const int together = errors_per_sum(like, rate);
      if (bets_.empty() || bets_.back().first != role || bets_.back().second.kind != like.kind ||
          bets_.back().second.side != like.side || bets_.back().second.errors_per_sum != together) {
        bets_.emplace_back(role, like);
        bets_.back().second.errors_per_sum = together;
      }
      bets_.back().second.rates.push_back(rate);
    }
  }

  /// The highest rate at which a bet on sums of b errors still resembles the product over single ones.
  Real most_for(const Bet& bet, int b) const {
    constexpr Real kSmall = 0.5;
    if (bet.kind == Kind::catoni) return kSmall / std::sqrt(b * bet.variance);
    const auto finite = [](Real x) { return std::isfinite(x) ? x : 0; };
    return kSmall / (b * (std::max(finite(law_.below), finite(law_.above)) + std::abs(bet.limit)));
  }

  int errors_per_sum(const Bet& bet, Real rate) const {
    int b = most_per_sum_;
    while (b > 1 && rate > most_for(bet, b)) b /= 2;
    return b;
  }

  const ErrorLaw& law_;
  Real epsilon_, first_look_;
  int most_per_sum_;
  std::vector<std::pair<Role, Bet>> bets_;
};

}  // namespace

std::vector<std::pair<Role, Bet>> place_bets(const ErrorLaw& law, Real epsilon, std::uint64_t first_look, int most_per_sum) {
  return Placing(law, epsilon, first_look, most_per_sum).all();
}

std::vector<std::pair<Role, Bet>> place_blind_bets(const ErrorLaw& law, int most_per_sum) {
  return Placing(law, 0, 0, most_per_sum).blind();
}

TestBasis basis_of(const std::vector<std::pair<Role, Bet>>& bets) {
  bool betting = false, catoni = false;
  for (const auto& [role, bet] : bets) (bet.kind == Kind::betting ? betting : catoni) = true;
  return betting && catoni ? TestBasis::both : betting ? TestBasis::betting : catoni ? TestBasis::catoni : TestBasis::none;
}

Real errors_to_pass(const std::vector<std::pair<Role, Bet>>& bets, const ErrorLaw& law, Real epsilon, Real alpha_pass,
                    Real power) {
  const Real margin = epsilon - law.reference_error;
  if (!(margin > 0)) return kInfinity;
  Real most = 0;
  for (const Role role : {Role::low, Role::high}) {
    Real errors = kInfinity;
    for (const auto& [placed, bet] : bets) {
      if (placed != role) continue;
      // log wealth has mean growth n and deviation l sqrt(v n).  For the law that loses most, E log(1 - l e) is
      // v (log(1 - r) + r) / loss^2, with r = l loss; of small r, and of Catoni's bet, -l^2 v/2.
      const Real l = bet.rates.front(), loss = bet.side > 0 ? law.below + bet.limit : law.above - bet.limit, r = l * loss;
      const bool small = bet.kind == Kind::catoni || !(r > 1e-3);
      const Real lost = small ? l * l * bet.variance / 2 : -bet.variance * (std::log1p(-r) + r) / (loss * loss);
      const Real growth = l * margin - lost;
      const Real swing = power * l * std::sqrt(law.variance), needed = -std::log(alpha_pass);
      if (!(growth > 0)) continue;
      const Real root = (swing + std::sqrt(swing * swing + 4 * growth * needed)) / (2 * growth);
      errors = std::min(errors, root * root);
    }
    most = std::max(most, errors);
  }
  return most;
}

}  // namespace nullmark
