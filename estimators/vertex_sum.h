#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// int mub E[W^2] f dy over the vertices of ratio tracking, of weights W with E[W^2] = exp(-int_0^y (2 mu - mu^2/mub)).
/// f(a, majorant depth left, optical depth left, their difference), a = 1 - mu/mub; the difference keeps its digits, and is 0
/// where a is 0 from there on.
template <class Value>
Real integral_over_vertices(const MediumRay<Value>& ray, const RayProfile& profile, int c, const auto& f) {
  const Real tau = profile.optical_depth(c), total = ray.majorant.total_depth();
  const auto rate = [&](const RayProfile::Node& at) { return ray.majorant.rate(at.piece); };
  const auto lost = profile.running(c, [&](const RayProfile::Node& at) {
    return at.extinction > 0 ? 2 * at.extinction - at.extinction * at.extinction / rate(at) : 0;
  });
  const auto ahead = profile.running(c, rate);
  const auto null = [&](const RayProfile::Node& at) { return rate(at) - at.extinction; };
  const std::vector<Real> null_before = profile.running(c, null);
  const Real all_null = profile.integrate(c, null);
  std::size_t j = 0;
  return profile.integrate(c, [&](const RayProfile::Node& at) {
    const Real squares = std::exp(-lost[j]), depth_left = total - ahead[j], null_left = all_null - null_before[j];
    ++j;
    if (!(rate(at) > 0)) return Real{0};
    return rate(at) * squares * f((rate(at) - at.extinction) / rate(at), depth_left, tau - at.depth, null_left);
  });
}

}  // namespace nullmark
