#include "harness/evidence.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "media/elementary.h"

namespace nullmark {
namespace {

/// Largest factor: more than that is not won at once.  Its kTogether-th power is finite.
constexpr Real kMostWon = 0x1p30;

/// Sum of log factor(s), factor <= kMostWon, with one logarithm for every kTogether factors.
template <class Factor>
Real sum_of_logs(std::span<const Real> sums, Factor factor) {
  constexpr std::size_t kLanes = 64, kTogether = 32;
  // A wealth that is lost for good; what this adds to its expectation is nothing.
  constexpr Real kLost = 1e-300;
  std::array<Real, kLanes> product;
  Real total = 0;
  for (std::size_t i = 0; i < sums.size();) {
    product.fill(1);
    for (std::size_t k = 0; k < kTogether && i < sums.size(); ++k) {
      const std::size_t n = std::min(kLanes, sums.size() - i);
      const Real* s = &sums[i];
      if (n == kLanes) {
        for (std::size_t j = 0; j < kLanes; ++j) product[j] *= factor(s[j]);
      } else {
        for (std::size_t j = 0; j < n; ++j) product[j] *= factor(s[j]);
      }
      i += n;
    }
    for (Real& x : product) x = std::max(x, kLost);
    negative_logarithms(product.data(), kLanes, product.data());
    for (const Real negative : product) total -= negative;
  }
  return total;
}

}  // namespace

std::vector<Real> bet_on(const Bet& bet, std::span<const Real> sums, int errors_per_sum) {
  std::vector<Real> logs;
  const Real shift = bet.limit * errors_per_sum;
  for (const Real rate : bet.rates) {
    const Real l = rate * bet.side;
    if (bet.kind == Bet::Kind::betting) {
      logs.push_back(sum_of_logs(sums, [=](Real x) { return std::min(1 + l * (x - shift), kMostWon); }));
    } else {
      logs.push_back(sum_of_logs(sums, [=](Real x) {
        const Real y = l * (x - shift), size = std::abs(y), f = 1 + size + size * size / 2;
        return y >= 0 ? std::min(f, kMostWon) : 1 / f;
      }));
    }
  }
  return logs;
}

Real log_denominator(const Bet& bet, Real rate, std::uint64_t sums, int errors_per_sum) {
  if (bet.kind == Bet::Kind::betting) return 0;
  return static_cast<Real>(sums) * std::log1p(rate * rate * errors_per_sum * bet.variance / 2);
}

Real log_mean_exp(std::span<const Real> logs) {
  if (logs.empty()) return -kInfinity;
  const Real most = *std::max_element(logs.begin(), logs.end());
  if (!std::isfinite(most)) return most;
  Real sum = 0;
  for (const Real x : logs) sum += std::exp(x - most);
  return most + std::log(sum / static_cast<Real>(logs.size()));
}

}  // namespace nullmark
