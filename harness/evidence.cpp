#include "harness/evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "harness/eight.h"
#include "media/elementary.h"

namespace nullmark {
namespace {

/// Largest factor: more than that is not won at once.  Its kTogether-th power is finite.
constexpr Real kMostWon = 0x1p30;
constexpr std::size_t kTogether = 32;

/// Products in lanes, of any size: mantissas in [1, 2) and powers of two apart, so that logarithms are taken once at the end.
class Products {
 public:
  /// Takes x > 0, finite; by x^-1 where `sign` is -1.
  void multiply(Eight x, int sign) {
    take_exponent(x, sign);
    mantissa_ = sign > 0 ? mantissa_ * x : mantissa_ / x;
    take_exponent(mantissa_, 1);
  }

  /// Sum of the logarithms of all lanes.
  Real log() const {
    std::array<Real, kEight> negative;
    store(mantissa_, negative.data());
    negative_logarithms(negative.data(), kEight, negative.data());
    Real sum = 0;
    std::int64_t exponents = 0;
    for (std::size_t lane = 0; lane < kEight; ++lane) {
      sum -= negative[lane];
      exponents += exponent_[lane];
    }
    return sum + static_cast<Real>(exponents) * std::numbers::ln2_v<Real>;
  }

 private:
  using Integers [[gnu::vector_size(sizeof(Eight))]] = std::int64_t;

  void take_exponent(Eight& x, int sign) {
    constexpr int kFraction = 52;
    constexpr std::int64_t kBias = 1023;
    Integers bits;
    std::memcpy(&bits, &x, sizeof bits);
    exponent_ += sign * ((bits >> kFraction) - kBias);
    bits = (bits & ((std::int64_t{1} << kFraction) - 1)) | (kBias << kFraction);
    std::memcpy(&x, &bits, sizeof bits);
  }

  Eight mantissa_ = Eight{} + 1;
  Integers exponent_{};
};

/// Sum of log won(s) - log lost(s); `factor` multiplies the two products by a sum's, won <= kMostWon.  A sum `neutral` has
/// factor 1.
template <class Factor>
Real sum_of_logs(std::span<const Real> sums, Real neutral, Factor factor) {
  // A wealth that is lost for good; what this adds to its expectation is nothing.
  constexpr Real kLost = 1e-300;
  constexpr std::size_t kChains = 4;  // that do not wait for each other
  const Eight least = Eight{} + kLost, most = Eight{} + 1 / kLost;
  Products products;
  for (std::size_t i = 0; i < sums.size();) {
    std::array<Eight, kChains> won, lost;
    won.fill(Eight{} + 1);
    lost.fill(Eight{} + 1);
    Eight x;
    for (std::size_t k = 0; k < kTogether && i + kChains * kEight <= sums.size(); ++k)
      for (std::size_t chain = 0; chain < kChains; ++chain, i += kEight) {
        load(&sums[i], x);
        factor(x, won[chain], lost[chain]);
      }
    if (sums.size() - i < kChains * kEight)
      for (std::size_t chain = 0; i < sums.size(); ++chain, i += kEight) {
        std::array<Real, kEight> rest;
        rest.fill(neutral);
        std::copy_n(&sums[i], std::min(kEight, sums.size() - i), rest.data());
        load(rest.data(), x);
        factor(x, won[chain], lost[chain]);
      }
    for (std::size_t chain = 0; chain < kChains; ++chain) {
      products.multiply(won[chain] > least ? won[chain] : least, 1);
      products.multiply(lost[chain] < most ? lost[chain] : most, -1);
    }
  }
  return products.log();
}

}  // namespace

std::vector<Real> bet_on(const Bet& bet, std::span<const Real> sums, int errors_per_sum) {
  std::vector<Real> logs;
  const Real shift = bet.limit * errors_per_sum;
  for (const Real rate : bet.rates) {
    const Real l = rate * bet.side;
    const Real start = -l * shift;
    if (bet.kind == Bet::Kind::betting) {
      logs.push_back(sum_of_logs(sums, shift, [=](const Eight& x, Eight& won, Eight&) {
        const Eight f = (1 + start) + l * x;
        won *= f < kMostWon ? f : Eight{} + kMostWon;
      }));
    } else {
      logs.push_back(sum_of_logs(sums, shift, [=](const Eight& x, Eight& won, Eight& lost) {
        const Eight one = Eight{} + 1, y = start + l * x, size = y < 0 ? -y : y, f = 1 + size * (1 + size / 2);
        won *= y < 0 ? one : f < kMostWon ? f : Eight{} + kMostWon;
        lost *= y < 0 ? f : one;
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
