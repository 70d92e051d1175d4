#include "media/volumes/flat_volume.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <bit>
#include <cstring>
#include <iterator>
#include <optional>
#include <string_view>
#include <vector>

#include "media/base/parameters.h"

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

  /// As BrickGrid::build asks for them, once the box is known to be of a size that its table can have.
  template <class Visit>
  void bricks(const Index3& first, const std::array<std::size_t, 3>& shape, const Visit& visit) {
    index(first, shape);
    for (std::size_t i = 0; i < shape[0]; ++i) {
      if (owner_.unset_until(place(i, 0, 0), place(i + 2, 0, 0)) == place(i + 2, 0, 0)) continue;
      for (std::size_t j = 0; j < shape[1]; ++j) {
        const std::size_t row = (i * shape[1] + j) * shape[2];
        const std::array<std::size_t, 4> rows{place(i, j, 0), place(i, j + 1, 0), place(i + 1, j, 0), place(i + 1, j + 1, 0)};
        Owners owners{};
        std::size_t begin = 0;
        for (std::size_t k = 0; k < shape[2]; ++k) {
          Owners here;
          for (std::size_t r = 0; r < rows.size(); ++r)
            here[2 * r] = owner_[rows[r] + k], here[2 * r + 1] = owner_[rows[r] + k + 1];
          if (here != owners) {
            visit_stretch(row + begin, row + k, owners, visit);
            owners = here;
            begin = k;
          }
          k = same_until(rows, owners, k, shape[2]);
        }
        visit_stretch(row + begin, row + shape[2], owners, visit);
      }
    }
  }

  /// As BrickGrid::build asks for it.
  void fill(const Index3& origin, float* values) const {
    constexpr int n = BrickGrid::kSide, stride = BrickGrid::kStride;
    const Index3 at = origin / n - first_;
    for (int corner = 0; corner < 8; ++corner) {
      const int x = corner >> 2, y = corner >> 1 & 1, z = corner & 1;
      const Index3 brick = at + Index3(x, y, z);
      const std::uint32_t owner = owner_[place(static_cast<std::size_t>(brick[0]), static_cast<std::size_t>(brick[1]),
                                               static_cast<std::size_t>(brick[2]))];
      const std::byte* const voxels =
          is_leaf(owner) ? leaves_ + (owner - 1) * sizeof(FlatLeaf) + offsetof(FlatLeaf, values) : nullptr;
      // The brick itself, or the one layer of its neighbours that is the apron.
      const int wide = z ? 1 : n;
      for (int i = 0; i < (x ? 1 : n); ++i)
        for (int j = 0; j < (y ? 1 : n); ++j) {
          float* const row = values + ((i + n * x) * stride + j + n * y) * stride + n * z;
          if (voxels)
            std::memcpy(row, voxels + static_cast<std::size_t>((i * n + j) * n) * sizeof(float),
                        static_cast<std::size_t>(wide) * sizeof(float));
          else
            std::fill(row, row + wide, one_value(owner));
        }
    }
  }

 private:
  using Owners = std::array<std::uint32_t, 8>;

  /// Every brick has one owner, so the time this takes is bounded by the answer's size and the bricks of its tiles.
  void index(const Index3& first, const std::array<std::size_t, 3>& shape) {
    first_ = first;
    shape_ = shape;
    // One more on every axis, for the upper neighbours of the last.
    owner_ = SparseTable((shape[0] + 1) * (shape[1] + 1) * (shape[2] + 1));
    for (std::size_t n = 0; n < leaf_count_; ++n) {
      std::int32_t origin[3];
      std::memcpy(origin, leaves_ + n * sizeof(FlatLeaf), sizeof origin);
      claim(origin, BrickGrid::kSide, n + 1);
    }
    for (std::size_t n = 0; n < tile_count_; ++n) {
      const auto tile = taken<FlatTile>(tiles_ + n * sizeof(FlatTile));
      if (tile.side != 8 && tile.side != 128 && tile.side != 4096)
        throw Inconsistent(fmt::format("a tile of {} voxels", tile.side));
      claim(tile.origin, tile.side, leaf_count_ + n + 1);
      // One in a large tile would make every brick of it one of its own.
      if (unusable(tile.value))
        refuse_voxel(Index3(tile.origin[0], tile.origin[1], tile.origin[2]).cwiseMax(box_.lo), tile.value, header_);
    }
  }

  /// The last brick of a row up to which, from brick k on, all have the owners that it has, as far as each row of them has but
  /// one.
  std::size_t same_until(const std::array<std::size_t, 4>& rows, const Owners& owners, std::size_t k, std::size_t end) const {
    for (std::size_t r = 0; r < rows.size(); ++r)
      if (owners[2 * r] != owners[2 * r + 1]) return k;
    const std::uint32_t* const table = owner_.data();
    for (std::size_t r = 0; r < rows.size(); ++r) {
      std::size_t at = rows[r] + k + 2;
      const std::size_t last = rows[r] + end + 1;
      if (owners[2 * r] == 0) at = owner_.unset_until(at, last);
      const auto* const changed =
          std::find_if(table + std::min(at, last), table + last, [&](auto o) { return o != owners[2 * r]; });
      end = static_cast<std::size_t>(changed - table) - rows[r] - 1;
    }
    return end - 1;
  }

  template <class Visit>
  void visit_stretch(std::size_t begin, std::size_t end, const Owners& owners, const Visit& visit) const {
    if (begin == end || owners == Owners{}) return;
    if (std::any_of(owners.begin(), owners.end(), [&](std::uint32_t owner) { return is_leaf(owner); })) {
      visit(begin, end, nullptr);
      return;
    }
    BrickGrid::Corners corners;
    std::transform(owners.begin(), owners.end(), corners.begin(), [&](std::uint32_t owner) { return one_value(owner); });
    visit(begin, end, &corners);
  }

  static std::int64_t brick_of(std::int64_t voxel) { return voxel >> std::bit_width(BrickGrid::kSide - 1u); }

  bool is_leaf(std::uint32_t owner) const { return owner != 0 && owner <= leaf_count_; }

  /// Of background or a tile.
  float one_value(std::uint32_t owner) const {
    return owner == 0 ? header_.background
                      : taken<float>(tiles_ + (owner - leaf_count_ - 1) * sizeof(FlatTile) + offsetof(FlatTile, value));
  }

  std::size_t place(std::size_t i, std::size_t j, std::size_t k) const { return (i * (shape_[1] + 1) + j) * (shape_[2] + 1) + k; }

  void claim(const std::int32_t (&origin)[3], int side, std::size_t owner) {
    if (!meets(box_, origin, side)) throw Inconsistent("a leaf or tile lies outside the box of its grid");
    std::array<std::size_t, 3> begin{}, end{};
    for (std::size_t a = 0; a < 3; ++a) {
      if (origin[a] % side != 0) throw Inconsistent(fmt::format("a cube of {} voxels begins at {}", side, origin[a]));
      const std::int64_t first = first_[static_cast<int>(a)];
      begin[a] = static_cast<std::size_t>(std::max(brick_of(origin[a]) - first, std::int64_t{0}));
      end[a] = std::min(static_cast<std::size_t>(brick_of(std::int64_t{origin[a]} + side) - first), shape_[a]);
    }
    for (std::size_t i = begin[0]; i < end[0]; ++i)
      for (std::size_t j = begin[1]; j < end[1]; ++j) {
        const std::size_t row = place(i, j, 0);
        if (std::any_of(owner_.data() + row + begin[2], owner_.data() + row + end[2], [](auto other) { return other != 0; }))
          throw Inconsistent("leaves or tiles overlap");
        owner_.set(row + begin[2], row + end[2], static_cast<std::uint32_t>(owner));
      }
  }

  const FlatHeader& header_;
  const std::byte *leaves_, *tiles_ = nullptr;
  std::size_t leaf_count_, tile_count_ = 0;
  IndexBox box_;
  Index3 first_ = Index3::Zero();  ///< brick of the table, which is BrickGrid's but for one more on every axis
  std::array<std::size_t, 3> shape_{};
  SparseTable owner_;  ///< 0: background; then leaves, then tiles, counted from 1
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
  try {
    data.values = BrickGrid::build(
        box, header.background,
        [&](const Index3& first, const auto& shape, const auto& visit) { voxels.bricks(first, shape, visit); },
        [&](const Index3& origin, float* values) { voxels.fill(origin, values); },
        [](std::size_t n, const auto& body) { tbb::parallel_for(std::size_t{0}, n, body); });
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
