#include "harness/bets.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace nullmark {
namespace {

using Kind = Bet::Kind;
using Basis = ErrorLaw::Basis;

/// Catoni's variance bound over the known variance: quadrature slack, and what PASS concedes ("given Var <= 1.25 sigma^2").
constexpr Real kFailSlack = 1.02, kPassSlack = 1.25, kPilotSlack = 2;

/// A bet may lose so much of its wealth at once.
constexpr Real kMostLost = 0.9;

/// Of epsilon/v: the rate of PASS, and the least against "0"; those of "beyond".
constexpr Real kPassRate = 0.69, kLeastFailRate = 0.4, kMostPlannedRate = 1.6;
constexpr std::array<Real, 2> kBeyondRates = {0.5, 2};

/// Evidence, in nats, that proves a bias in the largest families: what the highest rate should earn in the first look.
constexpr Real kEvidence = 30;

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

 private:
  bool trusted() const { return law_.basis != Basis::none; }

  /// The most that a bet of this side loses per rate: the largest error against it.
  Real lost(int side, Real limit) const { return side > 0 ? law_.below + limit : law_.above - limit; }

  void place_pass(Role role, int side, Real limit) {
    const Real loss = lost(side, limit);
    const bool held_back = law_.basis == Basis::analytic && law_.variance < 0.5 * epsilon_ * loss;
    if (std::isfinite(loss) && !held_back)
      place(role, Kind::betting, side, limit);
    else if (trusted())
      place(role, Kind::catoni, side, limit);
  }

  void place(Role role, Kind kind, int side, Real limit) {
    const bool passes = role == Role::low || role == Role::high;
    const Real slack = law_.basis == Basis::pilot ? kPilotSlack : kind == Kind::betting ? 1 : passes ? kPassSlack : kFailSlack;
    Bet bet{kind, side, limit, law_.variance * slack, {}, 1};
    const Real unit = epsilon_ / bet.variance, loss = lost(side, limit);
    const Real most = kind == Kind::catoni ? kInfinity : loss > 0 ? kMostLost / loss : kInfinity;
    std::vector<Real> rates;
    if (passes) {
      rates = {kPassRate * unit};
    } else if (role == Role::beyond) {
      for (const Real rate : kBeyondRates) rates.push_back(rate * unit);
    } else {
      // The best rate for a bias d is d/v, which earns d^2/2v an error.
      const Real top = std::min(most, std::max(kMostPlannedRate * unit, std::sqrt(2 * kEvidence / (first_look_ * bet.variance))));
      for (Real rate = kLeastFailRate * unit; rate < 1.41 * top; rate *= 2) rates.push_back(rate);
      if (rates.empty()) rates.push_back(top);
    }
    for (Real& rate : rates) rate = std::min(rate, most);
    rates.erase(std::unique(rates.begin(), rates.end()), rates.end());
    append(role, bet, rates);
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

  /// Sums may be as long as a bet still resembles the product over single errors.
  int errors_per_sum(const Bet& bet, Real rate) const {
    constexpr Real kSmall = 0.5;
    const auto finite = [](Real x) { return std::isfinite(x) ? x : 0; };
    const Real widest = std::max(finite(law_.below), finite(law_.above)) + std::abs(bet.limit);
    int b = most_per_sum_;
    const auto fits = [&] {
      return bet.kind == Kind::catoni ? b * rate * rate * bet.variance <= kSmall * kSmall : b * rate * widest <= kSmall;
    };
    while (b > 1 && !fits()) b /= 2;
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

std::string basis_of(const std::vector<std::pair<Role, Bet>>& bets) {
  bool betting = false, catoni = false;
  for (const auto& [role, bet] : bets) (bet.kind == Kind::betting ? betting : catoni) = true;
  return betting && catoni ? "catoni+betting" : betting ? "betting" : catoni ? "catoni" : "none";
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
      // log wealth has mean growth n and deviation l sqrt(v n).
      const Real l = bet.rates.front(), growth = l * margin - l * l * bet.variance / 2;
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
