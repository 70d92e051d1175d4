#pragma once

#include <cmath>
#include <numbers>
#include <string>

#include "media/base/parameters.h"
#include "media/base/types.h"

namespace nullmark {

// A phase function p, in 1/sr, has unit integral over the sphere of outgoing directions.  Directions are unit vectors along which
// light (or, p being symmetric, a path traced backwards) travels: before and after the collision, so that equal ones mean
// straight on.  Sampling is by p itself; `sample` takes two uniform numbers.

/// Two unit vectors that complete n to a right-handed frame, without a branch that a direction could fall between [Duff et al.
/// 2017, Building an orthonormal basis, revisited, Listing 3].
struct Frame {
  explicit Frame(const Vec3& n) {
    const Real sign = std::copysign(Real{1}, n.z()), a = -1 / (sign + n.z()), b = n.x() * n.y() * a;
    first = {1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x()};
    second = {b, sign + n.y() * n.y() * a, -n.y()};
  }
  Vec3 first, second;
};

/// p = 1 / (4 pi).
struct Isotropic {
  Real value(const Vec3&, const Vec3&) const { return std::numbers::inv_pi / 4; }

  Vec3 sample(const Vec3&, auto& rng) const {
    const Real u = rng.uniform(), azimuth = 2 * std::numbers::pi * rng.uniform();
    const Real sine = 2 * std::sqrt(u * (1 - u));
    return {sine * std::cos(azimuth), sine * std::sin(azimuth), 1 - 2 * u};
  }
};

/// p = (1 - g^2) / (4 pi (1 + g^2 - 2 g cos)^(3/2)), mean cosine g in (-1, 1) [Henyey and Greenstein 1941, Eq. 2].
class HenyeyGreenstein {
 public:
  /// Throws ParameterError for |g| >= 1.
  explicit HenyeyGreenstein(Real g) : g_(g) {
    if (!(std::abs(g) < 1))
      throw ParameterError("g", "found a mean cosine of " + std::to_string(g) + "; expected one between -1 and 1, both excluded");
  }

  Real mean_cosine() const { return g_; }

  /// Written with the chord between the directions: 1 + g^2 - 2 g cos = (1 - g)^2 + g |in - out|^2 has no cancellation for g
  /// near 1, and the same holds for -g and -out.
  Real value(const Vec3& in, const Vec3& out) const {
    const Real g = std::abs(g_), chord = (g_ < 0 ? Vec3(in + out) : Vec3(in - out)).squaredNorm();
    const Real square = (1 - g) * (1 - g) + g * chord;
    return std::numbers::inv_pi / 4 * (1 - g) * (1 + g) / (square * std::sqrt(square));
  }

  /// Angle to the incoming direction; 1 - cos is kept, because cos alone has lost it where the lobe is narrow.
  struct Deflection {
    Real one_minus_cosine, sine;
  };

  /// Inverts the distribution function, u in [0,1), falling from straight on (u = 0) to straight back.  The usual inverse,
  /// cos = (1 + g^2 - ((1 - g^2) / (1 + g s))^2) / (2 g) with s = 1 - 2u [Witt 1977], divides by g and cancels; factored,
  ///
  ///   1 - cos = 2 u (1 - g)^2 (1 + g (1 - u)) / (1 + g s)^2,   1 + cos = 2 (1 - u) (1 + g)^2 (1 - g u) / (1 + g s)^2
  ///
  /// are products of positive terms, accurate for every g, 0 included.
  Deflection deflection(Real u) const {
    const Real v = 1 - u;
    // 1 + g s, 1 + g v and 1 - g u as sums of positive terms, whatever the sign of g.
    const Real base = g_ < 0 ? (1 + g_) - 2 * g_ * u : (1 - g_) + 2 * g_ * v;
    const Real a = u * (g_ < 0 ? (1 + g_) - g_ * u : 1 + g_ * v), b = v * (g_ < 0 ? 1 - g_ * u : (1 - g_) + g_ * v);
    const Real forward = (1 - g_) / base, backward = (1 + g_) / base;
    return {2 * forward * forward * a, 2 * forward * backward * std::sqrt(a * b)};
  }

  Vec3 sample(const Vec3& in, auto& rng) const {
    const Deflection by = deflection(rng.uniform());
    const Real azimuth = 2 * std::numbers::pi * rng.uniform();
    const Frame frame(in);
    // Normalised, so that rounding does not add up over thousands of collisions.
    return ((1 - by.one_minus_cosine) * in + by.sine * (std::cos(azimuth) * frame.first + std::sin(azimuth) * frame.second))
        .normalized();
  }

 private:
  Real g_;
};

}  // namespace nullmark
