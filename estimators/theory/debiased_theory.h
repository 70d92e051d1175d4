#pragma once

#include "estimators/theory/ray_profile.h"
#include "estimators/theory/theory.h"
#include "media/base/elementary.h"

namespace nullmark {

// Exact moments on one ray of estimators that put right what a march is off, by quadrature over the marches' offsets.

/// e^{-(E+O)/2} - (e^{-E} + e^{-O})/2 = -e^{-min} (1 - e^{-|E-O|/2})^2/2: a march of twice as many steps less the mean of the two
/// marches, of optical depths E and O, that make it up.
template <class Value>
[[gnu::always_inline]] inline Value march_difference(const Value& even, const Value& odd) {
  const Value closer = one_minus_exponential(Value(magnitude(Value(even - odd)) * -.5));
  return -exponential(Value(-smaller(even, odd))) * closer * closer * .5;
}

/// Gamma(nu + 1) (2/S)^nu J_nu(S), nu = (m - 3)/2: cos S, J_0(S), sin S/S for m = 2, 3, 4.  What makes e^{-Xbar} of m normal
/// numbers unbiased, S^2 = mean X^2 - Xbar^2 [Peters 2025].
Real jackknife_factor(int m, Real s);

/// Of Telescoping.  Levels n are summed until the squared differences of those left out, taken for a geometric series, are below
/// 10^-4 of the variance, and then added as such; what their base terms and cross terms add is known.  Nothing where levels do
/// not fall off before they take too many lookups.
std::optional<Real> telescoping_variance(const RayProfile& profile, int c, Real r);

/// Of UnbiasedRayMarching: with X iid from the comb's law, E[(sum_k a_k m_k(X_i - X_j))^2] follows from E[(X - x)(X - z)] alone
/// when pivots x and z are given, since elementary symmetric polynomials e_k, e_l of N others are the coefficients of (1 + s a +
/// t b + s t c)^N, a = E X - x, b = E X - z, c = E (X - x)(X - z).  Pivots are integrated over a Gauss rule of the law.
std::optional<Real> unbiased_march_variance(const RayProfile& profile, int c, Real steps, bool endpoint_matching);

/// Of Jackknife.  Gamma(nu + 1) (2/S)^nu J_nu(S) is the mean of e^{i w.X/sqrt(m)} over unit vectors w of sum 0 in R^m, so that
/// with phi(s) = E e^{sX} of one march the mean is that of prod_j phi(-1/m + i w_j/sqrt(m)), and the second moment that of prod_j
/// phi(-2/m + i t w_j/sqrt(m)), t the length of the sum of two such vectors.  Nothing where the depth of marches spreads by
/// several units.
Theory jackknife_march(const RayProfile& profile, int c, int m, int steps, bool stratified, bool naive);

}  // namespace nullmark
