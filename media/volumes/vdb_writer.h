#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "media/volumes/brick_grid.h"

namespace nullmark {

struct ProceduralVdb {
  std::uint64_t seed = 1;
  int resolution = 128;  ///< voxels across the plume's box
  bool half = false;     ///< store 16-bit values
  /// Rotated, sheared and non-cubic maps are fine.  The box is centred on index 0.
  Affine index_to_world = Affine(Eigen::Scaling(Real{1} / 128));
};

/// Writes a smoke-like fog volume "density", values in [0,1]: five octaves of value noise, thinned towards the surface of a ball.
/// Its saturated core becomes active tiles, what is outside stays background 0.  Voxels depend on the options alone.  zlib where
/// OpenVDB has it, else blosc; written beside the path, then renamed.  Throws ParameterError for "resolution" or "file".
void write_procedural_vdb(const std::string& path, const ProceduralVdb& options = {});

/// Writes a fog volume "density" of voxels 0 <= index < shape, x fastest: values[(z * shape[1] + y) * shape[0] + x].  Its active
/// box is all of them, its background 0.  Throws ParameterError for "file".
void write_dense_vdb(const std::string& path, const Index3& shape, std::span<const float> values, const Affine& index_to_world);

}  // namespace nullmark
