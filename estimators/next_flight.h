#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// Second moment of the next-flight family over local majorants, with v(y) = exp(-int_y^d mub), a = 1 - mu/mub and G = 2 v T(y,d)
/// - v^2:
///   M2 = G(0) + int_0^d mub gain(a) k G dy,
/// k(y) = T(0,y) where the walk is killed, exp(-int_0^y (2 mu - mu^2/mub)) where it carries its weight [Novák et al. 2018; the
/// integral equation of the second moment for a history-free walk].  Nothing where the panels do not resolve v.
template <class Gain, class Loss>
std::optional<Real> next_flight_variance(const Rates& majorant, const RayProfile& profile, int c, Gain&& gain, Loss&& loss) {
  if (!profile.resolved()) return std::nullopt;
  const Real tau = profile.optical_depth(c), total = majorant.total_depth();
  const auto square = [&](Real depth_left, Real tau_left) {
    const Real v = std::exp(-depth_left);
    return v * (2 * std::exp(-tau_left) - v);
  };
  const auto lost = profile.running(c, [&](const RayProfile::Node& at) { return loss(at.extinction, majorant.rate(at.piece)); });
  const auto ahead = profile.running(c, [&](const RayProfile::Node& at) { return majorant.rate(at.piece); });
  std::size_t j = 0;
  const Real rest = profile.integrate(c, [&](const RayProfile::Node& at) {
    const Real rate = majorant.rate(at.piece), k = std::exp(-lost[j]), depth_left = total - ahead[j];
    ++j;
    return rate > 0 ? rate * gain((rate - at.extinction) / rate) * k * square(depth_left, tau - at.depth) : 0;
  });
  return std::max<Real>(0, square(total, tau) + rest - std::exp(-2 * tau));
}

}  // namespace nullmark
