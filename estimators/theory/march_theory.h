#pragma once

#include "estimators/theory/ray_profile.h"
#include "estimators/theory/theory.h"
#include "estimators/walk/quantity.h"

namespace nullmark {

// Exact mean and variance of a march of k steps on one ray, by one-dimensional quadrature over its offsets.  With m_j the mean of
// e^{s h mu} over stratum j, the stratified march has E e^{sX} = prod_j m_j(s); the uniform one is a single integral over the
// common offset.  s = -1, -2 give the moments of T; for tau itself the first two moments of h mu are used.

/// Nodes and weights of a quadrature.
struct Nodes {
  std::vector<Real> x, w;
  std::vector<std::size_t> first{};  ///< of each stratum, and behind the last
};

/// Over the distances of each of k equal strata, cut at the medium's knots; weights are lengths.
Nodes stratum_nodes(const RayProfile& profile, int steps);

/// Over the common offset, in [0, 1), of a march of k steps, cut where a lookup crosses one of the medium's knots and each piece
/// into `parts` more.  Nothing where all marches together would take more lookups than the quadrature is worth.
std::optional<Nodes> offset_nodes(const RayProfile& profile, Real steps, int parts = 1);

/// Extinction at the distances t.
std::vector<Real> extinction_at(const RayProfile& profile, int c, const std::vector<Real>& t);

Theory fixed_march(const RayProfile& profile, int c, int steps, Real offset, Quantity quantity);
Theory stratified_march(const RayProfile& profile, int c, int steps, Quantity quantity);

/// Nothing where the medium's knots cut the offset into so many pieces that the quadrature would outweigh the sampling.
Theory uniform_march(const RayProfile& profile, int c, int steps, Quantity quantity);

}  // namespace nullmark
