#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "harness/sampling/reference_loops.h"
#include "harness/sampling/scene.h"
#include "harness/sampling/targets.h"
#include "harness/sampling/test_plan.h"
#include "harness/sampling/theory.h"

/// Laws known exactly, and the program's plan for samples of them.
namespace nullmark::false_alarms_test {

/// A law on finitely many values, drawn in constant time [Walker 1977, Vose 1991]; or a Pareto law.
class Law {
 public:
  explicit Law(std::map<Real, long double> law) : law_(std::move(law)) {
    long double total = 0, mean = 0, square = 0;
    for (const auto& [value, chance] : law_) total += chance;
    for (auto& [value, chance] : law_) mean += (chance /= total) * value;
    for (const auto& [value, chance] : law_) square += chance * (value - mean) * (value - mean);
    mean_ = static_cast<Real>(mean);
    variance_ = static_cast<Real>(square);

    std::vector<long double> share;
    std::vector<std::size_t> poor, rich;
    for (const auto& [value, chance] : law_) {
      share.push_back(chance * static_cast<long double>(law_.size()));
      (share.back() < 1 ? poor : rich).push_back(table_.size());
      table_.push_back({1, {value, value}});
    }
    while (!poor.empty() && !rich.empty()) {
      const std::size_t i = poor.back(), j = rich.back();
      poor.pop_back();
      table_[i].keep = static_cast<Real>(share[i]);
      table_[i].values[1] = table_[j].values[0];
      share[j] -= 1 - share[i];
      if (share[j] < 1) {
        rich.pop_back();
        poor.push_back(j);
      }
    }
  }

  /// Density a x^{-a-1} on x >= 1.
  static Law pareto(Real index) {
    Law law({{Real{0}, 1}});
    law.index_ = index;
    law.mean_ = index / (index - 1);
    law.variance_ = index / ((index - 1) * (index - 1) * (index - 2));
    return law;
  }

  Real mean() const { return mean_; }
  Real variance() const { return variance_; }
  Real relative_variance() const { return variance_ / (mean_ * mean_); }
  std::size_t size() const { return table_.size(); }

  Real draw(PlainRng& rng) const {
    const Real u = rng.uniform();
    if (index_ > 0) return std::pow(1 - u, -1 / index_);
    const Real x = u * static_cast<Real>(table_.size());
    const auto i = static_cast<std::size_t>(x);
    const Entry& entry = table_[i];
    // By an index: a branch would be mispredicted half of the time.
    return entry.values[x - static_cast<Real>(i) >= entry.keep];
  }

  /// The law of the sum of two independent draws.
  Law doubled() const {
    // On a grid, so that sums in another order are the same value.
    constexpr Real kGrid = 0x1p40;
    std::map<Real, long double> sums;
    for (const auto& [a, chance_a] : law_)
      for (const auto& [b, chance_b] : law_) sums[std::round((a + b) * kGrid) / kGrid] += chance_a * chance_b;
    return Law(std::move(sums));
  }

 private:
  struct Entry {
    Real keep;
    std::array<Real, 2> values;
  };
  std::map<Real, long double> law_;
  std::vector<Entry> table_;
  Real mean_ = 0, variance_ = 0, index_ = 0;
};

inline Law coin(Real chance) { return Law({{0, 1 - static_cast<long double>(chance)}, {1, chance}}); }

/// scale factor^N, N of a Poisson law: weights of ratio, weighted and residual tracking in a slab.  Values below `resolution` are
/// replaced by their mean.
inline Law product(Real scale, Real factor, Real collisions, Real resolution = 0) {
  std::map<Real, long double> law;
  long double chance = std::exp(-static_cast<long double>(collisions)), value = scale, small = 0, small_mean = 0;
  for (int n = 0; n < 150; ++n) {
    if (std::abs(value) >= static_cast<long double>(resolution)) {
      law[static_cast<Real>(value)] += chance;
    } else {
      small += chance;
      small_mean += chance * value;
    }
    chance *= static_cast<long double>(collisions) / (n + 1);
    value *= factor;
  }
  if (small > 0) law[static_cast<Real>(small_mean / small)] += small;
  return Law(law);
}

inline Law ratio(Real depth, Real resolution = 0) { return product(1, 0.2, 1.25 * depth, resolution); }

/// What a cell of such samples is judged by: the program's own plan, of a scene of which only the number of rays is real.
struct Subject {
  std::vector<Law> rays;
  SampleRange range = SampleRange::unit;
  std::optional<Real> epsilon{};
  std::vector<Real> claimed{};  ///< means; empty: the right ones
  bool lookups = false;         ///< the samples are counts of lookups
  Real spread = 0;  ///< if positive: samples are uniform within the mean times 1 +- this, and theory states no variance
};

inline TestPlan test_plan_of(const Subject& subject, std::uint64_t samples_per_ray, const std::optional<Pilot>& pilot = {}) {
  const std::size_t rays = subject.rays.size();
  Scene scene;
  auto built = std::make_shared<BuiltRays>();
  built->world.resize(rays);
  scene.rays = built;
  Cell cell;
  cell.samples_per_ray = samples_per_ray;
  cell.verdict.epsilon = subject.epsilon;
  cell.verdict.max_samples_per_ray = std::uint64_t{1} << 40;
  CellTheory theory;
  Targets targets;
  for (std::size_t ray = 0; ray < rays; ++ray) {
    const Law& law = subject.rays[ray];
    const Real mean = subject.claimed.empty() ? law.mean() : subject.claimed[ray];
    targets.mean.push_back(subject.lookups ? 0.5 : mean);
    targets.error.push_back(targets.mean.back() * 1e-12);
    theory.ray_shift.push_back(0);
    if (!pilot) theory.ray_variance.push_back(subject.spread > 0 ? 0 : subject.lookups ? 0.25 : law.variance());
    if (!subject.lookups) continue;
    theory.ray_lookups.push_back(law.mean());
    theory.ray_lookups_variance.push_back(law.variance());
  }
  TestPlan test_plan = plan_tests(cell, scene, targets, subject.range, Guarantee::unbiased, theory, pilot, {});
  if (subject.lookups) std::erase_if(test_plan.tests, [](const MeanTest& test) { return test.channel != MeanTest::kLookups; });
  return test_plan;
}

}  // namespace nullmark::false_alarms_test
