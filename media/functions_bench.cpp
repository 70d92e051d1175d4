#include <array>
#include <cmath>

#include "harness/sampling/reference_loops.h"
#include "harness/testing/bench.h"
#include "media/base/elementary.h"
#include "media/base/value.h"

namespace nullmark {
namespace {

// Elementary functions over blocks of numbers in (0, 1], as walks need them.

constexpr std::size_t kBlock = 256;
using Block = std::array<Real, kBlock>;

template <class Function>
void run(benchmark::State& state, const Function& function) {
  PlainRng rng(1);
  Block x, out;
  for (Real& value : x) value = 1 - rng.uniform();
  std::uint64_t count = 0;
  for ([[maybe_unused]] auto _ : state) {
    function(x, out);
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
    count += kBlock;
  }
  count_items(state, "number", count);
}

/// e^-x of spectra that follow one another.
void spectra(benchmark::State& state, int channels) {
  run(state, [channels](const Block& x, Block& out) {
    const auto step = static_cast<std::size_t>(channels);
    for (std::size_t i = 0; i + step <= kBlock; i += step)
      store(exponential(Spectrum(-load<Spectrum>(&x[i], channels))), &out[i]);
  });
}

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  benchmark::RegisterBenchmark("logarithm/0 std::log", [](benchmark::State& state) {
    run(state, [](const Block& x, Block& out) {
      for (std::size_t i = 0; i < kBlock; ++i) out[i] = -std::log(x[i]);
    });
  });
  benchmark::RegisterBenchmark("logarithm/negative_logarithms", [](benchmark::State& state) {
    run(state, [](const Block& x, Block& out) { negative_logarithms(x.data(), kBlock, out.data()); });
  });
  benchmark::RegisterBenchmark("exponential/0 std::exp", [](benchmark::State& state) {
    run(state, [](const Block& x, Block& out) {
      for (std::size_t i = 0; i < kBlock; ++i) out[i] = std::exp(-x[i]);
    });
  });
  for (const int channels : {4, 16})
    benchmark::RegisterBenchmark(("exponential/spectra of " + std::to_string(channels) + " channels").c_str(),
                                 [=](benchmark::State& state) { spectra(state, channels); });
});

}  // namespace
}  // namespace nullmark
