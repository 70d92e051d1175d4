#pragma once

#include <cmath>
#include <cstddef>

#include "media/base/types.h"

namespace nullmark {

// One function of each kind for scalars, blocks and lanes (Highway's, in double): a last digit that differs would send a walk
// another way.

/// -log x for finite x > 0, at most 4 ulp off, 0 at 1.
Real negative_logarithm(Real x);

/// e^x, at most 1 ulp off; 0 where it underflows.
Real exponential(Real x);

/// out[i] = negative_logarithm(x[i]), in vector registers; x and out may be the same.
void negative_logarithms(const Real* x, std::size_t n, Real* out);

/// out[i] = exponential(x[i]), likewise.
void exponentials(const Real* x, std::size_t n, Real* out);

/// At most 3 ulp off, for magnitudes below 39000.
Real cosine(Real x);

/// 1 - e^x without cancellation, at most 4 ulp off.
Real one_minus_exponential(Real x);

inline Real least_normal(Real) { return std::numeric_limits<Real>::min(); }

inline Real smaller(Real a, Real b) { return std::min(a, b); }
inline Real larger(Real a, Real b) { return std::max(a, b); }

}  // namespace nullmark
