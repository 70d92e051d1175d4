#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "media/types.h"

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

/// Random number, logarithm and advance, nothing else: the least a tentative collision can cost in scalar double.
inline Real floor_loop(PlainRng& rng, Real inverse_rate, std::uint64_t steps) {
  Real t = 0;
  for (std::uint64_t i = 0; i < steps; ++i) t -= std::log(1 - rng.uniform()) * inverse_rate;
  return t;
}

/// Ratio tracking as one would write it by hand for one ray of length 1 and one medium; adds its lookups to `lookups`.
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
