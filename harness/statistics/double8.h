#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include "media/base/types.h"

namespace nullmark {

/// Eight numbers side by side, whatever registers there are: what is summed in them has the same last digits on all.
using Eight [[gnu::vector_size(64)]] = Real;
inline constexpr std::size_t kEight = sizeof(Eight) / sizeof(Real);

inline void load(const Real* from, Eight& to) { std::memcpy(&to, from, sizeof to); }
inline void store(const Eight& from, Real* to) { std::memcpy(to, &from, sizeof from); }

inline Eight magnitude(const Eight& x) {
  using Bits [[gnu::vector_size(sizeof(Eight))]] = std::int64_t;
  constexpr std::int64_t kAllButSign = std::numeric_limits<std::int64_t>::max();
  return reinterpret_cast<Eight>(reinterpret_cast<Bits>(x) & kAllButSign);
}

inline Real total(const Eight& x) { return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7])); }

}  // namespace nullmark
