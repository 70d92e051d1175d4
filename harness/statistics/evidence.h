#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// A bet against a one-sided claim on the mean of independent errors e, placed at several rates l at once.  Each rate's wealth is
/// a nonnegative supermartingale of expectation at most 1 while the claim is true [Ville 1939], so P(it ever reaches 1/alpha) <=
/// alpha at any stopping time.  Errors enter in sums S of b each (a sum's mean and variance are b times an error's, so validity
/// is untouched, and at the small rates used the power is):
///
///   betting  1 + y,  y = l side (S - b limit), where l keeps 1 + y > 0 [Waudby-Smith and Ramdas 2024]
///   catoni   exp phi(y) / (1 + l^2 b v / 2),  phi(y) = sgn(y) log(1 + |y| + y^2/2), for variance at most v [Wang and Ramdas
///   2023]; phi grows, so a mean further inside the claim wins no more than one at the limit
///
/// Errors of rays with different means may share a bet: the average of factors bounds their geometric mean, so the claim is then
/// one on the average over the rays.
struct Bet {
  enum class Kind { betting, catoni };
  Kind kind = Kind::betting;
  int side = 1;  ///< +1: against "mean <= limit", -1: against "mean >= limit"
  Real limit = 0;
  Real variance = 0;        ///< v, Catoni only
  std::vector<Real> rates;  ///< l
  int errors_per_sum = 1;   ///< b
};

/// Adds to `logs`, one for each rate, what sums of `errors_per_sum` errors each add to the log of the bet's wealth; without
/// Catoni's denominator, which depends on the number of sums alone: the logs of shards add up to the log of the whole.
void bet_on(const Bet& bet, std::span<const Real> sums, std::span<Real> logs);

/// log((1 + l^2 b v/2)^sums) of a Catoni bet at rate l; 0 for a betting one.
Real log_denominator(const Bet& bet, Real rate, std::uint64_t sums);

/// log of the average of exp(logs); -inf for none.
Real log_mean_exp(std::span<const Real> logs);

}  // namespace nullmark
