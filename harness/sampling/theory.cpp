#include "harness/sampling/theory.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "harness/model/in_flight.h"

namespace nullmark {

RayProfile::Lookup lookups_along(const Medium& medium, const Ray& local, std::uint64_t* count) {
  return [&medium, local, count](const Real* t, std::size_t n, Real* out) {
    if (count) *count += n;
    // Tens of thousands are asked for at once: points that stay in the cache cost no fresh pages.
    constexpr std::size_t kTogether = 512;
    std::array<Real, kTogether> x, y, z;
    for (std::size_t first = 0; first < n; first += kTogether) {
      const std::size_t now = std::min(kTogether, n - first);
      for (std::size_t i = 0; i < now; ++i) {
        const Vec3 p = local.at(t[first + i]);
        x[i] = p.x(), y[i] = p.y(), z[i] = p.z();
      }
      medium.extinction({x.data(), y.data(), z.data(), now}, out + first * static_cast<std::size_t>(medium.channels()));
    }
  };
}

RayProfile make_profile(const Medium& medium, const Ray& local, const std::vector<Segment>& segments, std::uint64_t* count) {
  std::vector<Real> knots, ends, rates;
  sorted_knots(medium, local, knots);
  for (const Segment& segment : segments) {
    ends.push_back(segment.end);
    rates.push_back(segment.majorant);
  }
  return RayProfile(lookups_along(medium, local, count), medium.channels(), knots, ends, rates);
}

namespace {

/// Theory of every query along every ray.
class RayTheories {
 public:
  RayTheories(const Scene& scene, const std::vector<TheoryQuery>& queries);

  const Theory& at(std::size_t query, std::size_t ray, std::size_t channel) const {
    return all_[(ray * queries_ + query) * channels_ + channel];
  }
  std::size_t rays() const { return majorant_depth_.size(); }
  std::size_t channels() const { return channels_; }
  Real mean_work(std::size_t query) const {
    std::uint64_t sum = 0;
    for (std::size_t ray = 0; ray < rays(); ++ray) sum += work_[ray * queries_ + query];
    return static_cast<Real>(sum) / static_cast<Real>(rays());
  }
  Real mean_majorant_depth() const {
    return std::accumulate(majorant_depth_.begin(), majorant_depth_.end(), Real{0}) / static_cast<Real>(rays());
  }

 private:
  std::size_t queries_, channels_;
  std::vector<Theory> all_;
  std::vector<std::uint64_t> work_;  ///< [ray * queries + query]
  std::vector<Real> majorant_depth_;
};

RayTheories::RayTheories(const Scene& scene, const std::vector<TheoryQuery>& queries)
    : queries_(queries.size()),
      channels_(static_cast<std::size_t>(scene.reference->channels)),
      all_(scene.rays->local.size() * queries_ * channels_),
      work_(scene.rays->local.size() * queries_),
      majorant_depth_(scene.rays->local.size()) {
  struct ThreadMemory {
    std::vector<std::unique_ptr<Workspace>> workspaces;
    PreparedRay context;
  };
  tbb::enumerable_thread_specific<ThreadMemory> memory([&] {
    ThreadMemory mine;
    for (const TheoryQuery& query : queries) mine.workspaces.push_back(query.kernel->workspace());
    return mine;
  });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rays()), [&](const auto& range) {
    ThreadMemory& mine = memory.local();
    for (std::size_t ray = range.begin(); ray < range.end(); ++ray) {
      const Medium& medium = *scene.medium->medium;
      std::optional<RayProfile> profile;
      std::uint64_t count = 0, of_profile = 0;
      for (std::size_t k = 0; k < queries.size(); ++k) {
        const Kernel& kernel = *queries[k].kernel;
        std::optional<InFlight> named;
        if (queries[k].name) named.emplace(*queries[k].name);
        scene.context(ray, kernel, mine.context);
        if (!profile) {
          profile.emplace(make_profile(medium, scene.rays->local[ray], mine.context.bounds.segments(), &count));
          of_profile = count;
          for (const Segment& segment : mine.context.bounds.segments())
            majorant_depth_[ray] += segment.majorant * (segment.end - segment.begin);
        }
        kernel.begin_ray(*mine.workspaces[k], medium, scene.medium->extrema, mine.context);
        const std::uint64_t before = count;
        const std::vector<Theory> theory = kernel.theory(*mine.workspaces[k], *profile, queries[k].quantity);
        work_[ray * queries_ + k] = of_profile + count - before;
        for (std::size_t c = 0; c < channels_; ++c) all_[(ray * queries_ + k) * channels_ + c] = theory[c];
      }
    }
  });
}

bool finite(const std::optional<Real>& x) { return x && std::isfinite(*x); }

void state_lookups(CellTheory& cell, const RayTheories& theories, std::size_t k) {
  const std::size_t rays = theories.rays();
  cell.ray_lookups.resize(rays);
  cell.ray_lookups_variance.resize(rays);
  Real lookups = 0;
  bool all_lookups = true, all_spreads = true, heavy = false;
  for (std::size_t ray = 0; ray < rays; ++ray) {
    const Theory& theory = theories.at(k, ray, 0);
    all_lookups = all_lookups && finite(theory.lookups);
    heavy = heavy || (theory.lookups_variance && *theory.lookups_variance == kInfinity);
    all_spreads = all_spreads && finite(theory.lookups_variance);
    cell.most_lookups = std::max(cell.most_lookups, theory.lookups.value_or(0));
    lookups += cell.ray_lookups[ray] = theory.lookups.value_or(0);
    cell.ray_lookups_variance[ray] = theory.lookups_variance.value_or(0);
  }
  if (all_lookups) cell.lookups = lookups / static_cast<Real>(rays);
  cell.majorant_depth = theories.mean_majorant_depth();
  // Of infinite variance an expectation is told, not tested: no number of samples decides it.
  if (!all_lookups || heavy) cell.ray_lookups.clear();
  if (!all_spreads) cell.ray_lookups_variance.clear();
}

/// What the theories along the rays say of a cell, the `k`-th query, as a whole.
CellTheory theory_of_cell(const RayTheories& theories, std::size_t k, const TheoryQuery& query, const Scene& scene) {
  const std::size_t rays = theories.rays(), channels = theories.channels();
  const auto n = static_cast<Real>(rays);
  CellTheory cell;
  cell.work = theories.mean_work(k);
  const Targets& targets = *query.targets;
  const std::size_t outputs = targets.outputs;
  const bool one_per_channel = targets.names.empty();
  // Scores that are 0 or 1 have the variance of a coin; a free path's last output is its weight.
  bool coins = !one_per_channel && query.range == SampleRange::binary && scene.bounding;
  if (query.quantity == Quantity::free_path) {
    bool always_one = true;
    for (std::size_t i = 0; i < rays * channels && always_one; ++i) {
      const Theory& theory = theories.at(k, i / channels, i % channels);
      always_one = theory.variance && *theory.variance == 0;
    }
    coins = cell.unit_weights = coins || always_one;
  }
  bool all_variances = true;
  cell.ray_shift.assign(rays * outputs, 0);
  cell.ray_variance.resize(rays * outputs);
  for (std::size_t o = 0; o < outputs; ++o) {
    const bool is_weight = query.quantity == Quantity::free_path && o + channels >= outputs;
    Real variance = 0, bias = 0, squared = 0;
    bool known = true;
    for (std::size_t ray = 0; ray < rays; ++ray) {
      const Real expected = targets.mean[ray * outputs + o];
      Theory theory;
      if (one_per_channel || is_weight) theory = theories.at(k, ray, o % channels);
      if (coins) theory.variance = expected * (1 - expected);
      const Real gap = theory.mean ? *theory.mean - expected : 0;
      cell.ray_shift[ray * outputs + o] = gap;
      cell.ray_variance[ray * outputs + o] = theory.variance.value_or(0);
      known = known && finite(theory.variance);
      cell.infinite_variance = cell.infinite_variance || (theory.variance && *theory.variance == kInfinity);
      variance += theory.variance.value_or(0);
      bias += gap;
      squared += gap * gap;
    }
    all_variances = all_variances && known;
    const auto where_known = [&](Real x) { return known ? std::optional(x / n) : std::nullopt; };
    cell.variance.push_back(where_known(variance));
    cell.bias.push_back(where_known(bias));
    cell.squared_bias.push_back(where_known(squared));
  }
  if (!all_variances) cell.ray_variance.clear();
  state_lookups(cell, theories, k);
  return cell;
}

}  // namespace

std::vector<CellTheory> compute_theory(const Scene& scene, const std::vector<TheoryQuery>& queries) {
  const RayTheories theories(scene, queries);
  std::vector<CellTheory> result;
  for (std::size_t k = 0; k < queries.size(); ++k) result.push_back(theory_of_cell(theories, k, queries[k], scene));
  return result;
}

}  // namespace nullmark
