#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "estimators/theory/march_theory.h"

namespace nullmark {

/// Nodes of an offset so close that narrow features are seen by short marches as well: so many steps at least.
inline constexpr int kFine = 64;
inline int fine_parts(Real steps) { return static_cast<int>(std::max<Real>(1, std::ceil(kFine / steps))); }

/// Whether the extinction is the same everywhere, as far as the profile has looked.
inline bool has_constant_extinction(const RayProfile& profile, int c) {
  const auto& nodes = profile.nodes(c);
  return std::all_of(nodes.begin(), nodes.end(), [&](const auto& node) { return node.extinction == nodes[0].extinction; });
}

/// mu((i + o) h) of every step i of one march after the other.
inline std::vector<Real> combs(const RayProfile& profile, int c, Real steps, const std::vector<Real>& offsets) {
  const Real h = (profile.end() - profile.begin()) / steps;
  std::vector<Real> t;
  t.reserve(offsets.size() * static_cast<std::size_t>(steps));
  for (const Real o : offsets)
    for (int i = 0; i < steps; ++i) t.push_back(profile.begin() + (i + o) * h);
  return extinction_at(profile, c, t);
}

/// Values of a random variable and their probabilities.
struct Law {
  std::vector<Real> x, w;

  Real mean() const {
    Real sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += w[i] * x[i];
    return sum;
  }
  Real variance() const {
    const Real m = mean();
    Real sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += w[i] * (x[i] - m) * (x[i] - m);
    return sum;
  }
};

/// Optical depth of a march whose steps share one offset; with the linear trend taken out where `slope` is its mu(d) - mu(0).
inline std::optional<Law> uniform_law(const RayProfile& profile, int c, Real steps, Real slope = 0) {
  const auto nodes = offset_nodes(profile, steps, fine_parts(steps));
  if (!nodes) return std::nullopt;
  const Real h = (profile.end() - profile.begin()) / steps;
  const auto k = static_cast<std::size_t>(steps);
  const std::vector<Real> mu = combs(profile, c, steps, nodes->x);
  Law law{{}, nodes->w};
  for (std::size_t i = 0; i < nodes->x.size(); ++i) {
    Real sum = 0;
    for (std::size_t j = 0; j < k; ++j) sum += mu[i * k + j];
    law.x.push_back(h * (sum + slope * (.5 - nodes->x[i])));
  }
  return law;
}

}  // namespace nullmark
