#include "media/volumes/vdb_process.h"

#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <new>

#include "media/volumes/flat_volume.h"

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

std::string choose(const std::string& grid, const std::vector<GridEntry>& grids) {
  std::vector<std::string> all, same;
  for (const GridEntry& entry : grids) {
    if (entry.name == grid) return entry.name;
    all.push_back(entry.name);
    if (entry.base == grid) same.push_back(entry.name);
  }
  if (same.size() == 1) return same[0];
  if (same.size() > 1) throw UnusableGrid(fmt::format("appears {} times; choose {}", same.size(), joined(same, " or ")));
  if (all.empty()) throw UnusableGrid("not found, the file has no grids");
  throw UnusableGrid(fmt::format("not found; the file has {}", joined(all, " and ")));
}

Affine affine(const openvdb::math::Transform& transform) {
  if (!transform.isLinear())
    throw UnusableGrid(
        fmt::format("its transform is a {}, expected an affine map; resample it, e.g. with openvdb::tools::resampleToMatch",
                    transform.mapType()));
  // OpenVDB multiplies rows: world = index * matrix.
  const openvdb::Mat4d matrix = transform.baseMap()->getAffineMap()->getMat4();
  Affine map;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) map(row, column) = matrix(column, row);
  expect_invertible(map);
  return map;
}

/// Answers that do not end up on the other side; the other side finds no complete header then.
struct CannotAnswer {};

void put(int answer, const void* data, std::size_t size, std::size_t offset) {
  for (const char* at = static_cast<const char*>(data); size > 0;) {
    const ssize_t written = ::pwrite(answer, at, size, static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throw CannotAnswer{};
    at += written;
    offset += static_cast<std::size_t>(written);
    size -= static_cast<std::size_t>(written);
  }
}

/// Collects records behind the header.
class Records {
 public:
  explicit Records(int answer) : answer_(answer) {}

  template <class Record>
  void add(const Record& record) {
    constexpr std::size_t kEnough = std::size_t{1} << 20;
    buffer_.append(reinterpret_cast<const char*>(&record), sizeof record);
    if (buffer_.size() >= kEnough) flush();
  }

  void flush() {
    put(answer_, buffer_.data(), buffer_.size(), offset_);
    offset_ += buffer_.size();
    buffer_.clear();
  }

 private:
  int answer_;
  std::size_t offset_ = sizeof(FlatHeader);
  std::string buffer_;
};

template <class Grid>
void answer_grid(const Grid& grid, int answer) {
  using Tree = typename Grid::TreeType;
  static_assert(Tree::LeafNodeType::SIZE == std::size(FlatLeaf{}.values));
  FlatHeader header;
  const Affine map = affine(grid.transform());
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) header.map[row * 4 + column] = map(row, column);
  static_assert(openvdb::GRID_UNKNOWN == 0 && openvdb::GRID_LEVEL_SET == 1 && openvdb::GRID_FOG_VOLUME == 2 &&
                openvdb::GRID_STAGGERED == 3);
  header.grid_class = static_cast<std::uint32_t>(grid.getGridClass());
  header.active_voxels = static_cast<std::int64_t>(grid.activeVoxelCount());
  if (header.active_voxels == 0)
    throw UnusableGrid("empty, 0 active voxels; expected at least one: choose another grid or frame");
  const openvdb::CoordBBox active = grid.evalActiveVoxelBoundingBox();
  for (int axis = 0; axis < 3; ++axis) {
    header.lo[axis] = active.min()[axis];
    header.hi[axis] = active.max()[axis];
  }
  const IndexBox box =
      IndexBox{{header.lo[0], header.lo[1], header.lo[2]}, {header.hi[0], header.hi[1], header.hi[2]}}.dilated(1);
  header.background = static_cast<float>(grid.background());

  Records records(answer);
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord& at = leaf->origin();
    FlatLeaf flat{{at[0], at[1], at[2]}, {}};
    if (!meets(box, flat.origin, static_cast<int>(Tree::LeafNodeType::DIM))) continue;
    const auto* const values = leaf->buffer().data();
    std::transform(values, values + Tree::LeafNodeType::SIZE, flat.values, [](auto v) { return static_cast<float>(v); });
    records.add(flat);
    ++header.leaves;
  }
  auto tile = grid.tree().cbeginValueAll();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const auto value = static_cast<float>(*tile);
    // By its bits, for the hash of the contents tells zeros of either sign apart.
    if (std::bit_cast<std::uint32_t>(value) == std::bit_cast<std::uint32_t>(header.background)) continue;
    const openvdb::CoordBBox cube = tile.getBoundingBox();
    const FlatTile flat{{cube.min()[0], cube.min()[1], cube.min()[2]}, cube.max()[0] - cube.min()[0] + 1, value};
    if (!meets(box, flat.origin, flat.side)) continue;
    records.add(flat);
    ++header.tiles;
  }
  records.flush();
  header.magic = FlatHeader::kMagic;
  put(answer, &header, sizeof header, 0);
}

void refuse(FlatHeader::Kind kind, const std::string& message, int answer) {
  if (::ftruncate(answer, 0) != 0) throw CannotAnswer{};
  FlatHeader header;
  header.kind = kind;
  put(answer, message.data(), message.size(), sizeof header);
  header.magic = FlatHeader::kMagic;
  put(answer, &header, sizeof header, 0);
}

void read(const std::string& file, const std::string& grid, int answer) {
  static std::once_flag initialized;
  std::call_once(initialized, openvdb::initialize);
  const std::string name = choose(grid, Directory(file).grids());
  openvdb::io::File archive(file);
  archive.open(false);
  const openvdb::GridBase::Ptr header = archive.readGridMetadata(name);
  if (!header->isType<openvdb::FloatGrid>() && !header->isType<openvdb::DoubleGrid>())
    throw UnusableGrid(
        fmt::format("holds {} ({}), expected float or double; choose a scalar grid", header->valueType(), header->type()));
  affine(header->transform());
  const openvdb::GridBase::Ptr found = archive.readGrid(name);
  if (const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(found))
    answer_grid(*floats, answer);
  else if (const auto doubles = openvdb::gridPtrCast<openvdb::DoubleGrid>(found))
    answer_grid(*doubles, answer);
  else
    throw std::runtime_error("its grid is not of the type that it announces");
}

}  // namespace

bool answer_volume(const std::string& file, const std::string& grid, int answer) {
  // Threads of its own would count against the limit of its address space, on machines of many cores most of all.
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  using Kind = FlatHeader::Kind;
  try {
    try {
      read(file, grid, answer);
    } catch (const UnusableGrid& error) {
      refuse(Kind::bad_grid, error.what(), answer);
    } catch (const std::bad_alloc&) {
      refuse(Kind::bad_file, "takes more memory than a file of its size can need; it is damaged, copy it again", answer);
    } catch (const std::exception& error) {
      refuse(Kind::bad_file, fmt::format("not a readable OpenVDB file ({}); expected a .vdb file, complete", error.what()),
             answer);
    }
  } catch (const CannotAnswer&) {
    return false;
  }
  return true;
}

}  // namespace nullmark
