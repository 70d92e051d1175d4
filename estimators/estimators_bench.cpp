#include <fmt/format.h>

#include <array>

#include "harness/sampling/reference_loops.h"
#include "harness/testing/bench_kernel.h"
#include "media/base/channels.h"

namespace nullmark {
namespace {

// Every registered estimator along rays of length 1 whose majorant is the number of lookups that a ratio tracker takes.  Inputs
// of hand-written loops are volatile: Google Benchmark 1.7's DoNotOptimize of a double that is written corrupts it under GCC.

void plain_constant(benchmark::State& state, Real majorant) {
  volatile Real half = majorant / 2;
  const Real mu = half;
  const auto extinction = [&](Real) { return mu; };
  run_plain_bench(state,
                  [&](PlainRng& rng, std::uint64_t& lookups) { return plain_ratio_loop(rng, majorant, extinction, lookups); });
}

void plain_gaussian(benchmark::State& state, Real majorant) {
  volatile Real height = majorant, middle = 0.32, sigma = 0.05;
  const Real amplitude = height, centre = middle, scale = 1 / sigma;
  const auto extinction = [&](Real t) {
    const Real s = (t - centre) * scale;
    return amplitude * std::exp(-0.5 * s * s);
  };
  run_plain_bench(state,
                  [&](PlainRng& rng, std::uint64_t& lookups) { return plain_ratio_loop(rng, majorant, extinction, lookups); });
}

constexpr std::size_t kColours = 4;
constexpr std::array<Real, kColours> kSpectrum = {1, 0.8, 0.6, 0.4};

/// One walk for all channels, an array of weights.
void plain_colours(benchmark::State& state, Real majorant) {
  volatile Real half = majorant / 2;
  std::array<Real, kColours> mu;
  for (std::size_t c = 0; c < kColours; ++c) mu[c] = kSpectrum[c] * half;
  const Real inverse = 1 / majorant;
  run_plain_bench(state, [&](PlainRng& rng, std::uint64_t& lookups) {
    std::array<Real, kColours> weight = {1, 1, 1, 1};
    for (Real t = 0;; ++lookups) {
      t -= std::log(1 - rng.uniform()) * inverse;
      if (t >= 1) return weight;
      for (std::size_t c = 0; c < kColours; ++c) weight[c] *= (majorant - mu[c]) * inverse;
    }
  });
}

void floor(benchmark::State& state) {
  constexpr std::uint64_t kSteps = 4096;
  PlainRng rng(1);
  volatile Real rate = 0.1;
  std::uint64_t steps = 0;
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(floor_loop(rng, rate, kSteps));
    steps += kSteps;
  }
  count_items(state, "step", steps);
}

void add(const std::string& profile, void (*baseline)(benchmark::State&, Real), Real lookups,
         const std::shared_ptr<const Medium>& medium) {
  const std::string group = fmt::format("estimators, {}, {} lookups of ratio tracking/", profile, lookups);
  const Component majorant{"prescribed", {{"value", lookups}}, {}, {}};
  benchmark::RegisterBenchmark((group + "0 ratio tracking, hand-written").c_str(),
                               [=](benchmark::State& state) { baseline(state, lookups); });
  for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries()) {
    if (entry.planted || entry.foreign) continue;
    const auto bench = [=] { return KernelBench({entry.name, {}, {}, {}}, medium, majorant); };
    try {
      bench().draw();
    } catch (const ParameterError&) {
      continue;
    }
    benchmark::RegisterBenchmark((group + entry.name).c_str(),
                                 [=](benchmark::State& state) { run_kernel_bench(state, bench()); });
  }
}

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  benchmark::RegisterBenchmark("least step/0 random number, std::log, advance", floor);
  for (const Real lookups : {5., 30.}) {
    const auto grey = make_medium({"homogeneous", {{"extinction", lookups / 2}}, {}, {}})->build();
    add("constant", plain_constant, lookups, grey);
    add("4 channels, constant", plain_colours, lookups,
        std::make_shared<Spectral>(grey, std::vector<Real>(kSpectrum.begin(), kSpectrum.end())));
    add("Gaussian", plain_gaussian, lookups, make_medium({"gaussian_bump", {{"amplitude", lookups}}, {}, {}})->build());
  }
});

}  // namespace
}  // namespace nullmark
