#include "media/vdb_reader.h"

#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <bit>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <optional>

#include "media/registry.h"

namespace nullmark {

namespace {

struct GridEntry {
  std::string name;  ///< with [n] where names repeat
  std::string base;
};

/// The grids a file announces, in file order.  OpenVDB's own reader leaves zeros where a file was cut short, without an error;
/// so the announced ends are held against the file's size here.
class Directory : private openvdb::io::Archive {
 public:
  explicit Directory(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    readHeader(stream);
    if (!inputHasGridOffsets())
      throw std::runtime_error("written to a stream, without grid offsets; write it to a file with openvdb::io::File");
    setFormatVersion(stream);
    setLibraryVersion(stream);
    openvdb::MetaMap().readMeta(stream);
    const auto size = static_cast<std::int64_t>(std::filesystem::file_size(file));
    for (int n = readGridCount(stream); n > 0; --n) {
      openvdb::io::GridDescriptor descriptor;
      descriptor.read(stream);
      grids_.push_back({openvdb::io::GridDescriptor::nameAsString(descriptor.uniqueName()), descriptor.gridName()});
      if (descriptor.getEndPos() > size)
        throw std::runtime_error(fmt::format("truncated: {} bytes, but grid \"{}\" ends at {}; copy it again", size,
                                             grids_.back().name, descriptor.getEndPos()));
      descriptor.seekToEnd(stream);
    }
  }

  const std::vector<GridEntry>& grids() const { return grids_; }

 private:
  std::vector<GridEntry> grids_;
};

std::string joined(const std::vector<std::string>& names, const char* last) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : i + 1 < names.size() ? ", " : last) + names[i];
  return text;
}

/// One line naming file and grid.
struct Source {
  const std::string& file;
  const std::string& grid;

  [[noreturn]] void refuse(const std::string& message) const {
    throw ParameterError("grid", fmt::format("{}: grid \"{}\": {}", file, grid, message));
  }
};

std::string choose(const Source& source, const std::vector<GridEntry>& grids) {
  std::vector<std::string> all, same;
  for (const GridEntry& entry : grids) {
    if (entry.name == source.grid) return entry.name;
    all.push_back(entry.name);
    if (entry.base == source.grid) same.push_back(entry.name);
  }
  if (same.size() == 1) return same[0];
  if (same.size() > 1) source.refuse(fmt::format("appears {} times; choose {}", same.size(), joined(same, " or ")));
  if (all.empty()) source.refuse("not found, the file has no grids");
  source.refuse(fmt::format("not found; the file has {}", joined(all, " and ")));
}

Affine affine(const Source& source, const openvdb::math::Transform& transform) {
  if (!transform.isLinear())
    source.refuse(
        fmt::format("its transform is a {}, expected an affine map; resample it, e.g. with "
                    "openvdb::tools::resampleToMatch",
                    transform.mapType()));
  // OpenVDB multiplies rows: world = index * matrix.
  const openvdb::Mat4d matrix = transform.baseMap()->getAffineMap()->getMat4();
  Affine map;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) map(row, column) = matrix(column, row);
  const Vec3 edges = map.linear().colwise().norm();
  // A parallelepiped of less than 1e-9 of its edges' product has no accurate inverse.
  if (!map.matrix().allFinite() || !(std::abs(map.linear().determinant()) > 1e-9 * edges.prod()))
    source.refuse(
        "its transform is singular or not finite, so that world points have no voxel; expected an invertible affine map");
  return map;
}

template <class Grid>
void copy_brick(const Grid& grid, const Index3& origin, float* values) {
  using Tree = typename Grid::TreeType;
  using Leaf = typename Tree::LeafNodeType;
  static_assert(Leaf::DIM == BrickGrid::kSide);
  // Unregistered with the tree, so that making one for each brick costs nothing.
  const openvdb::tree::ValueAccessor<const Tree, false> accessor(grid.tree());
  constexpr int n = BrickGrid::kSide, stride = BrickGrid::kStride;
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner >> 2, y = corner >> 1 & 1, z = corner & 1;
    const openvdb::Coord at(origin[0] + n * x, origin[1] + n * y, origin[2] + n * z);
    const Leaf* leaf = accessor.probeConstLeaf(at);
    const auto tile = leaf ? typename Grid::ValueType{} : accessor.getValue(at);
    // The brick itself, or the one layer of its neighbours that is the apron.
    for (int i = 0; i < (x ? 1 : n); ++i)
      for (int j = 0; j < (y ? 1 : n); ++j)
        for (int k = 0; k < (z ? 1 : n); ++k) {
          const auto value = leaf ? leaf->getValue(static_cast<openvdb::Index>((i * n + j) * n + k)) : tile;
          values[((i + n * x) * stride + j + n * y) * stride + k + n * z] = static_cast<float>(value);
        }
  }
}

void check_values(const Source& source, const BrickGrid& values, bool level_set) {
  const auto unusable = [](float value) { return !std::isfinite(value) || value < 0; };
  const char* const expected = "expected finite values >= 0 (as 32 bit floats)";
  const char* const remedy = level_set ? "this is a level set: convert it with openvdb::tools::sdfToFogVolume"
                                       : "clean the grid, e.g. with openvdb::tools::foreach";
  if (unusable(values.background()))
    source.refuse(fmt::format("its background is {}, {}; {}", values.background(), expected, remedy));
  if (const std::optional<Index3> at = values.find(unusable))
    source.refuse(fmt::format("voxel ({}, {}, {}) holds {}, {}; {}", (*at)[0], (*at)[1], (*at)[2],
                              values.value((*at)[0], (*at)[1], (*at)[2]), expected, remedy));
}

std::uint64_t content_hash(const BrickGrid& values, const Affine& map) {
  std::uint64_t hash = values.content_hash();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) hash = hash_mixed(hash, std::bit_cast<std::uint64_t>(map(row, column)));
  return hash;
}

template <class Grid>
VolumeData convert(const Source& source, const Grid& grid) {
  VolumeData data;
  data.index_to_world = affine(source, grid.transform());
  data.voxel_size = data.index_to_world.linear().colwise().norm();
  data.grid_class = openvdb::GridBase::gridClassToString(grid.getGridClass());
  data.active_voxels = static_cast<std::int64_t>(grid.activeVoxelCount());
  if (data.active_voxels == 0) source.refuse("empty, 0 active voxels; expected at least one: choose another grid or frame");

  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  data.active = {{box.min()[0], box.min()[1], box.min()[2]}, {box.max()[0], box.max()[1], box.max()[2]}};
  try {
    data.values = BrickGrid::build(
        data.active.dilated(1), static_cast<float>(grid.background()),
        [&](const Index3& origin, float* values) { copy_brick(grid, origin, values); },
        [](std::size_t n, const auto& body) { tbb::parallel_for(std::size_t{0}, n, body); });
  } catch (const std::length_error& error) {
    source.refuse(fmt::format("{}; crop or resample the grid", error.what()));
  }
  check_values(source, data.values, grid.getGridClass() == openvdb::GRID_LEVEL_SET);
  data.content_hash = content_hash(data.values, data.index_to_world);
  return data;
}

}  // namespace

VolumeData read_vdb(const std::string& file, const std::string& grid) {
  static std::once_flag initialized;
  std::call_once(initialized, openvdb::initialize);
  if (file.empty()) throw ParameterError("file", "no file given; expected the path of an OpenVDB file");
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) throw MissingData(fmt::format("{}: no such file (grid \"{}\")", file, grid));
  const Source source{file, grid};
  openvdb::GridBase::Ptr found;
  try {
    const std::string name = choose(source, Directory(file).grids());
    openvdb::io::File archive(file);
    archive.open(false);
    const openvdb::GridBase::Ptr header = archive.readGridMetadata(name);
    if (!header->isType<openvdb::FloatGrid>() && !header->isType<openvdb::DoubleGrid>())
      source.refuse(
          fmt::format("holds {} ({}), expected float or double; choose a scalar grid", header->valueType(), header->type()));
    affine(source, header->transform());
    found = archive.readGrid(name);
  } catch (const ParameterError&) {
    throw;
  } catch (const std::exception& error) {
    throw ParameterError("file", fmt::format("{}: grid \"{}\": not a readable OpenVDB file ({}); expected a .vdb file, complete",
                                             file, grid, error.what()));
  }
  if (const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(found)) return convert(source, *floats);
  return convert(source, *openvdb::gridPtrCast<openvdb::DoubleGrid>(found));
}

}  // namespace nullmark
