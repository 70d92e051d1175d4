#include "harness/statistics/ks_bound.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace nullmark {

Real uniformity(std::span<const Real> u) {
  if (u.empty()) return -kInfinity;
  const auto n = static_cast<Real>(u.size());
  constexpr std::size_t kTogether = 16;
  const std::size_t buckets = 1 + u.size() / kTogether;
  const auto width = 1 / static_cast<Real>(buckets);
  const auto bucket_of = [&](Real x) {
    const Real at = x * static_cast<Real>(buckets);
    return at > 0 ? static_cast<std::size_t>(std::min(at, static_cast<Real>(buckets - 1))) : 0;
  };
  std::vector<std::size_t> below(buckets + 1);
  for (const Real x : u) ++below[bucket_of(x) + 1];
  std::partial_sum(below.begin(), below.end(), below.begin());

  const auto share = [&](std::size_t k) { return static_cast<Real>(below[k]) / n; };
  const auto edge = [&](std::size_t k) { return static_cast<Real>(k) * width; };
  Real least = 0;  // that D is: what is seen at the buckets' edges
  for (std::size_t k = 0; k < buckets; ++k) least = std::max(least, std::abs(share(k) - edge(k)));
  std::vector<bool> holds(buckets);  // D, perhaps; the outer ones also take what lies outside [0, 1]
  constexpr Real kRounding = 1e-12;
  for (std::size_t k = 0; k < buckets; ++k)
    holds[k] = k == 0 || k + 1 == buckets || std::max(edge(k + 1) - share(k), share(k + 1) - edge(k)) >= least - kRounding;
  std::vector<Real> candidates;
  for (const Real x : u)
    if (holds[bucket_of(x)]) candidates.push_back(x);
  std::sort(candidates.begin(), candidates.end());
  Real distance = 0;
  std::size_t bucket = buckets, rank = 0;
  for (const Real x : candidates) {
    if (bucket_of(x) != bucket) rank = below[bucket = bucket_of(x)];
    const auto before = static_cast<Real>(rank++);
    distance = std::max({distance, x - before / n, (before + 1) / n - x});
  }
  return 2 * n * distance * distance - std::log(Real{2});
}

}  // namespace nullmark
