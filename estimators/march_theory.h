#pragma once

#include "estimators/estimator.h"

namespace nullmark {

// Exact mean and variance of a march of k steps on one ray, by one-dimensional quadrature over its offsets.  With m_j the mean of
// e^{s h mu} over stratum j, the stratified march has E e^{sX} = prod_j m_j(s); the uniform one is a single integral over the
// common offset.  s = -1, -2 give the moments of T; for tau itself the first two moments of h mu are used.

Theory fixed_march(const RayProfile& profile, int c, int steps, Real offset, Quantity quantity);
Theory stratified_march(const RayProfile& profile, int c, int steps, Quantity quantity);

/// Nothing where the medium's knots cut the offset into so many pieces that the quadrature would outweigh the sampling.
Theory uniform_march(const RayProfile& profile, int c, int steps, Quantity quantity);

}  // namespace nullmark
