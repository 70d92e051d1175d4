#pragma once

#include <vector>

#include "harness/run/problem.h"
#include "harness/sampling/cell_preparation.h"

/// Samples that a renderer might have drawn of a problem's scene, for tests.
namespace nullmark::drawn_samples {

/// The scene of a plan of one cell, with its tracker.
inline PreparedCell prepared(const Plan& plan) { return CellPreparer(plan).prepare(0); }

/// By the cell's tracker, [(sample * rays + ray) * channels + c]; all rays have streams of their own.
inline std::vector<Real> drawn(const PreparedCell& cell, std::size_t samples) {
  const Scene& scene = *cell.scene;
  const std::size_t rays = scene.rays->world.size(), channels = cell.targets.outputs;
  std::vector<Real> values(samples * rays * channels);
  const auto workspace = cell.kernel->workspace();
  PreparedRay context;
  SampleBlock block;
  Counters counters;
  for (std::size_t ray = 0; ray < rays; ++ray) {
    scene.context(ray, *cell.kernel, context);
    cell.kernel->begin_ray(*workspace, *scene.medium->medium, scene.medium->extrema, context);
    cell.kernel->sample(*workspace, *scene.medium->medium, context, 7, 0, samples, cell.cell->quantity, block, counters);
    for (std::size_t i = 0; i < samples; ++i)
      for (std::size_t c = 0; c < channels; ++c) values[(i * rays + ray) * channels + c] = block.values[i * channels + c];
  }
  return values;
}

}  // namespace nullmark::drawn_samples
