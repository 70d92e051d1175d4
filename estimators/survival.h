#pragma once

#include <optional>
#include <vector>

#include "estimators/ray_profile.h"

namespace nullmark {

/// P(a killed walk is still alive) at every node of the profile.  All channels of a walk compare the same random number with
/// their own extinction f(c, node), so a set S of channels lives on with probability exp(-int max_{c in S} f) and
/// inclusion-exclusion gives the union; one channel that is thinnest everywhere outlives the others and is the answer alone.
/// Nothing beyond 8 unordered channels, where the 2^n terms stop being worth it.
template <class F>
std::optional<std::vector<Real>> survival(const RayProfile& profile, F&& f) {
  const auto channels = static_cast<std::size_t>(profile.channels());
  const std::size_t count = profile.nodes(0).size();
  std::vector<std::vector<Real>> rate(channels, std::vector<Real>(count));
  for (std::size_t c = 0; c < channels; ++c)
    for (std::size_t j = 0; j < count; ++j) rate[c][j] = f(static_cast<int>(c), profile.nodes(static_cast<int>(c))[j]);

  const auto alive = [&](const std::vector<Real>& extinction) {
    std::vector<Real> result = profile.running(extinction);
    for (Real& x : result) x = std::exp(-x);
    return result;
  };
  for (std::size_t thinnest = 0; thinnest < channels; ++thinnest) {
    bool everywhere = true;
    for (std::size_t c = 0; c < channels && everywhere; ++c)
      for (std::size_t j = 0; j < count && everywhere; ++j) everywhere = rate[thinnest][j] <= rate[c][j];
    if (everywhere) return alive(rate[thinnest]);
  }
  if (channels > 8) return std::nullopt;
  std::vector<Real> sum(count, 0), maximum(count);
  for (std::size_t set = 1; set < (std::size_t{1} << channels); ++set) {
    std::fill(maximum.begin(), maximum.end(), Real{0});
    Real sign = -1;
    for (std::size_t c = 0; c < channels; ++c) {
      if (!(set >> c & 1)) continue;
      sign = -sign;
      for (std::size_t j = 0; j < count; ++j) maximum[j] = std::max(maximum[j], rate[c][j]);
    }
    const std::vector<Real> term = alive(maximum);
    for (std::size_t j = 0; j < count; ++j) sum[j] += sign * term[j];
  }
  return sum;
}

/// int rate(node) P(alive) over the ray: the expected lookups of a killed walk.
template <class F, class R>
std::optional<Real> lookups_until_killed(const RayProfile& profile, F&& extinction, R&& rate) {
  const auto alive = survival(profile, extinction);
  if (!alive) return std::nullopt;
  std::size_t j = 0;
  return profile.integrate(0, [&](const RayProfile::Node& at) { return rate(at) * (*alive)[j++]; });
}

}  // namespace nullmark
