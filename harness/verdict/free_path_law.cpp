#include "harness/verdict/free_path_law.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <utility>

namespace nullmark {
namespace {

constexpr std::size_t kMostLawRays = 16;
constexpr Real kFewestExpected = 20;

/// -log of the chance that chi-square is at least so large; finite however large it is.
Real surprise(Real statistic, Real degrees) {
  constexpr Real kLeast = 1e-300;
  return -std::log(std::max(kLeast, boost::math::cdf(complement(boost::math::chi_squared(degrees), statistic))));
}

/// Flights of one ray: counts per cell, the escape last; probabilities likewise.
struct Histogram {
  std::vector<std::uint64_t> count;
  std::vector<Real> probability;

  Real distance(Real n) const {
    Real seen = 0, expected = 0, largest = 0;
    for (std::size_t i = 0; i + 1 < count.size(); ++i) {
      seen += static_cast<Real>(count[i]) / n;
      expected += probability[i];
      largest = std::max(largest, std::abs(seen - expected));
    }
    return largest;
  }

  void add_chi_square(Real n, Real& statistic, Real& degrees) const {
    std::vector<std::pair<Real, Real>> cells;  // observed, expected
    bool full = true;
    for (std::size_t i = 0; i < count.size(); ++i) {
      if (full) cells.emplace_back(0, 0);
      cells.back().first += static_cast<Real>(count[i]);
      cells.back().second += n * probability[i];
      full = cells.back().second >= kFewestExpected;
    }
    if (!full && cells.size() > 1) {
      const auto [observed, expected] = cells.back();
      cells.pop_back();
      cells.back().first += observed;
      cells.back().second += expected;
    }
    for (const auto& [observed, expected] : cells)
      if (expected > 0) statistic += (observed - expected) * (observed - expected) / expected;
    degrees += static_cast<Real>(cells.size() - 1);
  }
};

}  // namespace

std::string why_no_free_path_laws(const Scene& scene, SampleRange range, const CellTheory& theory) {
  if (scene.reference->channels > 1) return "the medium is chromatic";
  if (theory.unit_weights || (range == SampleRange::binary && scene.bounding)) return "";
  return range == SampleRange::binary ? "the majorant is not known to bound" : "weights are not 1";
}

std::vector<LawRecord> free_path_laws(const Cell& cell, const Scene& scene, const Kernel& kernel, SampleRange range,
                                      const CellTheory& theory, const LawBudget& budget, const std::function<bool()>& stop) {
  const std::size_t rays = scene.rays->world.size(), taken = std::min(rays, kMostLawRays);
  if (taken == 0 || !why_no_free_path_laws(scene, range, theory).empty()) return {};
  const Real each = std::max<Real>(1, theory.lookups.value_or(1));
  const auto samples = static_cast<std::uint64_t>(std::clamp<Real>(budget.lookups / (each * static_cast<Real>(taken)), 100, 2e5));
  const std::uint64_t key = stream_key(cell, *scene.medium);
  const auto workspace = kernel.workspace();
  PreparedRay context;
  Recording recording;
  SampleBlock block;
  Counters counters;
  Real least = 0, statistic = 0, degrees = 0;
  for (std::size_t i = 0; i < taken; ++i) {
    const std::size_t ray = i * rays / taken;
    scene.context(ray, kernel, context);
    kernel.begin_ray(*workspace, *scene.medium->medium, scene.medium->extrema, context);
    Histogram histogram;
    const Real* depth = &scene.marks->depth[ray * scene.marks->per_ray];
    for (std::size_t j = 0; j < kFreePathCells; ++j)
      histogram.probability.push_back(std::exp(-depth[j]) * -std::expm1(depth[j] - depth[j + 1]));
    histogram.probability.push_back(std::exp(-depth[kFreePathCells]));
    histogram.count.assign(kFreePathCells + 1, 0);
    constexpr std::uint64_t kBatch = 4096;
    for (std::uint64_t done = 0; done < samples; done += kBatch) {
      if (stop()) return {};
      recording.restart();
      workspace->recording = &recording;
      kernel.sample(*workspace, *scene.medium->medium, context, key, first_sample::kFreePaths + done,
                    std::min(kBatch, samples - done), cell.quantity, block, counters);
      workspace->recording = nullptr;
      if (counters.overruns > 0) return {};
      for (const Recording::Walk& walk : recording.walks) {
        if (!is_collision(walk.end)) {
          ++histogram.count[kFreePathCells];
          continue;
        }
        const auto after = std::upper_bound(context.marks.begin(), context.marks.end(), walk.distance);
        ++histogram.count[static_cast<std::size_t>(
            std::clamp<std::ptrdiff_t>(after - context.marks.begin() - 1, 0, kFreePathCells - 1))];
      }
    }
    const auto n = static_cast<Real>(samples);
    const Real distance = histogram.distance(n);
    least = std::max(least, 2 * n * distance * distance - std::log(Real{2}));
    histogram.add_chi_square(n, statistic, degrees);
  }
  const auto rounded = [](Real x) { return std::round(x * 1e4) / 1e4; };
  // The most surprising of several rays, each of which could have been it.
  std::vector<LawRecord> records = {
      {"kolmogorov_smirnov", rounded(least - std::log(static_cast<Real>(taken))), samples * taken, {}}};
  if (degrees > 0) records.push_back({"chi_square", rounded(surprise(statistic, degrees)), samples * taken, {}});
  return records;
}

}  // namespace nullmark
