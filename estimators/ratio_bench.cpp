#include <benchmark/benchmark.h>

#include "estimators/delta.h"
#include "estimators/ratio.h"
#include "harness/bench_kernel.h"
#include "harness/calibration.h"
#include "media/gaussian_bump.h"
#include "media/homogeneous.h"

namespace nullmark {
namespace {

// Inputs are volatile: Google Benchmark 1.7's DoNotOptimize of a double that is written corrupts it under GCC.
// Rays of length 1 at optical depth half the majorant's, so a sample takes as many lookups as the majorant says.

std::shared_ptr<const Medium> constant(Real extinction) {
  Homogeneous field;
  field.value = extinction;
  return std::make_shared<FieldMedium<Homogeneous>>(field);
}

std::shared_ptr<const Medium> gaussian(Real amplitude) {
  AlongAxis<GaussianBumpProfile> field;
  field.prepare();
  field.scale = amplitude;
  return std::make_shared<FieldMedium<AlongAxis<GaussianBumpProfile>>>(field);
}

template <class Extinction>
void plain(benchmark::State& state, Real majorant, const Extinction& extinction) {
  PlainRng rng(1);
  std::uint64_t lookups = 0;
  for ([[maybe_unused]] auto _ : state)
    for (int i = 0; i < 256; ++i) benchmark::DoNotOptimize(plain_ratio_loop(rng, majorant, extinction, lookups));
  state.counters["items"] = static_cast<double>(lookups);
}

void floor_of(benchmark::State& state) {
  PlainRng rng(1);
  volatile Real rate = 0.1;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(floor_loop(rng, rate, 4096));
  state.counters["items"] = static_cast<double>(state.iterations()) * 4096;
}

[[maybe_unused]] const bool kRegistered = [] {
  for (const Real majorant : {5., 30.}) {
    const std::string group = "ratio tracking, constant, " + std::to_string(static_cast<int>(majorant)) + " lookups a sample";
    benchmark::RegisterBenchmark((group + "/0 plain loop").c_str(), [=](benchmark::State& state) {
      volatile Real half = majorant / 2;
      const Real mu = half;
      plain(state, majorant, [&](Real) { return mu; });
    });
    benchmark::RegisterBenchmark((group + "/floor: random number, logarithm, advance").c_str(), floor_of);
    benchmark::RegisterBenchmark((group + "/nullmark, ratio").c_str(), [=](benchmark::State& state) {
      run_kernel_bench<RatioTracking>(state, constant(majorant / 2), majorant);
    });
  }
  for (const Real majorant : {10., 30.}) {
    const std::string group = "ratio tracking, Gaussian, " + std::to_string(static_cast<int>(majorant)) + " lookups a sample";
    benchmark::RegisterBenchmark((group + "/0 plain loop").c_str(), [=](benchmark::State& state) {
      volatile Real height = majorant, middle = 0.32, sigma = 0.05;
      const Real amplitude = height, centre = middle, scale = 1 / sigma;
      plain(state, majorant, [&](Real t) {
        const Real s = (t - centre) * scale;
        return amplitude * std::exp(-0.5 * s * s);
      });
    });
    benchmark::RegisterBenchmark((group + "/nullmark, ratio").c_str(), [=](benchmark::State& state) {
      run_kernel_bench<RatioTracking>(state, gaussian(majorant), majorant);
    });
  }
  return true;
}();

}  // namespace
}  // namespace nullmark
