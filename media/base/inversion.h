#pragma once

#include <boost/math/tools/toms748_solve.hpp>

#include "media/base/medium.h"

namespace nullmark {

/// Distance t at which the optical depth of the local ray from begin is `depth`, infinite where the ray is not that deep: the
/// medium's own inverse, else the root of its closed-form depth to rounding.  NaN where the medium has neither or is chromatic.
inline Real distance_at_depth(const Medium& medium, const Ray& ray, Real depth) {
  if (medium.channels() > 1) return std::numeric_limits<Real>::quiet_NaN();
  if (const std::optional<Real> own = medium.distance_at_depth(ray, depth)) return *own;
  const auto excess = [&](Real t) {
    Ray part = ray;
    part.end = t;
    const std::optional<Spectrum> reached = medium.optical_depth(part);
    return reached ? (*reached)[0] - depth : std::numeric_limits<Real>::quiet_NaN();
  };
  const Real last = excess(ray.end);
  if (std::isnan(last)) return last;
  if (!(last > 0)) return kInfinity;
  if (!(depth > 0)) return ray.begin;
  constexpr int kBits = std::numeric_limits<Real>::digits - 2;
  std::uintmax_t steps = 200;
  const auto [a, b] = boost::math::tools::toms748_solve(excess, ray.begin, ray.end, -depth, last,
                                                        boost::math::tools::eps_tolerance<Real>(kBits), steps);
  return (a + b) / 2;
}

}  // namespace nullmark
