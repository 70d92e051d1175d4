#include "harness/statistics/rank_sum.h"

#include <algorithm>
#include <cassert>
#include <cstddef>

namespace nullmark {
namespace {

constexpr std::size_t kMost = 64;

/// Pairs in which the number of `above` is the larger one.
std::size_t pairs_above(const std::vector<Real>& below, const std::vector<Real>& above) {
  std::size_t pairs = 0;
  for (const Real x : below)
    pairs += static_cast<std::size_t>(std::count_if(above.begin(), above.end(), [x](Real y) { return y > x; }));
  return pairs;
}

/// Chance of each number of such pairs, of samples of one distribution: the largest number of all is in the second sample with
/// chance m / (n + m), and is then above all n of the first.
std::vector<Real> law_of_pairs(std::size_t n, std::size_t m) {
  std::vector<std::vector<Real>> row(m + 1);  // of i numbers in the first sample, by the numbers in the second
  for (std::size_t i = 0; i <= n; ++i)
    for (std::size_t j = 0; j <= m; ++j) {
      std::vector<Real> law(i * j + 1, 0);
      if (i == 0 || j == 0) {
        law[0] = 1;
      } else {
        const auto all = static_cast<Real>(i + j);
        for (std::size_t u = 0; u < row[j].size(); ++u) law[u] += static_cast<Real>(i) / all * row[j][u];
        for (std::size_t u = 0; u < row[j - 1].size(); ++u) law[u + i] += static_cast<Real>(j) / all * row[j - 1][u];
      }
      row[j] = std::move(law);
    }
  return row[m];
}

}  // namespace

Real rank_sum_probability(const std::vector<Real>& first, const std::vector<Real>& second) {
  assert(first.size() <= kMost && second.size() <= kMost);
  if (first.empty() || second.empty() || first.size() > kMost || second.size() > kMost) return 1;
  const std::vector<Real> law = law_of_pairs(first.size(), second.size());
  // Ties count for neither side.
  const std::size_t most = std::max(pairs_above(first, second), pairs_above(second, first));
  Real tail = 0;
  for (std::size_t u = law.size(); u > most; --u) tail += law[u - 1];
  return std::min<Real>(1, 2 * tail);
}

}  // namespace nullmark
