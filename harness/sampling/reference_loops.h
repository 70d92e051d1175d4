#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "estimators/walk/lane_rng.h"
#include "media/base/types.h"

namespace nullmark {

/// xoshiro256+ [Blackman and Vigna 2021], seeded by splitmix64: the generator of the hand-written loops that cells are compared
/// with.
class PlainRng {
 public:
  explicit PlainRng(std::uint64_t seed) {
    for (std::uint64_t& word : s_) {
      std::uint64_t z = (seed += 0x9e3779b97f4a7c15);
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
      z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
      word = z ^ (z >> 31);
    }
  }
  Real uniform() {
    const std::uint64_t result = s_[0] + s_[3], t = s_[1] << 17;
    s_[2] ^= s_[0];
    s_[3] ^= s_[1];
    s_[1] ^= s_[2];
    s_[0] ^= s_[3];
    s_[2] ^= t;
    s_[3] = std::rotl(s_[3], 45);
    return static_cast<Real>(result >> 11) * 0x1p-53;
  }

 private:
  std::uint64_t s_[4];
};

/// Random number, logarithm and advance only: the least cost of a tentative collision in scalar double.
inline Real floor_loop(PlainRng& rng, Real inverse_rate, std::uint64_t steps) {
  Real t = 0;
  for (std::uint64_t i = 0; i < steps; ++i) t -= std::log(1 - rng.uniform()) * inverse_rate;
  return t;
}

/// The same in registers of this build's width, optionally with an exponential and a second random number: the least cost of
/// `steps` tentative collisions, a multiple of the lanes.
template <class T, bool with_exponential = false, bool with_number = false>
Real lane_floor_loop(typename LaneRng<T, kNativeLanes<T>>::State& streams, Real inverse_rate, std::uint64_t steps) {
  using Pack = Lanes<T, kNativeLanes<T>>;
  LaneRng<T, kNativeLanes<T>> rng(streams, true);
  Pack t = 0, sum = 0;
  for (std::uint64_t i = 0; i < steps; i += kNativeLanes<T>) {
    t += rng.exponential() * Pack(inverse_rate);
    if constexpr (with_exponential) sum += exponential(-t);
    if constexpr (with_number) sum += rng.uniform();
  }
  T lanes[kNativeLanes<T>];
  (t + sum).store(lanes);
  return lanes[0];
}

/// Independent reads of one number from random cache lines of a buffer: the least cost of a lookup in this much memory.
inline float memory_floor_loop(const std::vector<float>& buffer, std::uint64_t& at, std::uint64_t reads) {
  constexpr std::uint64_t kLine = 64 / sizeof(float), kStep = 0x9e3779b97f4a7c15;
  const std::uint64_t lines = buffer.size() / kLine;
  float sum = 0;
  for (std::uint64_t i = 0; i < reads; ++i) {
    at += kStep;
    const std::uint64_t mixed = (at ^ (at >> 32)) * 0xd6e8feb86659fd93;
    sum += buffer[(mixed >> 32) * lines / (std::uint64_t{1} << 32) * kLine];
  }
  return sum;
}

/// Hand-written ratio tracking for one ray of length 1 and one medium; adds its lookups to `lookups`.
template <class Extinction>
Real plain_ratio_loop(PlainRng& rng, Real majorant, const Extinction& extinction, std::uint64_t& lookups) {
  const Real inverse = 1 / majorant;
  Real t = 0, weight = 1;
  for (;;) {
    t -= std::log(1 - rng.uniform()) * inverse;
    if (t >= 1) return weight;
    ++lookups;
    weight *= (majorant - extinction(t)) * inverse;
  }
}

}  // namespace nullmark
