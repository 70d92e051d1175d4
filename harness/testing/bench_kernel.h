#pragma once

#include <memory>
#include <string>
#include <utility>

#include "harness/registry/components.h"
#include "harness/sampling/reference_loops.h"
#include "harness/sampling/scene.h"
#include "harness/testing/bench.h"

namespace nullmark {

/// A registered estimator's kernel over one ray, prepared as the harness prepares it.
class KernelBench {
 public:
  /// Throws ParameterError where estimator, medium and majorant do not fit each other.
  KernelBench(const Component& estimator, std::shared_ptr<const Medium> medium, const Component& majorant,
              const Ray& world = {{0, 0.5, 0.5}, {1, 0, 0}, 0, 1}, Precision precision = Precision::float64, bool lanes = true)
      : medium_(std::move(medium)), extrema_(medium_->extrema(medium_->bounds())) {
    const auto source = make_estimator(estimator);
    source->check(extrema_);
    kernel_ = source->kernel(medium_->channels(), precision, lanes);
    if (!kernel_) throw ParameterError("", "no form in this precision");
    workspace_ = kernel_->workspace();
    const Ray local = clipped(transformed(world, medium_->world_to_local()), medium_->bounds());
    if (kernel_->needs_knots() && !medium_->polynomial_degree())
      throw ParameterError("", "no exact traversal: the medium is not polynomial between knots");
    if (kernel_->needs_optical_depth() && !medium_->optical_depth(local))
      throw ParameterError("", "the medium has no closed-form optical depth");
    scene_.rays = std::make_shared<BuiltRays>(BuiltRays{{Ray{world.origin, world.direction, local.begin, local.end}}, {local}});
    scene_.medium = std::make_shared<BuiltMedium>(BuiltMedium{medium_, extrema_, {}, {}});
    scene_.majorant = std::make_shared<BuiltMajorant>(BuiltMajorant{make_majorant(majorant)->build(medium_)});
  }

  /// Samples of new addresses, which share the ray's preparation and one traversal of the majorant.  A cell that is judged draws
  /// thousands of a ray.
  void draw() {
    scene_.context(0, *kernel_, context_);
    kernel_->begin_ray(*workspace_, *medium_, extrema_, context_);
    kernel_->sample(*workspace_, *medium_, context_, 1, counters_.samples, 1024, Quantity::transmittance, block_, counters_);
    benchmark::DoNotOptimize(block_.values.data());
    benchmark::ClobberMemory();
  }

  const Counters& counters() const { return counters_; }

 private:
  std::shared_ptr<const Medium> medium_;
  Extrema extrema_;
  Scene scene_;
  std::unique_ptr<const Kernel> kernel_;
  std::unique_ptr<Workspace> workspace_;
  PreparedRay context_;
  SampleBlock block_;
  Counters counters_;
};

/// Times a kernel; items are samples.
inline void run_kernel_bench(benchmark::State& state, KernelBench bench) {
  for ([[maybe_unused]] auto _ : state) bench.draw();
  count_items(state, "sample", bench.counters().samples);
  count_lookups(state, bench.counters().lookups);
}

/// Times a hand-written sampler, `Real sample(PlainRng&, std::uint64_t& lookups)`; items are samples.
template <class Sample>
void run_plain_bench(benchmark::State& state, const Sample& sample) {
  PlainRng rng(1);
  std::uint64_t lookups = 0, samples = 0;
  for ([[maybe_unused]] auto _ : state) {
    for (int i = 0; i < 256; ++i) benchmark::DoNotOptimize(sample(rng, lookups));
    samples += 256;
  }
  count_items(state, "sample", samples);
  count_lookups(state, lookups);
}

}  // namespace nullmark
