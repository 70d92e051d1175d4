#include "estimators/power_series.h"

#include <algorithm>
#include <cmath>

namespace nullmark {

void PoissonTail::set_up(Real mean) {
  // P(N <= M - 9 sqrt(M)) < e^{-81/2} = 2.6e-18, and a walk that long is an error before the table ends.
  constexpr Real kDeviations = 9, kLongest = 0x1p31, kNothing = 0x1p-115;
  const Real low = std::max<Real>(0, std::floor(mean - kDeviations * std::sqrt(mean) - 10));
  mean_ = mean;
  tail_.clear();
  first_ = static_cast<std::int64_t>(std::min(low, kLongest)) + 1;
  if (low >= kLongest) return;
  // Chances of low, low + 1, ..., from the first one's where they start at 0, else up to a factor that their sum tells.
  Real term = low > 0 ? 1 : std::exp(-mean), sum = term, k = low;
  const Real first = term;
  while (!(k > mean && term <= kNothing * sum)) {
    term *= mean / ++k;
    sum += term;
    tail_.push_back(term);
  }
  Real tail = 0;
  Real beyond = term * (mean / ++k);
  while (beyond > 1e-17 * term) {
    tail += beyond;
    beyond *= mean / ++k;
  }
  for (std::size_t i = tail_.size(); i-- > 0;) {
    tail += tail_[i];
    tail_[i] = tail;
  }
  const Real whole = low > 0 ? tail + first : 1;
  for (Real& x : tail_) x = x > kNothing * whole ? std::min<Real>(1, x / whole) : 0;
}

std::int64_t PoissonTail::first_at_most(Real chance) const {
  const auto found = std::partition_point(tail_.begin(), tail_.end(), [&](Real x) { return x > chance; });
  return first_ + (found - tail_.begin());
}

Real PoissonTail::log_at_least(std::int64_t i) const {
  if (at_least(i) > 0) return std::log(at_least(i));
  if (!(mean_ > 0)) return -kInfinity;
  const auto from = static_cast<Real>(i);
  Real sum = 1;
  for (Real term = 1, k = from + 1; term > 1e-17 * sum; ++k) sum += term *= mean_ / k;
  return from * std::log(mean_) - mean_ - log_factorial(from) + std::log(sum);
}

std::optional<Real> series_variance(Real depth, Real first, const std::function<Real(std::int64_t)>& log_growth, Real last) {
  constexpr Real kMostTerms = 1e7, kLeast = -1;
  const Real begin = first > 0 ? std::max<Real>(1, std::floor(first - 12 * std::sqrt(first) - 30)) : 1;
  if (first < kLeast || !(last - begin < kMostTerms)) return std::nullopt;
  if (first == 0) return 0;
  Real log_term = last * std::log(std::abs(first)) - depth - log_factorial(last), following = 1, variance = 0;
  const auto least = static_cast<std::int64_t>(begin);
  for (auto i = static_cast<std::int64_t>(last); i >= least; --i) {
    const auto order = static_cast<Real>(i);
    const Real ahead = 1 + first / (order + 1) * following, growth = log_growth(i);
    // Where it grows much its logarithm may not fit alone.
    const Real square = std::exp(2 * log_term);
    const Real more = growth < 1 ? square * std::expm1(growth) : std::exp(growth + 2 * log_term) - square;
    variance += more * (2 * ahead - 1);
    following = ahead;
    log_term -= std::log(std::abs(first) / order);
  }
  return std::max<Real>(0, variance);
}

Real last_poisson_term(const SeriesMoments& moments) {
  const Real square = moments.first * moments.first * (1 + moments.spread);
  const Real mean = std::max({moments.depth, std::abs(moments.first), moments.depth > 0 ? square / moments.depth : 0});
  return std::floor(mean + 12 * std::sqrt(mean) + 60);
}

}  // namespace nullmark
