#include "media/flat_volume.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <bit>
#include <cstring>
#include <iterator>
#include <optional>
#include <string_view>
#include <vector>

#include "media/parameters.h"

namespace nullmark {
namespace {

/// An answer that no intact reader gives.
struct Inconsistent : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The T that begins at a byte, which need not be aligned.
template <class T>
T taken(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

bool unusable(float value) { return !std::isfinite(value) || value < 0; }

[[noreturn]] void refuse_value(const std::string& where, float value, const FlatHeader& header) {
  const bool level_set = FlatHeader::kGridClasses[header.grid_class] == std::string_view("level set");
  throw UnusableGrid(fmt::format("{} {}, expected finite values >= 0 (as 32 bit floats); {}", where, value,
                                 level_set ? "this is a level set: convert it with openvdb::tools::sdfToFogVolume"
                                           : "clean the grid, e.g. with openvdb::tools::foreach"));
}

[[noreturn]] void refuse_voxel(const Index3& at, float value, const FlatHeader& header) {
  refuse_value(fmt::format("voxel ({}, {}, {}) holds", at[0], at[1], at[2]), value, header);
}

/// The leaves and tiles of an answer, found by voxel.
class FlatVoxels {
 public:
  FlatVoxels(std::span<const std::byte> answer, const FlatHeader& header, const IndexBox& box)
      : header_(header), leaves_(answer.data() + sizeof(FlatHeader)), leaf_count_(header.leaves), box_(box) {
    const std::size_t room = answer.size() - sizeof(FlatHeader);
    if (header.leaves > room / sizeof(FlatLeaf) || header.tiles != (room - header.leaves * sizeof(FlatLeaf)) / sizeof(FlatTile) ||
        (room - header.leaves * sizeof(FlatLeaf)) % sizeof(FlatTile) != 0)
      throw Inconsistent(fmt::format("{} leaves and {} tiles in {} bytes", header.leaves, header.tiles, room));
    if (header.leaves + header.tiles >= UINT32_MAX) throw Inconsistent("more leaves and tiles than bricks");
    tile_count_ = header.tiles;
    tiles_ = leaves_ + leaf_count_ * sizeof(FlatLeaf);
  }

  /// To be called once the box is known to be of a size that memory can hold.  Every brick has one owner, so the time this takes
  /// is bounded by the box and the answer's size, whatever the tiles say.
  void index() {
    std::size_t bricks = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      first_[a] = brick_of(box_.lo[axis]);
      shape_[a] = static_cast<std::size_t>(brick_of(box_.hi[axis]) - first_[a] + 1);
      bricks *= shape_[a];
    }
    owner_.assign(bricks, 0);
    for (std::size_t n = 0; n < leaf_count_; ++n) {
      const auto origin = taken<std::array<std::int32_t, 3>>(leaves_ + n * sizeof(FlatLeaf));
      claim(origin, BrickGrid::kSide, n + 1);
    }
    for (std::size_t n = 0; n < tile_count_; ++n) {
      const auto tile = taken<FlatTile>(tiles_ + n * sizeof(FlatTile));
      if (tile.side != 8 && tile.side != 128 && tile.side != 4096)
        throw Inconsistent(fmt::format("a tile of {} voxels", tile.side));
      claim({tile.origin[0], tile.origin[1], tile.origin[2]}, tile.side, leaf_count_ + n + 1);
      // One in a large tile would make every brick of it one of its own.
      if (unusable(tile.value))
        refuse_voxel(Index3(tile.origin[0], tile.origin[1], tile.origin[2]).cwiseMax(box_.lo), tile.value, header_);
    }
  }

  /// As BrickGrid::build asks for it.
  bool fill(const Index3& origin, float* values) const {
    std::array<std::uint32_t, 8> owners{};
    for (unsigned corner = 0; corner < 8; ++corner)
      owners[corner] = owner_at(brick_of(origin[0]) + (corner >> 2), brick_of(origin[1]) + (corner >> 1 & 1),
                                brick_of(origin[2]) + (corner & 1));
    if (std::all_of(owners.begin(), owners.end(), [](std::uint32_t owner) { return owner == 0; })) return false;
    constexpr int n = BrickGrid::kSide, stride = BrickGrid::kStride;
    for (int corner = 0; corner < 8; ++corner) {
      const int x = corner >> 2, y = corner >> 1 & 1, z = corner & 1;
      const std::uint32_t owner = owners[static_cast<std::size_t>(corner)];
      const bool leaf = owner != 0 && owner <= leaf_count_;
      const std::byte* const voxels = leaf ? leaves_ + (owner - 1) * sizeof(FlatLeaf) + offsetof(FlatLeaf, values) : nullptr;
      const float tile = owner == 0 ? header_.background
                         : leaf     ? 0
                                : taken<float>(tiles_ + (owner - leaf_count_ - 1) * sizeof(FlatTile) + offsetof(FlatTile, value));
      // The brick itself, or the one layer of its neighbours that is the apron.
      const int wide = z ? 1 : n;
      for (int i = 0; i < (x ? 1 : n); ++i)
        for (int j = 0; j < (y ? 1 : n); ++j) {
          float* const row = values + ((i + n * x) * stride + j + n * y) * stride + n * z;
          if (leaf)
            std::memcpy(row, voxels + static_cast<std::size_t>((i * n + j) * n) * sizeof(float),
                        static_cast<std::size_t>(wide) * sizeof(float));
          else
            std::fill(row, row + wide, tile);
        }
    }
    return true;
  }

 private:
  static std::int64_t brick_of(std::int64_t voxel) { return voxel >> std::bit_width(BrickGrid::kSide - 1u); }

  std::uint32_t owner_at(std::int64_t i, std::int64_t j, std::int64_t k) const {
    // Bricks below the first wrap round to large numbers.
    const auto u = static_cast<std::uint64_t>(i - first_[0]), v = static_cast<std::uint64_t>(j - first_[1]),
               w = static_cast<std::uint64_t>(k - first_[2]);
    return u < shape_[0] && v < shape_[1] && w < shape_[2] ? owner_[(u * shape_[1] + v) * shape_[2] + w] : 0;
  }

  void claim(const std::array<std::int32_t, 3>& origin, int side, std::size_t owner) {
    std::array<std::size_t, 3> begin{}, end{};
    for (std::size_t a = 0; a < 3; ++a) {
      if (origin[a] % side != 0) throw Inconsistent(fmt::format("a cube of {} voxels begins at {}", side, origin[a]));
      const std::int64_t lo = std::max(brick_of(origin[a]) - first_[a], std::int64_t{0});
      const std::int64_t hi =
          std::min(brick_of(std::int64_t{origin[a]} + side) - first_[a], static_cast<std::int64_t>(shape_[a]));
      if (lo >= hi) throw Inconsistent("a leaf or tile lies outside the box of its grid");
      begin[a] = static_cast<std::size_t>(lo);
      end[a] = static_cast<std::size_t>(hi);
    }
    for (std::size_t i = begin[0]; i < end[0]; ++i)
      for (std::size_t j = begin[1]; j < end[1]; ++j)
        for (std::size_t k = begin[2]; k < end[2]; ++k) {
          std::uint32_t& place = owner_[(i * shape_[1] + j) * shape_[2] + k];
          if (place != 0) throw Inconsistent("leaves or tiles overlap");
          place = static_cast<std::uint32_t>(owner);
        }
  }

  const FlatHeader& header_;
  const std::byte *leaves_, *tiles_ = nullptr;
  std::size_t leaf_count_, tile_count_ = 0;
  IndexBox box_;
  std::array<std::int64_t, 3> first_{};
  std::array<std::size_t, 3> shape_{};
  std::vector<std::uint32_t> owner_;  ///< 0: background; then leaves, then tiles, counted from 1
};

std::uint64_t content_hash(const BrickGrid& values, const Affine& map) {
  std::uint64_t hash = values.content_hash();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) hash = hash_mixed(hash, std::bit_cast<std::uint64_t>(map(row, column)));
  return hash;
}

VolumeData volume(std::span<const std::byte> answer, const FlatHeader& header) {
  if (header.grid_class >= std::size(FlatHeader::kGridClasses))
    throw Inconsistent(fmt::format("grid class {}", header.grid_class));
  if (header.active_voxels <= 0) throw Inconsistent(fmt::format("{} active voxels", header.active_voxels));
  VolumeData data;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) data.index_to_world(row, column) = header.map[row * 4 + column];
  expect_invertible(data.index_to_world);
  data.voxel_size = data.index_to_world.linear().colwise().norm();
  data.grid_class = FlatHeader::kGridClasses[header.grid_class];
  data.active_voxels = header.active_voxels;
  data.active = {{header.lo[0], header.lo[1], header.lo[2]}, {header.hi[0], header.hi[1], header.hi[2]}};
  if (unusable(header.background)) refuse_value("its background is", header.background, header);
  const IndexBox box = data.active.dilated(1);
  FlatVoxels voxels(answer, header, box);
  bool indexed = false;
  try {
    data.values = BrickGrid::build(
        box, header.background, [&](const Index3& origin, float* values) { return voxels.fill(origin, values); },
        [&](std::size_t n, const auto& body) {
          // By now the box has passed BrickGrid's limits.
          if (!indexed) voxels.index();
          indexed = true;
          tbb::parallel_for(std::size_t{0}, n, body);
        });
  } catch (const std::length_error& error) {
    throw UnusableGrid(fmt::format("{}; crop or resample the grid", error.what()));
  }
  if (const std::optional<Index3> at = data.values.find(unusable))
    refuse_voxel(*at, data.values.value((*at)[0], (*at)[1], (*at)[2]), header);
  data.content_hash = content_hash(data.values, data.index_to_world);
  return data;
}

/// Names and types in a file may hold anything, and messages end up on terminals and in JSON.
std::string printable(std::span<const std::byte> bytes) {
  constexpr std::size_t kLongest = 2000;
  std::string text;
  for (const std::byte byte : bytes.first(std::min(bytes.size(), kLongest))) {
    const auto c = static_cast<char>(byte);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  return text;
}

}  // namespace

void expect_invertible(const Affine& index_to_world) {
  const Vec3 edges = index_to_world.linear().colwise().norm();
  // A parallelepiped of less than 1e-9 of its edges' product has no accurate inverse.
  if (!index_to_world.matrix().allFinite() || !(std::abs(index_to_world.linear().determinant()) > 1e-9 * edges.prod()))
    throw UnusableGrid(
        "its transform is singular or not finite, so that world points have no voxel; expected an invertible affine map");
}

bool meets(const IndexBox& box, const std::int32_t (&origin)[3], int side) {
  bool met = true;
  for (int axis = 0; axis < 3; ++axis) met &= origin[axis] <= box.hi[axis] && std::int64_t{origin[axis]} + side > box.lo[axis];
  return met;
}

VolumeData unflatten(std::span<const std::byte> answer, const std::string& file, const std::string& grid) {
  const auto refuse = [&](const char* parameter, const std::string& message) {
    return ParameterError(parameter, fmt::format("{}: grid \"{}\": {}", file, grid, message));
  };
  try {
    if (answer.size() < sizeof(FlatHeader)) throw Inconsistent(fmt::format("{} bytes", answer.size()));
    const auto header = taken<FlatHeader>(answer.data());
    if (header.magic != FlatHeader::kMagic) throw Inconsistent("incomplete, or of another version of this program");
    using Kind = FlatHeader::Kind;
    if (header.kind == Kind::volume) return volume(answer, header);
    if (header.kind != Kind::bad_file && header.kind != Kind::bad_grid) throw Inconsistent("of no known kind");
    throw refuse(header.kind == Kind::bad_file ? "file" : "grid", printable(answer.subspan(sizeof header)));
  } catch (const UnusableGrid& error) {
    throw refuse("grid", error.what());
  } catch (const Inconsistent& error) {
    throw refuse("file", fmt::format("what OpenVDB makes of it does not hold together ({}); the file is damaged, copy it again",
                                     error.what()));
  }
}

}  // namespace nullmark
