#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "harness/statistics/evidence.h"

namespace nullmark {

/// Which claim on the mean error a bet is against.
enum class Role {
  fail,    ///< "it is 0"
  low,     ///< "at most -epsilon"
  high,    ///< "at least epsilon"
  beyond,  ///< "at most epsilon", and "at least -epsilon"
};

/// What is known of the errors of one test before the first sample is drawn.
struct ErrorLaw {
  Real below = kInfinity, above = kInfinity;  ///< the largest errors downwards and upwards; infinite where nothing bounds them
  Real variance = 0;                          ///< of one error
  /// Where the variance is from.  `none`: it guides rates, and no bet rests on it.
  enum class Basis { analytic, pilot, none } basis = Basis::analytic;
  Real reference_error = 0;  ///< bound on the error of what errors are taken from; every claim widens by it
};

/// The bets of a test.  Betting needs a bound on the side that it loses on, Catoni's bet a variance to trust:
///
///   fail, beyond   betting on the bounded sides; Catoni's on both where a side has no bound
///   low, high      betting where its side is bounded, else Catoni's; Catoni's too where the variance is so small,
///                  v < epsilon loss / 2, that betting would be held back by its bound alone
///
/// Rates l, in units of epsilon/v: a PASS is planned for one, .69, which is best at the planned number of samples, and less where
/// it would risk too much at once.  A bias may be of any size: rates against "0" double from .4 up to what the first look makes
/// the best for the least bias that it could prove at all, `first_look` errors.  No bias in between earns less than .89 of what
/// its best rate would.  Without a first look (0) they end at 1.6.
std::vector<std::pair<Role, Bet>> place_bets(const ErrorLaw& law, Real epsilon, std::uint64_t first_look, int most_per_sum);

/// Bets against "it is 0" alone, on both bounded sides, for errors of which the variance is not known: squares of errors less the
/// variance that theory states.  Rates are a quarter of each other, the highest so low that four errors share a sum.
std::vector<std::pair<Role, Bet>> place_blind_bets(const ErrorLaw& law, int most_per_sum);

/// "betting", "catoni", "catoni+betting", or "none": what the bets rest on.
TestBasis basis_of(const std::vector<std::pair<Role, Bet>>& bets);

/// Errors at which both one-sided wealths reach 1/alpha_pass with a normal quantile of `power` to spare, where there is no bias;
/// infinite where nothing can be bet.
Real errors_to_pass(const std::vector<std::pair<Role, Bet>>& bets, const ErrorLaw& law, Real epsilon, Real alpha_pass,
                    Real power);

}  // namespace nullmark
