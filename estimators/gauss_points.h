#pragma once

#include "media/types.h"

namespace nullmark {

/// Gauss-Legendre on [0,1] with the fewest points exact for a polynomial of the degree: 1 up to linear, 2 up to cubic.
inline int gauss_count(int degree) { return degree <= 1 ? 1 : 2; }
inline Real gauss_point(int degree, int i) {
  constexpr Real kOffset = 0.28867513459481288225;  // 1 / (2 sqrt 3)
  return degree <= 1 ? 0.5 : i == 0 ? 0.5 - kOffset : 0.5 + kOffset;
}
inline Real gauss_weight(int degree, int) { return degree <= 1 ? 1 : 0.5; }

}  // namespace nullmark
