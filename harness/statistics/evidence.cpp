#include "harness/statistics/evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "harness/statistics/double8.h"
#include "media/base/elementary.h"

namespace nullmark {
namespace {

/// Products in lanes, of any size: mantissas in [1, 2) and powers of two apart, so that logarithms are taken once at the end.
class Products {
 public:
  /// Takes x > 0, finite; by x^-1 where `sign` is -1.
  void multiply(const Eight& x, int sign) {
    exponent_ += Eight(sign) * exponent(x);
    const Eight product = sign > 0 ? mantissa_ * mantissa(x) : mantissa_ / mantissa(x);
    exponent_ += exponent(product);
    mantissa_ = mantissa(product);
  }

  /// Sum of the logarithms of all lanes.
  Real log() const {
    std::array<Real, Eight::kCount> logs;
    mantissa_.store(logs.data());
    negative_logarithms(logs.data(), logs.size(), logs.data());
    Real sum = 0;
    for (const Real negative : logs) sum -= negative;
    return sum + total(exponent_) * std::numbers::ln2_v<Real>;
  }

 private:
  Eight mantissa_ = 1, exponent_ = 0;  // exponents are whole numbers, whose sums are exact
};

constexpr std::size_t kChains = 2;  // of factors, that do not wait for each other
using Chains = std::array<Eight, kChains>;

/// Factors of any size.  More than kMostWon is not won at once, and less than nothing is nothing, or two of them would win back
/// what is lost; kTogether of them have a finite product.
struct Wild {
  static constexpr Real kMostWon = 0x1p30;
  static constexpr std::size_t kTogether = 32;
  static Eight won(const Eight& f) { return where_negative(f, 0, smaller(f, kMostWon)); }
  static void take(const Chains& factors, Products& products, int sign) {
    // A wealth that is lost for good; what this adds to its expectation is nothing.
    for (const Eight& x : factors) products.multiply(smaller(larger(x, 1e-300), 1e300), sign);
  }
};

/// Factors between 1/kMost and kMost: kTogether of them can be multiplied without a second look, and so can the chains.
struct Calm {
  static constexpr Real kMost = 16;
  static constexpr std::size_t kTogether = 64;
  static Eight won(const Eight& f) { return f; }
  static void take(const Chains& factors, Products& products, int sign) { products.multiply(factors[0] * factors[1], sign); }
};

/// One or two rates of a bet on their way.
class Wager {
 public:
  static constexpr std::size_t kRates = 2;

  /// `least` and `most` of the sums to come.
  Wager(const Bet& bet, std::span<const Real> rates, Real least, Real most)
      : kind_(bet.kind), count_(rates.size()), side_(bet.side), neutral_(bet.limit * bet.errors_per_sum) {
    for (std::size_t r = 0; r < count_; ++r) {
      rate_[r] = rates[r];
      const Real l = rate_[r] * side_;
      const auto [low, high] = std::minmax({l * (least - neutral_), l * (most - neutral_)});
      if (kind_ == Bet::Kind::betting) {
        calm_ = calm_ && 1 + low >= 1 / Calm::kMost && 1 + high <= Calm::kMost;
      } else {
        const Real size = std::max(-low, high);
        calm_ = calm_ && 1 + size * (1 + size / 2) <= Calm::kMost;
      }
    }
  }

  void place(std::span<const Real> sums) {
    if (calm_)
      count_ == 1 ? place<Calm, 1>(sums) : place<Calm, 2>(sums);
    else
      count_ == 1 ? place<Wild, 1>(sums) : place<Wild, 2>(sums);
  }

  void add_logs(std::span<Real> logs) const {
    for (std::size_t r = 0; r < count_; ++r) logs[r] += products_[r].log();
  }

 private:
  template <class Size, std::size_t count>
  void place(std::span<const Real> sums) {
    if (kind_ == Bet::Kind::betting) {
      std::array<Real, count> l, start;
      for (std::size_t r = 0; r < count; ++r) l[r] = rate_[r] * side_, start[r] = 1 - l[r] * neutral_;
      multiply<Size, count, false>(sums, [=](const Eight& x, std::size_t chain, auto& won, auto&) {
        for (std::size_t r = 0; r < count; ++r) won[r][chain] *= Size::won(Eight(start[r]) + Eight(l[r]) * x);
      });
    } else {
      std::array<Real, count> rate;
      std::copy_n(rate_.begin(), count, rate.begin());
      multiply<Size, count, true>(
          sums, [rate, side = side_, neutral = neutral_](const Eight& x, std::size_t chain, auto& won, auto& lost) {
            const Eight gain = Eight(side) * (x - neutral), size = magnitude(gain);
            for (std::size_t r = 0; r < count; ++r) {
              const Eight y = Eight(rate[r]) * size, f = Eight(1) + y * (Eight(1) + y * .5);
              won[r][chain] = where_negative(gain, won[r][chain], won[r][chain] * Size::won(f));
              lost[r][chain] = where_negative(gain, lost[r][chain] * f, lost[r][chain]);
            }
          });
    }
  }

  /// `factor` multiplies the products of what is won and lost by those of eight sums, chain by chain.
  template <class Size, std::size_t count, bool loses, class Factor>
  void multiply(std::span<const Real> sums, const Factor& factor) {
    for (std::size_t i = 0; i < sums.size();) {
      std::array<Chains, count> won, lost;
      for (std::size_t r = 0; r < count; ++r) won[r].fill(1), lost[r].fill(1);
      for (std::size_t k = 0; k < Size::kTogether && i + kChains * Eight::kCount <= sums.size(); ++k)
        for (std::size_t chain = 0; chain < kChains; ++chain, i += Eight::kCount) {
          factor(Eight::load(&sums[i]), chain, won, lost);
        }
      if (sums.size() - i < kChains * Eight::kCount)
        for (std::size_t chain = 0; i < sums.size(); ++chain, i += Eight::kCount) {
          std::array<Real, Eight::kCount> rest;
          rest.fill(neutral_);  // whose factor is 1
          std::copy_n(&sums[i], std::min(Eight::kCount, sums.size() - i), rest.data());
          factor(Eight::load(rest.data()), chain, won, lost);
        }
      for (std::size_t r = 0; r < count; ++r) {
        Size::take(won[r], products_[r], 1);
        if constexpr (loses) Size::take(lost[r], products_[r], -1);
      }
    }
  }

  Bet::Kind kind_;
  std::size_t count_;
  Real side_, neutral_;
  std::array<Real, kRates> rate_{};
  bool calm_ = true;
  std::array<Products, kRates> products_;
};

/// Least and most, infinite where not all are finite.
std::pair<Real, Real> extent(std::span<const Real> x) {
  Eight low = kInfinity, high = -kInfinity, nothing = 0;
  std::size_t i = 0;
  for (; i + Eight::kCount <= x.size(); i += Eight::kCount) {
    const Eight each = Eight::load(&x[i]);
    low = smaller(each, low);
    high = larger(each, high);
    nothing += each - each;
  }
  std::pair<Real, Real> ends(least(low), most(high));
  Real rest = total(nothing);
  for (; i < x.size(); ++i) {
    ends = {std::min(ends.first, x[i]), std::max(ends.second, x[i])};
    rest += x[i] - x[i];
  }
  return rest == 0 ? ends : std::pair(-kInfinity, kInfinity);
}

}  // namespace

void bet_on(const Bet& bet, std::span<const Real> sums, std::span<Real> logs) {
  const auto [least, most] = extent(sums);
  const std::span rates(bet.rates);
  for (std::size_t r = 0; r < rates.size(); r += Wager::kRates) {
    const std::size_t count = std::min(Wager::kRates, rates.size() - r);
    Wager wager(bet, rates.subspan(r, count), least, most);
    wager.place(sums);
    wager.add_logs(logs.subspan(r, count));
  }
}

Real log_denominator(const Bet& bet, Real rate, std::uint64_t sums) {
  if (bet.kind == Bet::Kind::betting) return 0;
  return static_cast<Real>(sums) * std::log1p(rate * rate * bet.errors_per_sum * bet.variance / 2);
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
