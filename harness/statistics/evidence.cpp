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

constexpr std::size_t kChains = 2;  // of factors, that do not wait for each other
using Chains = std::array<Eight, kChains>;

/// Factors of any size.  More than kMostWon is not won at once, and less than nothing is nothing, or two of them would win back
/// what is lost; kTogether of them have a finite product.
struct Wild {
  static constexpr Real kMostWon = 0x1p30;
  static constexpr std::size_t kTogether = 32;
  static Eight won(const Eight& f) {
    const Eight capped = f < kMostWon ? f : Eight{} + kMostWon;
    return f < 0 ? Eight{} : capped;
  }
  static void take(const Chains& factors, Products& products, int sign) {
    // A wealth that is lost for good; what this adds to its expectation is nothing.
    const Eight least = Eight{} + 1e-300, most = Eight{} + 1e300;
    for (const Eight& x : factors) {
      const Eight above = x > least ? x : least;
      products.multiply(above < most ? above : most, sign);
    }
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
        for (std::size_t r = 0; r < count; ++r) won[r][chain] *= Size::won(start[r] + l[r] * x);
      });
    } else {
      std::array<Real, count> rate;
      std::copy_n(rate_.begin(), count, rate.begin());
      multiply<Size, count, true>(
          sums, [rate, side = side_, neutral = neutral_](const Eight& x, std::size_t chain, auto& won, auto& lost) {
            const Eight gain = side * (x - neutral), size = magnitude(gain);
            for (std::size_t r = 0; r < count; ++r) {
              const Eight y = rate[r] * size, f = 1 + y * (1 + y / 2);
              won[r][chain] = gain < 0 ? won[r][chain] : won[r][chain] * Size::won(f);
              lost[r][chain] = gain < 0 ? lost[r][chain] * f : lost[r][chain];
            }
          });
    }
  }

  /// `factor` multiplies the products of what is won and lost by those of eight sums, chain by chain.
  template <class Size, std::size_t count, bool loses, class Factor>
  void multiply(std::span<const Real> sums, const Factor& factor) {
    for (std::size_t i = 0; i < sums.size();) {
      std::array<Chains, count> won, lost;
      for (std::size_t r = 0; r < count; ++r) won[r].fill(Eight{} + 1), lost[r].fill(Eight{} + 1);
      Eight x;
      for (std::size_t k = 0; k < Size::kTogether && i + kChains * kEight <= sums.size(); ++k)
        for (std::size_t chain = 0; chain < kChains; ++chain, i += kEight) {
          load(&sums[i], x);
          factor(x, chain, won, lost);
        }
      if (sums.size() - i < kChains * kEight)
        for (std::size_t chain = 0; i < sums.size(); ++chain, i += kEight) {
          std::array<Real, kEight> rest;
          rest.fill(neutral_);  // whose factor is 1
          std::copy_n(&sums[i], std::min(kEight, sums.size() - i), rest.data());
          load(rest.data(), x);
          factor(x, chain, won, lost);
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
  Eight least = Eight{} + kInfinity, most = -least, nothing{}, each;
  std::size_t i = 0;
  for (; i + kEight <= x.size(); i += kEight) {
    load(&x[i], each);
    least = each < least ? each : least;
    most = each > most ? each : most;
    nothing += each - each;
  }
  std::pair<Real, Real> ends(kInfinity, -kInfinity);
  Real rest = total(nothing);
  for (std::size_t lane = 0; lane < kEight; ++lane) ends = {std::min(ends.first, least[lane]), std::max(ends.second, most[lane])};
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
