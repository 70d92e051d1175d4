#include "harness/evidence.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "media/logarithm.h"

namespace nullmark {
namespace {

/// Sum of log factor(s), with one logarithm for every kTogether factors.
template <class Factor>
Real sum_of_logs(std::span<const Real> sums, Factor factor) {  // Factors are at most 2^100, so that eight of them stay finite.
  constexpr std::size_t kLanes = 64, kTogether = 8;
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
      logs.push_back(sum_of_logs(sums, [=](Real s) { return std::min<Real>(1 + l * (s - shift), 0x1p100); }));
    } else {
      logs.push_back(sum_of_logs(sums, [=](Real s) {
        const Real y = l * (s - shift), size = std::min<Real>(std::abs(y), 0x1p50), f = 1 + size + size * size / 2;
        return y >= 0 ? f : 1 / f;
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
