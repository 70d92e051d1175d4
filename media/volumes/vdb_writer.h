#pragma once

#include <cstdint>
#include <string>

#include "media/base/types.h"

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

}  // namespace nullmark
