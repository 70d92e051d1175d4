#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

#include "media/volumes/vdb_reader.h"

namespace nullmark {

/// What the process that opens files hands to the one that samples: FlatHeader, then for Kind::volume `leaves` FlatLeaf and
/// `tiles` FlatTile, else the message.  Both ends are the same executable, so layout and byte order are its own.
struct FlatHeader {
  enum class Kind : std::uint32_t { volume, bad_file, bad_grid };

  static constexpr std::uint64_t kMagic = 0x31'74'61'6c'66'6d'6c'6e;  ///< "nlmflat1"
  static constexpr const char* kGridClasses[] = {"unknown", "level set", "fog volume", "staggered"};

  std::uint64_t magic = 0;  ///< written last: without it the answer is not complete
  Kind kind = Kind::volume;
  std::uint32_t grid_class = 0;  ///< of kGridClasses
  std::uint64_t leaves = 0, tiles = 0;
  std::int64_t active_voxels = 0;
  std::int32_t lo[3] = {}, hi[3] = {};  ///< of the active voxels, both inclusive
  double map[12] = {};                  ///< index to world: three rows of four
  float background = 0;
  std::uint32_t unused = 0;
};

/// A brick's voxels, (i * 8 + j) * 8 + k.
struct FlatLeaf {
  std::int32_t origin[3];
  float values[512];
};

/// One value other than the background in a cube of voxels.
struct FlatTile {
  std::int32_t origin[3];
  std::int32_t side;  ///< 8, 128 or 4096
  float value;
};

/// A grid that cannot be used; the message tells what is wrong and what would help.
struct UnusableGrid : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws UnusableGrid where the map is singular or not finite.
void expect_invertible(const Affine& index_to_world);

/// Whether a cube of voxels has any in the box.
bool meets(const IndexBox& box, const std::int32_t (&origin)[3], int side);

/// Checks every number of an answer before it is used: sizes, counts, indices, overlaps, the map, the values.  Throws
/// ParameterError for "file" or "grid"; `file` and `grid` are for its one line.
VolumeData unflatten(std::span<const std::byte> answer, const std::string& file, const std::string& grid);

}  // namespace nullmark
