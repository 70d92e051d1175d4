#pragma once

#include <optional>
#include <vector>

#include "estimators/theory/ray_profile.h"
#include "estimators/theory/theory.h"

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

/// Moments of the lookups N of a walk, from three functions at the nodes of the profile: the rate at which it looks up while it
/// is alive, the part of it that leaves it alive, and its chance to be alive: E N = int rate alive, E N(N-1) = 2 int rate(y)
/// alive(y) int_0^y through dx dy.  Not stated where the profile is too coarse for the boundary layer that `alive` is.
inline void state_lookups(Theory& theory, const RayProfile& profile, const std::vector<Real>& rate,
                          const std::vector<Real>& through, const std::vector<Real>& alive) {
  if (!profile.resolved()) return;
  const auto integral = [&](const std::vector<Real>& values) {
    std::size_t j = 0;
    return profile.integrate(0, [&](const RayProfile::Node&) { return values[j++]; });
  };
  const std::vector<Real> before = profile.running(through);
  std::vector<Real> first(rate.size()), pairs(rate.size());
  for (std::size_t i = 0; i < rate.size(); ++i) {
    first[i] = rate[i] * alive[i];
    pairs[i] = 2 * first[i] * before[i];
  }
  const Real mean = integral(first);
  theory.lookups = mean;
  theory.lookups_variance = std::max<Real>(0, integral(pairs) + mean - mean * mean);
}

/// Theory of an escape weight X of mean T, from functions at the nodes of the profile: the rates of lookups and of surviving
/// ones, the rate `death` at which walks end, and the growth of E[X^2; alive] a length: Var = T^2 (exp(int growth + 2 mu) - 1).
inline Theory theory_of_escape_weight(const RayProfile& profile, int c, const std::vector<Real>& rate,
                                      const std::vector<Real>& through, const std::vector<Real>& death,
                                      const std::vector<Real>& growth) {
  std::vector<Real> alive = profile.running(death);
  for (Real& x : alive) x = std::exp(-x);
  const Real depth = profile.optical_depth(c);
  std::size_t j = 0;
  const Real second = profile.integrate(c, [&](const RayProfile::Node&) { return growth[j++]; });
  Theory theory{.variance = product_variance(-depth, second + 2 * depth)};
  state_lookups(theory, profile, rate, through, alive);
  return theory;
}

/// Of the lookups alone, where a walk collides at `rate` and dies at `extinction` <= rate; their mean where channels share it.
template <class F, class R>
void state_lookups_until_killed(Theory& theory, const RayProfile& profile, F&& extinction, R&& rate) {
  const auto alive = survival(profile, extinction);
  if (!alive) return;
  std::vector<Real> rates, through;
  for (const RayProfile::Node& at : profile.nodes(0)) {
    rates.push_back(rate(at));
    through.push_back(rate(at) - extinction(0, at));
  }
  state_lookups(theory, profile, rates, through, *alive);
  if (profile.channels() > 1) theory.lookups_variance.reset();
}

/// Variance of the weight w with which a flight ends, E[w] = 1, from two functions at the nodes of the profile: the rate at which
/// E[w^2; still flying] = K grows, and the rate of collisions times their w^2 over K.  E[w^2] = int collisions K dx + K(end).
inline Real weight_variance(const RayProfile& profile, int c, const std::vector<Real>& growth,
                            const std::vector<Real>& collisions) {
  const std::vector<Real> before = profile.running(growth);
  std::size_t j = 0;
  Real total = 0;
  const Real ended = profile.integrate(c, [&](const RayProfile::Node& at) {
    const std::size_t i = j++;
    total += at.weight * growth[i];
    return collisions[i] * std::exp(before[i]);
  });
  constexpr Real kRounding = 1e-12;
  const Real variance = ended + std::exp(total) - 1;
  return variance > kRounding ? variance : 0;
}

}  // namespace nullmark
