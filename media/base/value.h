#pragma once

#include <concepts>
#include <vector>

#include "media/base/elementary.h"
#include "media/base/types.h"

namespace nullmark {

// A `Value` is what one lookup returns: Real for a grey medium, Spectrum for a chromatic one.  The functions below let one source
// serve both; a grey kernel holds no channel loop.

template <class Value>
Value uniform_value(int channels, Real x);
template <>
inline Real uniform_value<Real>(int, Real x) {
  return x;
}
template <>
inline Spectrum uniform_value<Spectrum>(int channels, Real x) {
  return Spectrum::Constant(channels, x);
}

template <class Value>
Value load(const Real* data, int channels);
template <>
inline Real load<Real>(const Real* data, int) {
  return *data;
}
template <>
inline Spectrum load<Spectrum>(const Real* data, int channels) {
  return Eigen::Map<const Spectrum>(data, channels);
}

inline void store(Real value, Real* data) { *data = value; }
inline void store(const Spectrum& value, Real* data) {
  for (Eigen::Index c = 0; c < value.size(); ++c) data[c] = value[c];
}

inline Real largest(Real x) { return x; }
inline Real largest(const Spectrum& x) { return x.maxCoeff(); }
inline Real smallest(Real x) { return x; }
inline Real smallest(const Spectrum& x) { return x.minCoeff(); }
inline Real channel(const Real& x, int) { return x; }
inline Real channel(const Spectrum& x, int c) { return x[c]; }
inline Real& channel(Real& x, int) { return x; }
inline Real& channel(Spectrum& x, int c) { return x[c]; }
inline int channel_count(Real) { return 1; }
inline int channel_count(const Spectrum& x) { return static_cast<int>(x.size()); }

inline Real average(Real x) { return x; }
inline Real average(const Spectrum& x) { return x.mean(); }
inline Real magnitude(Real x) { return std::abs(x); }
inline Spectrum magnitude(const Spectrum& x) { return x.abs(); }

inline Spectrum exponential(const Spectrum& x) { return x.exp(); }

/// sgn(x) |x|^(1/2), and what undoes it.
inline Real signed_root(Real x) { return std::copysign(std::sqrt(std::abs(x)), x); }
inline Spectrum signed_root(const Spectrum& x) { return x.sign() * x.abs().sqrt(); }
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
};
template <class Value>
using Distance = typename Walking<Value>::Distance;
template <class Value>
using Truth = typename Walking<Value>::Truth;

/// Whether a Value's numbers are floats.
template <class Value>
inline constexpr bool kInFloat = false;

/// `a` where `yes`, else `b`.
inline Real select(bool yes, Real a, Real b) { return yes ? a : b; }
template <class Condition>
Spectrum select(const Eigen::ArrayBase<Condition>& yes, const Spectrum& a, const Spectrum& b) {
  return yes.select(a, b);
}

inline Spectrum larger(const Spectrum& x, Real least) { return x.max(least); }

inline bool none(bool x) { return !x; }

template <class Value, std::integral Index>
const Value& entry(const std::vector<Value>& table, Index i) {
  return table[static_cast<std::size_t>(i)];
}

/// Whether every channel is 0.
inline bool vanished(Real x) { return x == 0; }
inline bool vanished(const Spectrum& x) { return (x == 0).all(); }

}  // namespace nullmark
