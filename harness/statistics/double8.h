#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "media/base/lanes.h"
#include "media/base/types.h"

namespace nullmark {

/// Eight numbers side by side, in as many registers as they take: what is summed in them has the same last digits on all
/// processors.
class Eight {
 public:
  static constexpr std::size_t kCount = 8, kWidth = std::min(kCount, kNativeLanes<Real>);
  using Part = Lanes<Real, kWidth>;

  Eight() = default;
  Eight(Real all) { parts_.fill(Part(all)); }

  static Eight load(const Real* from) {
    Eight x;
    for (std::size_t k = 0; k < kParts; ++k) x.parts_[k] = Part::load(from + k * kWidth);
    return x;
  }
  static Eight load(const std::uint32_t* from) {
    Eight x;
    for (std::size_t k = 0; k < kParts; ++k) {
      const hn::FixedTag<std::uint32_t, kWidth> narrow;
      x.parts_[k] = whole(hn::PromoteTo(Bits(), hn::LoadU(narrow, from + k * kWidth)));
    }
    return x;
  }
  /// x0 + x1, x2 + x3, ... of sixteen.
  static Eight sums_of_pairs(const Real* from) {
    Eight x;
    for (std::size_t k = 0; k < kParts; ++k) {
      const auto low = hn::LoadU(Tag(), from + 2 * k * kWidth), high = hn::LoadU(Tag(), from + (2 * k + 1) * kWidth);
      x.parts_[k] = hn::Add(hn::ConcatEven(Tag(), high, low), hn::ConcatOdd(Tag(), high, low));
    }
    return x;
  }
  void store(Real* to) const {
    for (std::size_t k = 0; k < kParts; ++k) parts_[k].store(to + k * kWidth);
  }

  friend Eight operator+(const Eight& a, const Eight& b) {
    return each([](Part x, Part y) { return x + y; }, a, b);
  }
  friend Eight operator-(const Eight& a, const Eight& b) {
    return each([](Part x, Part y) { return x - y; }, a, b);
  }
  friend Eight operator*(const Eight& a, const Eight& b) {
    return each([](Part x, Part y) { return x * y; }, a, b);
  }
  friend Eight operator/(const Eight& a, const Eight& b) {
    return each([](Part x, Part y) { return x / y; }, a, b);
  }
  Eight& operator+=(const Eight& b) { return *this = *this + b; }
  Eight& operator*=(const Eight& b) { return *this = *this * b; }

  /// b where a or b is not a number.
  friend Eight smaller(const Eight& a, const Eight& b) {
    return each([](Part x, Part y) { return smaller(x, y); }, a, b);
  }
  friend Eight larger(const Eight& a, const Eight& b) {
    return each([](Part x, Part y) { return larger(x, y); }, a, b);
  }
  friend Eight magnitude(const Eight& a) {
    return each([](Part x) { return magnitude(x); }, a);
  }
  /// a where x is below 0, and b elsewhere.
  friend Eight where_negative(const Eight& x, const Eight& a, const Eight& b) {
    return each([](Part of, Part yes, Part no) { return select(of < Part(0), yes, no); }, x, a, b);
  }

  /// floor(log2 x) and x/2^floor(log2 x), of normal positive numbers.
  friend Eight exponent(const Eight& x) {
    return each([](Part part) { return whole(hn::ShiftRight<kFraction>(hn::BitCast(Bits(), part.vector()))); }, x) - Eight(kBias);
  }
  friend Eight mantissa(const Eight& x) {
    return each(
        [](Part part) {
          const auto fraction = hn::And(hn::BitCast(Bits(), part.vector()), hn::Set(Bits(), (std::uint64_t{1} << kFraction) - 1));
          return Part(hn::BitCast(Tag(), hn::Or(fraction, hn::Set(Bits(), std::uint64_t{kBias} << kFraction))));
        },
        x);
  }

  /// The sum, each half onto the other.
  friend Real total(Eight x) {
    for (std::size_t half = kParts / 2; half > 0; half /= 2)
      for (std::size_t k = 0; k < half; ++k) x.parts_[k] += x.parts_[k + half];
    return sum_of_halves(x.parts_[0]);
  }
  friend Real least(const Eight& x) {
    return folded(x, [](Real a, Real b) { return std::min(a, b); });
  }
  friend Real most(const Eight& x) {
    return folded(x, [](Real a, Real b) { return std::max(a, b); });
  }

 private:
  using Tag = typename Part::Tag;
  using Bits = hn::FixedTag<std::uint64_t, kWidth>;
  static constexpr std::size_t kParts = kCount / kWidth;
  static constexpr int kFraction = 52, kBias = 1023;

  /// Whole numbers below 2^52: as the low bits of 2^52 + n.
  static Part whole(hn::Vec<Bits> n) {
    constexpr Real kFirst = 0x1p52;
    const Part shifted = hn::BitCast(Tag(), hn::Or(n, hn::BitCast(Bits(), hn::Set(Tag(), kFirst))));
    return shifted - Part(kFirst);
  }

  template <class Function, class... Eights>
  [[gnu::always_inline]] static Eight each(const Function& f, const Eights&... x) {
    Eight result;
    for (std::size_t k = 0; k < kParts; ++k) result.parts_[k] = f(x.parts_[k]...);
    return result;
  }

  template <class Function>
  static Real folded(const Eight& x, const Function& f) {
    std::array<Real, kCount> lanes;
    x.store(lanes.data());
    Real result = lanes[0];
    for (const Real lane : lanes) result = f(result, lane);
    return result;
  }

  std::array<Part, kParts> parts_;
};

}  // namespace nullmark
