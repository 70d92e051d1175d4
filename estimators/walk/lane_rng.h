#pragma once

#include <array>

#include "estimators/walk/rng.h"
#include "media/base/lanes.h"

namespace nullmark {

/// N streams side by side: in double each is the Rng of its sample address, bit for bit; in float xoshiro128++ [Blackman and
/// Vigna 2021] with the same Philox block as its state.
template <class T, std::size_t N>
class LaneRng {
  static constexpr bool kDouble = std::is_same_v<T, double>;
  using Word = std::conditional_t<kDouble, std::uint64_t, std::uint32_t>;
  using Tag = hn::FixedTag<Word, N>;
  using Vector = hn::Vec<Tag>;
  static constexpr std::size_t kWords = kDouble ? 2 : 4;

 public:
  using Pack = Lanes<T, N>;
  using Mask = LaneMask<T, N>;
  using State = std::array<Vector, kWords>;

  /// State of the streams of N consecutive samples.
  static State seeded(const SampleAddress& first);

  /// Goes on from the state and leaves it where it has come to; draws count for the lanes that are alive.
  LaneRng(State& state, Mask alive) : LaneRng(state, alive, count(alive)) {}
  LaneRng(State& state, Mask alive, std::size_t living) : state_(state), alive_(alive), living_(living) {}

  /// Multiples of 2^-53 (2^-24 in float) in [0, 1).
  [[gnu::always_inline]] Pack uniform() {
    draws_ += living_;
    return fraction();
  }

  /// Draws count for the walks that go on.
  [[gnu::always_inline]] Pack uniform(Mask goes_on) {
    draws_ += count(goes_on & alive_);
    return fraction();
  }

  /// Unit exponentials -log(1 - u): at most 36.7 (16.6 in float).
  [[gnu::always_inline]] Pack exponential() {
    draws_ += living_;
    return negative_logarithm(rest());
  }

  /// x + exponential(), without turning the logarithm's sign on the way.
  [[gnu::always_inline]] Pack exponential_beyond(Pack x) {
    draws_ += living_;
    return x - logarithm(rest());
  }

  /// Only the lanes of the mask draw; the others' streams stay where they were.
  [[gnu::always_inline]] Pack uniform_where(Mask lanes) {
    const State before = state_;
    draws_ += count(lanes & alive_);
    const Pack u = fraction();
    for (std::size_t w = 0; w < kWords; ++w)
      state_[w] = hn::IfThenElse(hn::RebindMask(Tag(), lanes.mask()), state_[w], before[w]);
    return u;
  }
  Pack exponential(Mask lanes) { return exponential_and_decay(lanes).exponential; }

  /// exponential() and e to the minus it.
  [[gnu::always_inline]] ExponentialAndDecay<Pack> exponential_and_decay() {
    draws_ += living_;
    const Pack decay = rest();
    return {negative_logarithm(decay), decay};
  }
  [[gnu::always_inline]] ExponentialAndDecay<Pack> exponential_and_decay(Mask lanes) {
    const Pack decay = Pack(1) - uniform_where(lanes);
    return {negative_logarithm(decay), decay};
  }

  /// Takes back the count of a draw by lanes whose walk had ended: they leave with it.
  void forget(Mask lanes) { draws_ -= count(lanes & alive_); }

  std::uint64_t draws() const { return draws_; }

  const State& state() const { return state_; }
  Mask alive() const { return alive_; }
  /// After `draws` draws made elsewhere from this state on.
  void go_on(const State& state, std::uint64_t draws) {
    state_ = state;
    draws_ += draws;
  }

 private:
  /// u is the upper 53 (24) bits of an output, in units of kUnit.
  static constexpr int kBelow = kDouble ? 11 : 8;
  static constexpr T kUnit = kDouble ? T{0x1p-53} : T{0x1p-24};
  /// Before AVX-512 x86 has no instruction that makes doubles of 64-bit integers.
  static constexpr bool kInHalves = kDouble && HWY_ARCH_X86 && HWY_TARGET > HWY_AVX3;

  /// The next u.
  [[gnu::always_inline]] Pack fraction() {
    if constexpr (kInHalves) {
      const auto [high, low] = halves(output());
      return high - Pack(0x1p31 + 0.5) + low;
    } else {
      return Pack(whole(output())) * Pack(kUnit);
    }
  }

  /// 1 - u for the next u, which is exact.
  [[gnu::always_inline]] Pack rest() {
    if constexpr (kInHalves) {
      const auto [high, low] = halves(output());
      return Pack(0x1p31 + 1.5) - high - low;
    } else {
      return hn::NegMulAdd(whole(output()), Pack(kUnit).vector(), Pack(1).vector());
    }
  }

  [[gnu::always_inline]] static typename Pack::Vector whole(Vector output) {
    return hn::ConvertTo(typename Pack::Tag(), hn::BitCast(hn::RebindToSigned<Tag>(), hn::ShiftRight<kBelow>(output)));
  }

  /// u of an output as 2^31 plus its upper 21 bits and 1/2 plus its lower 32 bits: the bits become those of two doubles.
  [[gnu::always_inline]] static std::array<Pack, 2> halves(Vector output) {
    using namespace hn;
    const RepartitionToNarrow<Tag> words;
    return {BitCast(typename Pack::Tag(), Or(ShiftRight<43>(output), BitCast(Tag(), Set(typename Pack::Tag(), 0x1p31)))),
            BitCast(typename Pack::Tag(), OddEven(Set(words, 0x3FE00000), BitCast(words, ShiftRight<kBelow>(output))))};
  }

  /// The generator's next.
  [[gnu::always_inline]] Vector output() {
    using namespace hn;
    const auto rotated = []<int k>(Vector v, std::integral_constant<int, k>) {
      return RotateRight<static_cast<int>(sizeof(Word)) * 8 - k>(v);
    };
    if constexpr (kDouble) {
      const Vector a = state_[0], b = Xor(state_[1], a);
      const Vector output = Add(rotated(Add(a, state_[1]), std::integral_constant<int, 17>()), a);
      state_[0] = Xor(Xor(rotated(a, std::integral_constant<int, 49>()), b), ShiftLeft<21>(b));
      state_[1] = rotated(b, std::integral_constant<int, 28>());
      return output;
    } else {
      const Vector output = Add(rotated(Add(state_[0], state_[3]), std::integral_constant<int, 7>()), state_[0]);
      const Vector t = ShiftLeft<9>(state_[1]);
      state_[2] = Xor(state_[2], state_[0]);
      state_[3] = Xor(state_[3], state_[1]);
      state_[1] = Xor(state_[1], state_[2]);
      state_[0] = Xor(state_[0], state_[3]);
      state_[2] = Xor(state_[2], t);
      state_[3] = rotated(state_[3], std::integral_constant<int, 11>());
      return output;
    }
  }

  State& state_;
  std::uint64_t draws_ = 0;
  Mask alive_;
  std::size_t living_;
};

template <class T, std::size_t N>
typename LaneRng<T, N>::State LaneRng<T, N>::seeded(const SampleAddress& first) {
  using namespace hn;
  // Philox4x32-10 (media/base/philox.h), each of its words in the low half of a 64-bit lane; the high halves mean nothing.
  constexpr std::size_t kWide = N < kNativeLanes<double> ? N : kNativeLanes<double>;
  const FixedTag<std::uint64_t, kWide> wide;
  const auto block = [&](std::uint64_t from) {
    const auto sample = Add(Iota(wide, 0), Set(wide, from));
    auto c0 = sample, c1 = ShiftRight<32>(sample), c2 = Set(wide, first.ray), c3 = Zero(wide);
    std::uint32_t k0 = static_cast<std::uint32_t>(first.key), k1 = static_cast<std::uint32_t>(first.key >> 32);
    const RepartitionToNarrow<decltype(wide)> narrow;
    for (int round = 0; round < 10; ++round, k0 += 0x9E3779B9, k1 += 0xBB67AE85) {
      const auto a = MulEven(BitCast(narrow, c0), Set(narrow, 0xD2511F53)),
                 b = MulEven(BitCast(narrow, c2), Set(narrow, 0xCD9E8D57));
      c0 = Xor(Xor(ShiftRight<32>(b), c1), Set(wide, k0));
      c1 = b;
      c2 = Xor(Xor(ShiftRight<32>(a), c3), Set(wide, k1));
      c3 = a;
    }
    return std::array{c0, c1, c2, c3};
  };
  State state;
  const auto words = block(first.sample);
  if constexpr (kDouble) {
    const auto low = Set(wide, 0xffffffff);
    for (std::size_t w = 0; w < kWords; ++w) state[w] = Or(And(words[2 * w], low), ShiftLeft<32>(words[2 * w + 1]));
  } else if constexpr (N == kWide) {
    for (std::size_t w = 0; w < kWords; ++w) state[w] = TruncateTo(Tag(), words[w]);
  } else {
    static_assert(N == 2 * kWide);
    const auto others = block(first.sample + kWide);
    for (std::size_t w = 0; w < kWords; ++w) state[w] = ConcatEven(Tag(), BitCast(Tag(), others[w]), BitCast(Tag(), words[w]));
  }
  auto any = Zero(Tag());
  for (std::size_t w = 0; w < kWords; ++w) any = Or(any, state[w]);
  // The one state that the generator cannot leave.
  const std::size_t last = kDouble ? 1 : 3;
  state[last] = IfThenElse(Eq(any, Zero(Tag())), Set(Tag(), 1), state[last]);
  return state;
}

}  // namespace nullmark
