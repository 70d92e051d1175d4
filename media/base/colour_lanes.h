#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

#include "media/base/lanes.h"

namespace nullmark {

/// One truth per channel and lane.
template <class T, std::size_t N, std::size_t C>
struct LaneColourMask {
  std::array<LaneMask<T, N>, C> channels;
};

/// C channels of N samples of one ray side by side: to a SpectrumOf<C> what Lanes is to a Real.  Every operation does to each
/// channel what that of Lanes does; a number without channels stands for all of them.
template <class T, std::size_t N, std::size_t C>
class LaneColours {
 public:
  using Pack = Lanes<T, N>;
  using Mask = LaneColourMask<T, N, C>;
  static constexpr std::size_t kChannels = C;

  LaneColours() = default;
  LaneColours(Pack all) { channels_.fill(all); }
  template <class Number>
  requires std::is_arithmetic_v<Number> LaneColours(Number x) : LaneColours(Pack(x)) {}
  /// A spectrum that all samples share.
  template <class Derived>
  LaneColours(const Colours<Derived>& x) {
    const Evaluated<Derived> values = x;
    for (std::size_t c = 0; c < C; ++c) channels_[c] = Pack(values[static_cast<Eigen::Index>(c)]);
  }

  /// From N times C numbers, those of a sample together.
  static LaneColours load(const T* from) {
    static_assert(C == 3 || C == 4);
    using Tag = typename Pack::Tag;
    typename Pack::Vector a, b, c, d;
    LaneColours loaded;
    if constexpr (C == 3) {
      hn::LoadInterleaved3(Tag(), from, a, b, c);
      loaded.channels_ = {a, b, c};
    } else {
      hn::LoadInterleaved4(Tag(), from, a, b, c, d);
      loaded.channels_ = {a, b, c, d};
    }
    return loaded;
  }

  friend std::array<SpectrumOf<static_cast<int>(C)>, N> numbers(const LaneColours& a) {
    std::array<SpectrumOf<static_cast<int>(C)>, N> x;
    for (std::size_t c = 0; c < C; ++c) {
      const auto one = numbers(a[c]);
      for (std::size_t k = 0; k < N; ++k) x[k][static_cast<Eigen::Index>(c)] = one[k];
    }
    return x;
  }

  Pack& operator[](std::size_t c) { return channels_[c]; }
  const Pack& operator[](std::size_t c) const { return channels_[c]; }

  friend LaneColours operator+(const LaneColours& a, const LaneColours& b) {
    return each(a, b, [](Pack x, Pack y) { return x + y; });
  }
  friend LaneColours operator-(const LaneColours& a, const LaneColours& b) {
    return each(a, b, [](Pack x, Pack y) { return x - y; });
  }
  friend LaneColours operator*(const LaneColours& a, const LaneColours& b) {
    return each(a, b, [](Pack x, Pack y) { return x * y; });
  }
  friend LaneColours operator/(const LaneColours& a, const LaneColours& b) {
    return each(a, b, [](Pack x, Pack y) { return x / y; });
  }
  friend LaneColours operator-(const LaneColours& a) {
    return each(a, a, [](Pack x, Pack) { return -x; });
  }
  LaneColours& operator+=(const LaneColours& b) { return *this = *this + b; }
  LaneColours& operator*=(const LaneColours& b) { return *this = *this * b; }

  friend Mask operator>(const LaneColours& a, const LaneColours& b) {
    Mask mask;
    for (std::size_t c = 0; c < C; ++c) mask.channels[c] = a[c] > b[c];
    return mask;
  }
  friend Mask operator<(const LaneColours& a, const LaneColours& b) { return b > a; }
  friend LaneColours select(const Mask& yes, const LaneColours& a, const LaneColours& b) {
    LaneColours result;
    for (std::size_t c = 0; c < C; ++c) result[c] = select(yes.channels[c], a[c], b[c]);
    return result;
  }

  friend LaneColours select(LaneMask<T, N> yes, const LaneColours& a, const LaneColours& b) {
    return each(a, b, [&](Pack x, Pack y) { return select(yes, x, y); });
  }

  friend LaneColours smaller(const LaneColours& a, const LaneColours& b) {
    return each(a, b, [](Pack x, Pack y) { return smaller(x, y); });
  }
  friend LaneColours larger(const LaneColours& a, const LaneColours& b) {
    return each(a, b, [](Pack x, Pack y) { return larger(x, y); });
  }
  friend LaneColours magnitude(const LaneColours& a) {
    return each(a, a, [](Pack x, Pack) { return magnitude(x); });
  }
  friend LaneColours exponential(const LaneColours& a) {
    return each(a, a, [](Pack x, Pack) { return exponential(x); });
  }
  friend LaneColours one_minus_exponential(const LaneColours& a) {
    return each(a, a, [](Pack x, Pack) { return one_minus_exponential(x); });
  }
  friend LaneColours cosine(const LaneColours& a) {
    return each(a, a, [](Pack x, Pack) { return cosine(x); });
  }
  friend LaneColours signed_root(const LaneColours& a) {
    return each(a, a, [](Pack x, Pack) { return signed_root(x); });
  }
  template <class Function>
  friend LaneColours one_by_one(const LaneColours& a, const Function& f) {
    return each(a, a, [&](Pack x, Pack) { return one_by_one(x, f); });
  }
  friend Pack largest(const LaneColours& a) {
    Pack most = a[0];
    for (std::size_t c = 1; c < C; ++c) most = larger(most, a[c]);
    return most;
  }
  friend Pack channel_sum(const LaneColours& a) {
    Pack sum = a[0];
    for (std::size_t c = 1; c < C; ++c) sum += a[c];
    return sum;
  }
  friend Pack average(const LaneColours& a) { return channel_sum(a) / Pack(C); }
  friend Pack smallest(const LaneColours& a) {
    Pack least = a[0];
    for (std::size_t c = 1; c < C; ++c) least = smaller(least, a[c]);
    return least;
  }
  friend LaneMask<T, N> vanished(const LaneColours& a) {
    LaneMask<T, N> all = vanished(a[0]);
    for (std::size_t c = 1; c < C; ++c) all = all & vanished(a[c]);
    return all;
  }

 private:
  template <class Function>
  [[gnu::always_inline]] static LaneColours each(const LaneColours& a, const LaneColours& b, const Function& f) {
    LaneColours result;
    for (std::size_t c = 0; c < C; ++c) result[c] = f(a[c], b[c]);
    return result;
  }

  std::array<Pack, C> channels_;
};

template <class T, std::size_t N>
Lanes<T, N> channel(Lanes<T, N> x, std::size_t) {
  return x;
}
template <class T, std::size_t N, std::size_t C>
Lanes<T, N> channel(const LaneColours<T, N, C>& x, std::size_t c) {
  return x[c];
}
template <class T, std::size_t N>
int channel_count(const Lanes<T, N>&) {
  return 1;
}
template <class T, std::size_t N, std::size_t C>
int channel_count(const LaneColours<T, N, C>&) {
  return static_cast<int>(C);
}

template <std::size_t N, std::size_t C>
inline constexpr bool kInFloat<LaneColours<float, N, C>> = true;

template <class T, std::size_t N, std::size_t C>
struct Walking<LaneColours<T, N, C>> {
  using Distance = Lanes<T, N>;
  using Truth = LaneTruth<T, N>;
  using OneSample = SpectrumOf<static_cast<int>(C)>;
};

template <class Value, class T, std::size_t N, class Function>
Value values_at(const Lanes<T, N>& t, const Function& f) {
  if constexpr (requires { Value::kChannels; }) {
    T values[Value::kChannels][N];
    for (std::size_t k = 0; const T x : numbers(t)) {
      const auto one = f(static_cast<Real>(x));
      for (std::size_t c = 0; c < Value::kChannels; ++c) values[c][k] = static_cast<T>(one[static_cast<Eigen::Index>(c)]);
      ++k;
    }
    Value result;
    for (std::size_t c = 0; c < Value::kChannels; ++c) result[c] = Lanes<T, N>::load(values[c]);
    return result;
  } else {
    return one_by_one(t, f);
  }
}

/// table[index] per lane.
template <class T, std::size_t N, int C>
LaneColours<T, N, static_cast<std::size_t>(C)> entry(const std::vector<SpectrumOf<C>>& table, LaneIndex<T, N> at) {
  typename LaneIndex<T, N>::Number index[N];
  at.store(index);
  LaneColours<T, N, static_cast<std::size_t>(C)> result;
  for (int c = 0; c < C; ++c) {
    T x[N];
    for (std::size_t k = 0; k < N; ++k) x[k] = static_cast<T>(table[static_cast<std::size_t>(index[k])][c]);
    result[static_cast<std::size_t>(c)] = Lanes<T, N>::load(x);
  }
  return result;
}

/// The value of N walks over a medium of C channels.
template <class T, std::size_t N, std::size_t C>
using LaneValue = std::conditional_t<C == 1, Lanes<T, N>, LaneColours<T, N, C>>;

}  // namespace nullmark
