#include <cmath>

#include "harness/registry/components.h"
#include "harness/sampling/reference_loops.h"
#include "harness/sampling/scene.h"
#include "harness/testing/bench.h"
#include "harness/testing/example_media.h"

namespace nullmark {
namespace {

// Lookups of every registered medium at its defaults, and of media made of them.

constexpr std::size_t kBlock = 256, kBlocks = 64;

/// Uniform in a box, in blocks, so many that no branch pattern is learnt by heart.
struct RandomPoints {
  explicit RandomPoints(const Box& box) {
    PlainRng rng(1);
    for (std::size_t i = 0; i < kBlock * kBlocks; ++i) {
      const Vec3 p = box.lo + Vec3(rng.uniform(), rng.uniform(), rng.uniform()).cwiseProduct(box.extent());
      x.push_back(p.x()), y.push_back(p.y()), z.push_back(p.z());
    }
  }
  Points block(std::uint64_t i) const {
    const std::size_t first = i % kBlocks * kBlock;
    return {&x[first], &y[first], &z[first], kBlock};
  }
  std::vector<Real> x, y, z;
};

template <class Lookup>
void run(benchmark::State& state, const Box& box, int channels, const Lookup& lookup) {
  const RandomPoints points(box);
  std::vector<Real> out(kBlock * static_cast<std::size_t>(channels));
  std::uint64_t blocks = 0;
  for ([[maybe_unused]] auto _ : state) {
    lookup(points.block(blocks++), out.data());
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
  }
  count_items(state, "point", blocks * kBlock);
}

void plain_gaussian(benchmark::State& state) {
  volatile Real height = 1, middle = 0.32, sigma = 0.05;
  const Real amplitude = height, centre = middle, scale = 1 / sigma;
  run(state, Box{}, 1, [&](const Points& points, Real* out) {
    for (std::size_t i = 0; i < points.size; ++i) {
      const Real s = (points.x[i] - centre) * scale;
      out[i] = amplitude * std::exp(-0.5 * s * s);
    }
  });
}

void add(const std::string& name, const std::shared_ptr<const Medium>& medium) {
  benchmark::RegisterBenchmark(("lookup in blocks of 256 points/" + name).c_str(), [=](benchmark::State& state) {
    run(state, medium->bounds(), medium->channels(), [&](const Points& points, Real* out) { medium->extinction(points, out); });
  });
}

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  benchmark::RegisterBenchmark("lookup in blocks of 256 points/0 Gaussian, hand-written", plain_gaussian);
  for (const ComponentInfo& entry : registered(ComponentKind::medium))
    add(entry.name, make_medium(example_medium(entry.name))->build());

  const auto field = [](const char* type) {
    MediumSpec spec;
    spec.field = example_medium(type);
    return spec;
  };
  const auto made_of = [&](const char* type, std::vector<const char*> parts) {
    MediumSpec spec;
    spec.field.type = type;
    for (const char* part : parts) spec.per_channel.push_back(field(part));
    return build_medium(spec).medium;
  };
  MediumSpec spectral = field("gaussian_bump");
  spectral.spectrum = {0.5, 1, 2};
  add("spectrum of 3 times gaussian_bump", build_medium(spectral).medium);
  add("channels: gaussian_bump, linear, cosine", made_of("channels", {"gaussian_bump", "linear", "cosine"}));
  add("sum: gaussian_bump, homogeneous", made_of("sum", {"gaussian_bump", "homogeneous"}));
});

}  // namespace
}  // namespace nullmark
