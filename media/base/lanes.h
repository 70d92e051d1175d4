#pragma once

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "media/base/value.h"

namespace nullmark {

namespace hn = hwy::HWY_NAMESPACE;

/// Lanes of one register of this build's instruction set.
template <class T>
inline constexpr std::size_t kNativeLanes = HWY_MAX_BYTES / sizeof(T);

template <class T, std::size_t N>
class LaneMask;

/// N numbers, T float or double, that every operation treats alike: N samples of one ray side by side.  A lane's result depends
/// on that lane alone and not on N, so Lanes<T, 1> is the scalar form of the same source.  Constants are rounded to T first.
template <class T, std::size_t N>
class Lanes {
 public:
  using Tag = hn::FixedTag<T, N>;
  using Vector = hn::Vec<Tag>;

  Lanes() = default;
  Lanes(Vector vector) : vector_(vector) {}
  template <class Number>
  requires std::is_arithmetic_v<Number> Lanes(Number x) : vector_(hn::Set(Tag(), static_cast<T>(x))) {}

  static Lanes load(const T* from) { return hn::LoadU(Tag(), from); }
  void store(T* to) const { hn::StoreU(vector_, Tag(), to); }
  Vector vector() const { return vector_; }
  friend std::array<T, N> numbers(Lanes a) {
    std::array<T, N> x;
    a.store(x.data());
    return x;
  }

  friend Lanes operator+(Lanes a, Lanes b) { return hn::Add(a.vector_, b.vector_); }
  friend Lanes operator-(Lanes a, Lanes b) { return hn::Sub(a.vector_, b.vector_); }
  friend Lanes operator*(Lanes a, Lanes b) { return hn::Mul(a.vector_, b.vector_); }
  friend Lanes operator/(Lanes a, Lanes b) { return hn::Div(a.vector_, b.vector_); }
  friend Lanes operator-(Lanes a) { return hn::Neg(a.vector_); }
  Lanes& operator+=(Lanes b) { return *this = *this + b; }
  Lanes& operator*=(Lanes b) { return *this = *this * b; }

  friend LaneMask<T, N> operator<(Lanes a, Lanes b) { return hn::Lt(a.vector_, b.vector_); }
  friend LaneMask<T, N> operator>(Lanes a, Lanes b) { return b < a; }
  friend LaneMask<T, N> operator==(Lanes a, Lanes b) { return hn::Eq(a.vector_, b.vector_); }

  friend Lanes smaller(Lanes a, Lanes b) { return hn::Min(a.vector_, b.vector_); }
  friend Lanes larger(Lanes a, Lanes b) { return hn::Max(a.vector_, b.vector_); }
  friend Lanes smallest(Lanes a) { return a; }
  friend Lanes largest(Lanes a) { return a; }
  friend Lanes average(Lanes a) { return a; }
  friend Lanes channel_sum(Lanes a) { return a; }
  friend Lanes magnitude(Lanes a) { return hn::Abs(a.vector_); }
  friend Lanes signed_root(Lanes a) { return hn::CopySign(hn::Sqrt(hn::Abs(a.vector_)), a.vector_); }
  friend Lanes rounded_down(Lanes a) { return hn::Floor(a.vector_); }
  /// 2^n, for whole n in [0, 127].
  friend Lanes power_of_two(Lanes n) {
    const hn::RebindToSigned<Tag> integers;
    constexpr int kMantissa = std::is_same_v<T, float> ? 23 : 52;
    constexpr T kBias = std::is_same_v<T, float> ? 127 : 1023;
    return hn::BitCast(Tag(), hn::ShiftLeft<kMantissa>(hn::ConvertTo(integers, hn::Add(n.vector_, hn::Set(Tag(), kBias)))));
  }
  /// At most 1 ulp off.  In float what is below the least normal number is 0: steps with denormal numbers take a CPU hundreds of
  /// cycles, and the tail of a Gaussian layer would have one in most registers.
  friend Lanes exponential(Lanes a) {
    if constexpr (std::is_same_v<T, float>) {
      const Vector least = hn::Set(Tag(), -87.33654f);  // log of the least normal number
      return hn::IfThenElseZero(hn::Ge(a.vector_, least), hn::Exp(Tag(), hn::Max(a.vector_, least)));
    } else {
      return hn::Exp(Tag(), a.vector_);
    }
  }
  /// At most 4 ulp off; 0 at 1.  Of normal numbers: a random number is one.
  friend Lanes logarithm(Lanes a) {
    if constexpr (requires { hn::impl::Log<Tag, Vector, false>(Tag(), a.vector_); })
      return hn::impl::Log<Tag, Vector, false>(Tag(), a.vector_);
    else
      return hn::Log(Tag(), a.vector_);
  }
  friend Lanes negative_logarithm(Lanes a) { return -logarithm(a); }
  /// 1 - e^a, at most 4 ulp off.
  friend Lanes one_minus_exponential(Lanes a) { return -Lanes(hn::Expm1(Tag(), a.vector_)); }
  /// At most 3 ulp off, for magnitudes below 39000.
  friend Lanes cosine(Lanes a) { return hn::Cos(Tag(), a.vector_); }
  friend Lanes sine(Lanes a) { return hn::Sin(Tag(), a.vector_); }
  template <class Function>
  friend Lanes one_by_one(Lanes a, const Function& f) {
    T x[N];
    a.store(x);
    for (std::size_t k = 0; k < N; ++k) x[k] = static_cast<T>(f(static_cast<Real>(x[k])));
    return load(x);
  }
  friend T least_normal(Lanes) { return std::numeric_limits<T>::min(); }
  friend LaneMask<T, N> vanished(Lanes a) { return a == Lanes(0); }
  /// Sum of all lanes, each half onto the other: the same order at every N that starts from the same numbers.
  friend T sum_of_halves(Lanes a) {
    if constexpr (N == 1) {
      return hn::GetLane(a.vector_);
    } else {
      const hn::FixedTag<T, N / 2> half;
      return sum_of_halves(Lanes<T, N / 2>(hn::LowerHalf(half, a.vector_)) + Lanes<T, N / 2>(hn::UpperHalf(half, a.vector_)));
    }
  }

 private:
  Vector vector_;
};

/// One truth per lane, in a mask register.
template <class T, std::size_t N>
class LaneMask {
 public:
  using Tag = hn::FixedTag<T, N>;
  using Mask = hn::Mask<Tag>;

  LaneMask() = default;
  LaneMask(Mask mask) : mask_(mask) {}
  LaneMask(bool all) : LaneMask(first(all ? N : 0)) {}
  static LaneMask first(std::size_t n) { return hn::FirstN(Tag(), n); }
  Mask mask() const { return mask_; }

  friend LaneMask operator&(LaneMask a, LaneMask b) { return hn::And(a.mask_, b.mask_); }
  friend LaneMask operator|(LaneMask a, LaneMask b) { return hn::Or(a.mask_, b.mask_); }
  friend LaneMask operator!(LaneMask a) { return hn::Not(a.mask_); }
  friend std::size_t count(LaneMask a) { return hn::CountTrue(Tag(), a.mask_); }
  /// Lane k as bit k.
  friend std::uint64_t as_bits(LaneMask a) {
    std::uint64_t bits = 0;
    hn::StoreMaskBits(Tag(), a.mask_, reinterpret_cast<std::uint8_t*>(&bits));
    return bits;
  }
  friend bool none(LaneMask a) { return hn::AllFalse(Tag(), a.mask_); }
  friend Lanes<T, N> select(LaneMask yes, Lanes<T, N> a, Lanes<T, N> b) {
    return hn::IfThenElse(yes.mask_, a.vector(), b.vector());
  }

 private:
  Mask mask_;
};

/// A LaneMask as it is kept among a walk's numbers, in a register of the same layout.
template <class T, std::size_t N>
class LaneTruth {
 public:
  LaneTruth() = default;
  LaneTruth(LaneMask<T, N> mask) : bits_(hn::VecFromMask(Tag(), mask.mask())) {}
  LaneTruth(bool all) : LaneTruth(LaneMask<T, N>(all)) {}
  explicit LaneTruth(hn::Vec<hn::FixedTag<T, N>> bits) : bits_(bits) {}
  hn::Vec<hn::FixedTag<T, N>> vector() const { return bits_; }
  operator LaneMask<T, N>() const { return hn::MaskFromVec(bits_); }
  friend LaneMask<T, N> operator!(LaneTruth a) { return !LaneMask<T, N>(a); }
  friend std::uint64_t as_bits(LaneTruth a) { return as_bits(LaneMask<T, N>(a)); }
  friend Lanes<T, N> select(LaneTruth yes, Lanes<T, N> a, Lanes<T, N> b) { return select(LaneMask<T, N>(yes), a, b); }
  friend LaneTruth select(LaneMask<T, N> yes, LaneTruth a, LaneTruth b) {
    return LaneTruth(hn::IfThenElse(yes.mask(), a.bits_, b.bits_));
  }

 private:
  using Tag = hn::FixedTag<T, N>;
  hn::Vec<Tag> bits_;
};

template <std::size_t N>
inline constexpr bool kInFloat<Lanes<float, N>> = true;

template <class T, std::size_t N>
struct Walking<Lanes<T, N>> {
  using Distance = Lanes<T, N>;
  using Truth = LaneTruth<T, N>;
  using OneSample = Real;
};

/// N indices, signed and as wide as T, for tables of T.
template <class T, std::size_t N>
class LaneIndex {
 public:
  using Tag = hn::RebindToSigned<hn::FixedTag<T, N>>;
  using Vector = hn::Vec<Tag>;
  using Number = hn::TFromD<Tag>;

  LaneIndex() = default;
  LaneIndex(Vector vector) : vector_(vector) {}
  explicit LaneIndex(Number x) : vector_(hn::Set(Tag(), x)) {}
  /// Highway 1.0.3 writes an Iota number by number where it does not begin at a constant, and reads it at once, which waits.
  static LaneIndex counting_from(Number first) { return hn::Add(hn::Iota(Tag(), 0), hn::Set(Tag(), first)); }
  static LaneIndex load(const Number* from) { return hn::LoadU(Tag(), from); }
  void store(Number* to) const { hn::StoreU(vector_, Tag(), to); }
  Vector vector() const { return vector_; }

  friend LaneIndex operator+(LaneIndex a, LaneIndex b) { return hn::Add(a.vector_, b.vector_); }
  friend LaneIndex smaller(LaneIndex a, LaneIndex b) { return hn::Min(a.vector_, b.vector_); }
  friend LaneMask<T, N> operator<(LaneIndex a, LaneIndex b) {
    return hn::RebindMask(hn::FixedTag<T, N>(), hn::Lt(a.vector_, b.vector_));
  }
  friend LaneIndex select(LaneMask<T, N> yes, LaneIndex a, LaneIndex b) {
    return hn::IfThenElse(hn::RebindMask(Tag(), yes.mask()), a.vector_, b.vector_);
  }

  /// from[stride * index] per lane.
  template <int stride>
  Lanes<T, N> gathered(const T* from) const {
    const Vector at = hn::Mul(vector_, hn::Set(Tag(), stride));
    return hn::GatherIndex(hn::FixedTag<T, N>(), from, at);
  }

  friend Lanes<T, N> entry(const std::vector<Real>& table, LaneIndex at) {
    Number index[N];
    T x[N];
    at.store(index);
    for (std::size_t k = 0; k < N; ++k) x[k] = static_cast<T>(table[static_cast<std::size_t>(index[k])]);
    return Lanes<T, N>::load(x);
  }

 private:
  Vector vector_;
};

/// Per mask of 8 lanes its lanes in order, a byte each.
inline constexpr auto kLanesOfMask = [] {
  std::array<std::array<std::uint8_t, 8>, 256> all{};
  for (unsigned mask = 0; mask < 256; ++mask)
    for (unsigned lane = 0, at = 0; lane < 8; ++lane)
      if (mask >> lane & 1) all[mask][at++] = static_cast<std::uint8_t>(lane);
  return all;
}();

/// Writes `first` plus the number of each lane of a mask, in order; N numbers in all, of which those after them mean nothing.
template <class T, std::size_t N>
void store_numbers(LaneMask<T, N> lanes, std::uint32_t first, std::uint32_t* out) {
  const hn::FixedTag<std::uint32_t, N> numbers;
  if constexpr (N > 8) {
    hn::StoreU(hn::Compress(hn::Add(hn::Iota(numbers, 0), hn::Set(numbers, first)), hn::RebindMask(numbers, lanes.mask())),
               numbers, out);
  } else if constexpr (N > 1) {
    // Highway 1.0.3 copies its table of orders to the stack at every call.
    std::uint8_t bits[8];
    hn::StoreMaskBits(hn::FixedTag<T, N>(), lanes.mask(), bits);
    const auto chosen = hn::LoadU(hn::FixedTag<std::uint8_t, N>(), kLanesOfMask[bits[0]].data());
    hn::StoreU(hn::Add(hn::PromoteTo(numbers, chosen), hn::Set(numbers, first)), numbers, out);
  } else {
    *out = first;
  }
}

/// Sums of the numbers f(i, pack) over 0 <= i < n, an array of packs of the entries from i on, of as many as `pack` has: a whole
/// register, or one.
template <class T, class Function>
auto sum_in_lanes(std::size_t n, const Function& f) {
  constexpr std::size_t kWidth = kNativeLanes<T>;
  using Pack = Lanes<T, kWidth>;
  using One = Lanes<T, 1>;
  auto packs = decltype(f(std::size_t{}, Pack())){};
  constexpr std::size_t kSums = std::tuple_size_v<decltype(packs)>;
  packs.fill(Pack(0));
  std::array<T, kSums> sums{};
  const std::size_t whole = n / kWidth * kWidth;
  const auto add = [](auto& to, const auto& terms) {
    for (std::size_t k = 0; k < kSums; ++k) to[k] += terms[k];
  };
  for (std::size_t i = 0; i < whole; i += kWidth) add(packs, f(i, Pack()));
  for (std::size_t i = whole; i < n; ++i) {
    const auto terms = f(i, One());
    for (std::size_t k = 0; k < kSums; ++k) {
      T term;
      terms[k].store(&term);
      sums[k] += term;
    }
  }
  for (std::size_t k = 0; k < kSums; ++k) {
    T lanes[kWidth];
    packs[k].store(lanes);
    for (const T lane : lanes) sums[k] += lane;
  }
  return sums;
}

/// out[i] = f(x[i]), f taking Lanes and giving Lanes; x and out may be the same.
template <class T, class Function>
void map_lanes(const T* x, std::size_t n, T* out, const Function& f) {
  constexpr std::size_t kWidth = kNativeLanes<T>, kMost = 16 * kWidth;
  using Pack = Lanes<T, kWidth>;
  // What f refers to could change as results are written, so they go to memory of this call first: the compiler then keeps it in
  // registers.
  constexpr bool kDirect = std::is_empty_v<Function>;
  alignas(HWY_MAX_BYTES) T results[kMost];
  for (std::size_t done = 0; done < n; done += kMost) {
    const std::size_t left = std::min(kMost, n - done), whole = left / kWidth * kWidth;
    T* const to = kDirect ? out + done : results;
    for (std::size_t i = 0; i < whole; i += kWidth) f(Pack::load(x + done + i)).store(to + i);
    if (whole < left) {
      // The rest, filled up with its first number, which f takes as well.
      T rest[kWidth];
      for (std::size_t k = 0; k < kWidth; ++k) rest[k] = x[done + whole + (whole + k < left ? k : 0)];
      f(Pack::load(rest)).store(results + whole);
    }
    for (std::size_t i = 0; i < whole && !kDirect; i += kWidth) Pack::load(results + i).store(out + done + i);
    for (std::size_t i = whole; i < left; ++i) out[done + i] = results[i];
  }
}

}  // namespace nullmark
