#pragma once

#include <cstddef>

#include "media/types.h"

namespace nullmark {

/// out[i] = -log(x[i]) for 0 < x <= 1, in vector registers (Highway's Log, at most 4 ulp, exactly 0 at 1).  Every lane computes
/// the same whatever its place and whatever n, so a sample does not depend on its neighbours.  Both arrays hold a multiple of 16
/// numbers.
void negative_logarithms(const Real* x, std::size_t n, Real* out);

}  // namespace nullmark
