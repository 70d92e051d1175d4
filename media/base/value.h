#pragma once

#include <concepts>
#include <type_traits>
#include <vector>

#include "media/base/elementary.h"
#include "media/base/types.h"

namespace nullmark {

// A `Value` is what one lookup returns: Real for a grey medium, a SpectrumOf some width for a chromatic one.  The functions below
// let one source serve both; a grey kernel holds no channel loop.

template <class Value>
inline constexpr bool kIsChromatic = false;
template <int width>
inline constexpr bool kIsChromatic<SpectrumOf<width>> = true;

/// Most channels of a Value.
template <class Value>
inline constexpr int kMostChannels = 1;
template <int width>
inline constexpr int kMostChannels<SpectrumOf<width>> = SpectrumOf<width>::MaxRowsAtCompileTime;

/// The Value of a medium whose number of channels the compiler knows.
template <std::size_t channels>
using OfChannels = std::conditional_t<channels == 1, Real, SpectrumOf<static_cast<int>(channels)>>;

template <class Value>
Value uniform_value(int channels, Real x) {
  if constexpr (kIsChromatic<Value>)
    return Value::Constant(channels, x);
  else
    return x;
}

template <class Value>
Value load(const Real* data, int channels) {
  if constexpr (kIsChromatic<Value>)
    return Eigen::Map<const Value>(data, channels);
  else
    return *data;
}

/// Where a Value's numbers lie.
inline Real* numbers_of(Real& value) { return &value; }
template <int width>
Real* numbers_of(SpectrumOf<width>& value) {
  return value.data();
}

inline void store(Real value, Real* data) { *data = value; }
template <int width>
void store(const SpectrumOf<width>& value, Real* data) {
  for (Eigen::Index c = 0; c < value.size(); ++c) data[c] = value[c];
}

/// Any expression of channels, and the spectrum that it comes to.
template <class T>
using Colours = Eigen::ArrayBase<T>;
template <class T>
using Evaluated = SpectrumOf<T::RowsAtCompileTime>;

inline Real largest(Real x) { return x; }
template <class T>
Real largest(const Colours<T>& x) {
  return x.maxCoeff();
}
inline Real smallest(Real x) { return x; }
template <class T>
Real smallest(const Colours<T>& x) {
  return x.minCoeff();
}
inline Real channel(const Real& x, int) { return x; }
inline Real& channel(Real& x, int) { return x; }
template <int width>
Real channel(const SpectrumOf<width>& x, int c) {
  return x[c];
}
template <int width>
Real& channel(SpectrumOf<width>& x, int c) {
  return x[c];
}
inline int channel_count(Real) { return 1; }
template <class T>
int channel_count(const Colours<T>& x) {
  return static_cast<int>(x.size());
}

inline Real channel_sum(Real x) { return x; }
/// From the first channel on, so that the sum is of the same bits at every width.
template <class T>
Real channel_sum(const Colours<T>& x) {
  Real sum = x[0];
  for (Eigen::Index c = 1; c < x.size(); ++c) sum += x[c];
  return sum;
}
inline Real average(Real x) { return x; }
template <class T>
Real average(const Colours<T>& x) {
  return channel_sum(x) / static_cast<Real>(x.size());
}
inline Real magnitude(Real x) { return std::abs(x); }
template <class T>
Evaluated<T> magnitude(const Colours<T>& x) {
  return x.abs();
}

template <class T>
Evaluated<T> exponential(const Colours<T>& x) {
  Evaluated<T> result = x;
  exponentials(result.data(), static_cast<std::size_t>(result.size()), result.data());
  return result;
}

/// f of every number, one after the other: for functions that have no form in lanes.
template <class Function>
Real one_by_one(Real x, const Function& f) {
  return f(x);
}
template <class T, class Function>
Evaluated<T> one_by_one(const Colours<T>& x, const Function& f) {
  return x.unaryExpr([&](Real number) { return f(number); });
}

template <class T>
Evaluated<T> cosine(const Colours<T>& x) {
  return one_by_one(x, [](Real number) { return cosine(number); });
}
template <class T>
Evaluated<T> one_minus_exponential(const Colours<T>& x) {
  return one_by_one(x, [](Real number) { return one_minus_exponential(number); });
}

/// sgn(x) |x|^(1/2), and what undoes it.
inline Real signed_root(Real x) { return std::copysign(std::sqrt(std::abs(x)), x); }
template <class T>
Evaluated<T> signed_root(const Colours<T>& x) {
  return x.sign() * x.abs().sqrt();
}
template <class Value>
Value signed_square(const Value& x) {
  return x * magnitude(x);
}

/// What one sample's distance, and its yes or no, are beside a Value: plain for grey and chromatic walks, and as many as there
/// are lanes for walks in lanes.h.
template <class Value>
struct Walking {
  using Distance = Real;
  using Truth = bool;
  using OneSample = Value;
};
template <class Value>
using Distance = typename Walking<Value>::Distance;
template <class Value>
using Truth = typename Walking<Value>::Truth;
/// The Value of one of its samples.
template <class Value>
using OneSample = typename Walking<Value>::OneSample;

/// f(t), which is a Value of one sample, for each sample's t.
template <class Value, class Function>
Value values_at(Real t, const Function& f) {
  return f(t);
}

/// Whether a Value is of several samples.
template <class Value>
inline constexpr bool kSideBySide = !std::is_same_v<Value, OneSample<Value>>;

/// Whether a Value's numbers are floats.
template <class Value>
inline constexpr bool kInFloat = false;

/// `a` where `yes`, else `b`.
inline Real select(bool yes, Real a, Real b) { return yes ? a : b; }
template <int width>
SpectrumOf<width> select(bool yes, const SpectrumOf<width>& a, const SpectrumOf<width>& b) {
  return yes ? a : b;
}
template <class Condition, class A, class B>
Evaluated<A> select(const Colours<Condition>& yes, const Colours<A>& a, const Colours<B>& b) {
  return yes.select(a, b);
}

template <class A, class B>
Evaluated<A> smaller(const Colours<A>& a, const Colours<B>& b) {
  return a.min(b);
}
template <class T>
Evaluated<T> smaller(const Colours<T>& x, Real most) {
  return x.min(most);
}
template <class T>
Evaluated<T> larger(const Colours<T>& x, Real least) {
  return x.max(least);
}

inline Real rounded_down(Real x) { return std::floor(x); }
/// 2^n, for whole n in [0, 127].
inline Real power_of_two(Real n) { return std::exp2(n); }

inline bool none(bool x) { return !x; }

template <class Value, std::integral Index>
const Value& entry(const std::vector<Value>& table, Index i) {
  return table[static_cast<std::size_t>(i)];
}

/// Whether every channel is 0.
inline bool vanished(Real x) { return x == 0; }
template <class T>
bool vanished(const Colours<T>& x) {
  return (x == 0).all();
}

}  // namespace nullmark
