#pragma once

#include "estimators/theory/ray_profile.h"
#include "estimators/theory/theory.h"
#include "estimators/walk/flight.h"

namespace nullmark {

/// Exact moments of MajorantGuidedRatio.  After a lookup at depth s all that follows depends on s alone, by way of a = 1 - mu/mub
/// and the rate q(s) >= `least` chosen there, so that U = E W^2 to the end and L = E N, R = E N^2 of the lookups still to come
/// obey
///
///   U(s) = e^{(q - 2)(M - s)} + int_s^M e^{(q - 2)(z - s)} a(z)^2/q U(z) dz,   q = q(s),
///   L(s) = int_s^M q e^{-q (z - s)} (1 + L(z)) dz,   R(s) = int_s^M q e^{-q (z - s)} (1 + 2 L(z) + R(z)) dz,
///
/// Volterra equations of the second kind, solved from the ray's end back by collocation at Gauss points, with cuts where q
/// reaches `least`.  The first rate is 1, or that of a lookup where the ray's rate begins.  Nothing for rays deeper than 40: its
/// cost grows with the square.
Theory guided_moments(const Rates& majorant, const RayProfile& profile, int c, Real least, bool start_looked_up);

}  // namespace nullmark
