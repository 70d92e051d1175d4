#pragma once

#include <benchmark/benchmark.h>

#include <memory>

#include "harness/block_kernel.h"
#include "media/majorants/prescribed.h"

namespace nullmark {

/// Times an estimator's kernel over a medium and a constant majorant on one ray along x through the middle of the unit cube: 256
/// samples a traversal, a new address for each.  Counts lookups as items.
template <template <class> class Estimator>
void run_kernel_bench(benchmark::State& state, const std::shared_ptr<const Medium>& medium, Real majorant,
                      const Ray& world = {{0, 0.5, 0.5}, {1, 0, 0}, 0, 1}) {
  const BlockKernel<Estimator, Real> kernel({}, 1);
  const PrescribedMajorant structure(*medium, majorant, Vec3::Zero());
  const Extrema extrema = medium->extrema(medium->bounds());
  const auto workspace = kernel.workspace();
  RayContext context;
  context.local = clipped(transformed(world, medium->world_to_local()), medium->bounds());
  context.world = world;
  context.world.begin = context.local.begin;
  context.world.end = context.local.end;
  SampleBlock block;
  Counters counters;
  std::uint64_t first = 0;
  for ([[maybe_unused]] auto _ : state) {
    structure.segments(context.world, context.local, context.segments);
    kernel.begin_ray(*workspace, *medium, extrema, context);
    kernel.sample(*workspace, *medium, context, 1, first, 256, Quantity::transmittance, block, counters);
    benchmark::DoNotOptimize(block.values.data());
    first += 256;
  }
  state.counters["items"] = static_cast<double>(counters.lookups);
}

}  // namespace nullmark
