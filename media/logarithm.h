#pragma once

#include <cstddef>

#include "media/types.h"

namespace nullmark {

/// out[i] = -log(x[i]) for finite x > 0, in vector registers (Highway's Log, at most 4 ulp, zero at 1); x and out may be the
/// same. A value depends on its own x alone, not on its place or on n.
void negative_logarithms(const Real* x, std::size_t n, Real* out);

}  // namespace nullmark
