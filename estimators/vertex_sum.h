#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// Variance of walks of ratio tracking that add their weight times an estimate of what is left at the origin and at every
/// tentative collision.  With a = 1 - mu/mub and k(y) = exp(-int_0^y (2 mu - mu^2/mub)), E[X^2] = g(0) + int_0^d mub a^2 k g dy;
/// `second(majorant depth left, optical depth left)` is g, what a vertex of weight 1 adds.
template <class Value>
Real vertex_sum_variance(const MediumRay<Value>& ray, const RayProfile& profile, int c, const auto& second) {
  const Real tau = profile.optical_depth(c), total = ray.majorant.total_depth();
  const auto rate = [&](const RayProfile::Node& at) { return ray.majorant.rate(at.piece); };
  const auto lost = profile.running(c, [&](const RayProfile::Node& at) {
    return at.extinction > 0 ? 2 * at.extinction - at.extinction * at.extinction / rate(at) : 0;
  });
  const auto ahead = profile.running(c, rate);
  std::size_t j = 0;
  const Real rest = profile.integrate(c, [&](const RayProfile::Node& at) {
    const Real k = std::exp(-lost[j]), depth_left = total - ahead[j];
    ++j;
    if (!(rate(at) > 0)) return Real{0};
    const Real a = (rate(at) - at.extinction) / rate(at);
    return rate(at) * a * a * k * second(depth_left, tau - at.depth);
  });
  return std::max<Real>(0, second(total, tau) + rest - std::exp(-2 * tau));
}

}  // namespace nullmark
