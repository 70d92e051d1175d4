#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"
#include "media/base/medium.h"
#include "media/volumes/brick_grid.h"

namespace nullmark {

/// Voxels 0 <= index < shape, x fastest, as they are written for a renderer.
struct DenseGrid {
  Index3 shape = Index3::Zero();
  std::vector<float> values;
  Affine index_to_world = Affine::Identity();
};

/// Most voxels of a raw dump.
inline constexpr std::int64_t kMostRawVoxels = std::int64_t{1} << 26;

/// A grey medium at the centres of resolution^3 cells of its box.  Throws InputError where a value is not finite.
DenseGrid sampled_grid(const Medium& medium, int resolution, const std::string& name);

/// The active box of a grid of an OpenVDB file and `border` voxels around it; no values where it has more than kMostRawVoxels.
DenseGrid active_grid(const std::string& file, const std::string& grid, int border);

/// Writes the numbers as they are in memory: 32-bit floats, little-endian.
void write_raw(const std::string& path, std::span<const float> values);

/// Shape and map of a grid for problem.json; the map has three rows of four numbers.
Json grid_json(const DenseGrid& grid);

}  // namespace nullmark
