#pragma once

#include <cstdint>
#include <string>

#include "media/volumes/brick_grid.h"

namespace nullmark {

/// A scalar grid read from a file, with what a result's provenance tells of it.
struct VolumeData {
  BrickGrid values;                            ///< active box and one voxel around it, then background
  Affine index_to_world = Affine::Identity();  ///< any affine map: rotated, sheared, non-uniform
  IndexBox active;                             ///< bounding box of the active voxels
  std::int64_t active_voxels = 0;
  Vec3 voxel_size = Vec3::Ones();  ///< edge lengths of a voxel, world length
  std::string grid_class;          ///< "fog volume", "level set", "staggered" or "unknown"
  std::uint64_t content_hash = 0;  ///< of values and map
};

/// Reads one grid of float (32 bit, or stored as 16) or double values, which become floats.  `grid` is a name, or name[n] where
/// names repeat, numbered from 0 in file order as OpenVDB does.  Inactive voxels hold what OpenVDB's accessor returns; active
/// tiles are expanded.  Every value must be finite and not negative.  Throws MissingData where the file does not exist, otherwise
/// ParameterError for "file" or "grid".  Thread-safe.
VolumeData read_vdb(const std::string& file, const std::string& grid);

}  // namespace nullmark
