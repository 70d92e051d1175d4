#include "harness/verdict/reliance.h"

#include <algorithm>
#include <cmath>

namespace nullmark {
namespace {

constexpr std::size_t kMostPairs = 64;
constexpr Real kScale = 1.01, kMostError = 0.005, kLargest = 10;
constexpr std::uint64_t kFirstRound = 256, kBatch = 4096;
constexpr std::uint64_t kMostSamples = std::uint64_t{1} << 24, kMostLookups = std::uint64_t{1} << 26;  // of all rays

/// A share of .05 may lie in samples that are as rare as the wrong depth moves the answer; of those seven are expected.
constexpr Real kRareSamples = 7 / 0.05;

/// One ray's samples, told the depth and told a wrong one.
struct Pair {
  const Cell& cell;
  const Scene& scene;
  const Kernel& kernel;
  std::unique_ptr<Workspace> told = kernel.workspace(), told_wrong = kernel.workspace();
  PreparedRay context{}, wrong{};
  SampleBlock values{}, wrong_values{};
  Counters counters{};
  std::uint64_t key = stream_key(cell, *scene.medium);
  Real target = 0, target_shift = 0, answer = 0;  ///< of the ray: T; what the wrong depth moves it by; T^1.01 - T

  void begin(std::size_t ray) {
    const Medium& medium = *scene.medium->medium;
    scene.context(ray, kernel, context);
    wrong = context;
    wrong.exact_depth = Spectrum(kScale * *context.exact_depth);
    kernel.begin_ray(*told, medium, scene.medium->extrema, context);
    kernel.begin_ray(*told_wrong, medium, scene.medium->extrema, wrong);
    const Spectrum& depth = *context.exact_depth;
    target = kernel.expected(*told, depth, cell.quantity).sum();
    target_shift = kernel.expected(*told_wrong, depth, cell.quantity).sum() - target;
    answer = kernel.expected(*told, *wrong.exact_depth, cell.quantity).sum() - target;
  }

  void draw(std::uint64_t first, std::uint64_t count) {
    const Medium& medium = *scene.medium->medium;
    kernel.sample(*told, medium, context, key, first_sample::kReliance + first, count, cell.quantity, values, counters);
    kernel.sample(*told_wrong, medium, wrong, key, first_sample::kReliance + first, count, cell.quantity, wrong_values, counters);
  }

  /// X' - X of a sample of the block, summed over channels, without what the target moved.
  Real difference(std::size_t sample, std::size_t outputs) const {
    Real sum = -target_shift;
    for (std::size_t o = sample * outputs; o < (sample + 1) * outputs; ++o) sum += wrong_values.values[o] - values.values[o];
    return sum;
  }
};

/// Sums of the differences of a ray.
struct Differences {
  Real sum = 0, squares = 0;
};

}  // namespace

std::optional<Real> measure_reliance(const Cell& cell, const Scene& scene, const Kernel& kernel,
                                     const std::function<bool()>& stop) {
  const bool told = cell.quantity == Quantity::transmittance || cell.quantity == Quantity::optical_depth;
  const std::size_t rays = scene.rays->world.size(), taken = std::min(rays, kMostPairs);
  if (!told || !kernel.needs_optical_depth() || taken == 0) return std::nullopt;
  Pair pair{.cell = cell, .scene = scene, .kernel = kernel};
  pair.told->stop = pair.told_wrong->stop = stop;
  std::vector<Differences> sums(taken);
  std::uint64_t drawn = 0;  // samples a ray
  for (std::uint64_t each = kFirstRound;; each *= 2) {
    Real target = 0, answer = 0, difference = 0, variance = 0;
    for (std::size_t i = 0; i < taken; ++i) {
      if (stop()) return std::nullopt;
      pair.begin(i * rays / taken);
      const std::size_t outputs = kernel.outputs(cell.quantity, pair.context);
      for (std::uint64_t done = drawn; done < each; done += kBatch) {
        const std::uint64_t count = std::min(kBatch, each - done);
        pair.draw(done, count);
        for (std::size_t sample = 0; sample < count; ++sample) {
          const Real d = pair.difference(sample, outputs);
          sums[i].sum += d;
          sums[i].squares += d * d;
        }
      }
      const auto n = static_cast<Real>(each);
      const Real mean = sums[i].sum / n;
      target += pair.target;
      answer += pair.answer;
      difference += mean;
      variance += std::max<Real>(0, sums[i].squares / n - mean * mean) / (n - 1);
    }
    drawn = each;
    if (stop() || pair.counters.overruns > 0 || !std::isnormal(answer) || !std::isfinite(difference)) return std::nullopt;
    // Samples a ray that the error and rare samples ask for.
    const Real error = variance / (kMostError * answer * kMostError * answer);
    const Real rare = kRareSamples * target / std::abs(answer) / static_cast<Real>(taken);
    // Without random numbers all samples of a ray are one.
    const Real wanted = pair.counters.draws == 0 ? 0 : std::max(error * static_cast<Real>(each), rare);
    if (wanted <= static_cast<Real>(each)) return std::clamp(std::round(difference / answer * 1e4) / 1e4, -kLargest, kLargest);
    const bool hopeless = wanted * static_cast<Real>(2 * taken) > 2 * static_cast<Real>(kMostSamples);
    if (hopeless || pair.counters.lookups >= kMostLookups || pair.counters.samples >= kMostSamples) return std::nullopt;
  }
}

}  // namespace nullmark
