#include "media/volumes/vdb_writer.h"

#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <filesystem>
#include <mutex>

#include "media/base/parameters.h"
#include "media/volumes/brick_grid.h"

namespace nullmark {

namespace {

/// Uniform in [0,1), from lattice point and seed.
Real lattice_value(std::uint64_t seed, int i, int j, int k) {
  std::uint64_t hash = seed;
  for (const int n : {i, j, k}) hash = hash_mixed(hash, static_cast<std::uint32_t>(n));
  return static_cast<Real>(hash >> 11) * 0x1p-53;
}

/// Value noise in [0,1): the lattice values, joined by the smoothstep 3 f^2 - 2 f^3.
Real noise(std::uint64_t seed, const Vec3& p) {
  const Vec3 low = p.array().floor();
  const Index3 cell = low.cast<int>();
  const Vec3 f = p - low;
  const Vec3 s = f.array().square() * (3 - 2 * f.array());
  Real sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    const Real w = (i ? s[0] : 1 - s[0]) * (j ? s[1] : 1 - s[1]) * (k ? s[2] : 1 - s[2]);
    sum += w * lattice_value(seed, cell[0] + i, cell[1] + j, cell[2] + k);
  }
  return sum;
}

/// p in [-1,1]^3.
Real density(std::uint64_t seed, const Vec3& p) {
  const Real envelope = 1 - p.norm();
  if (envelope <= 0) return 0;
  constexpr int kOctaves = 5;
  Real sum = 0, amplitude = 0.5, frequency = 3;
  for (int octave = 0; octave < kOctaves; ++octave, amplitude /= 2, frequency *= 2)
    sum += amplitude * noise(seed + static_cast<std::uint64_t>(octave), frequency * p);
  // Zero near the surface except where the noise is high, above one in the core.
  return std::clamp<Real>(2.5 * (envelope + sum - 0.8), 0, 1);
}

void initialize_openvdb() {
  static std::once_flag initialized;
  std::call_once(initialized, openvdb::initialize);
}

/// Beside the path, then renamed.
void write_grid(const std::string& path, const openvdb::FloatGrid::Ptr& grid, const Affine& index_to_world) {
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) matrix(column, row) = index_to_world(row, column);

  const std::string temporary = fmt::format("{}.{}.tmp", path, ::getpid());
  try {
    grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
    openvdb::io::File file(temporary);
    const auto codec = openvdb::io::Archive::hasZLibCompression() ? openvdb::io::COMPRESS_ZIP : openvdb::io::COMPRESS_BLOSC;
    file.setCompression(codec | openvdb::io::COMPRESS_ACTIVE_MASK);
    file.write(openvdb::GridCPtrVec{grid});
    file.close();
    std::filesystem::rename(temporary, path);
  } catch (const std::exception& error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    const bool no_folder = !std::filesystem::exists(std::filesystem::absolute(path).parent_path(), ignored);
    throw ParameterError(
        "file", fmt::format("{}: cannot write the volume: {}", path, no_folder ? "its folder does not exist" : error.what()));
  }
}

}  // namespace

void write_procedural_vdb(const std::string& path, const ProceduralVdb& options) {
  constexpr int kLargest = 1024;
  const int n = options.resolution;
  if (n < 8 || n > kLargest) throw ParameterError("resolution", fmt::format("{} voxels across; expected 8 to {}", n, kLargest));
  initialize_openvdb();

  const int lo = -(n / 2);
  openvdb::tools::Dense<float> dense(openvdb::CoordBBox(openvdb::Coord(lo), openvdb::Coord(lo + n - 1)));
  tbb::parallel_for(0, n, [&](int i) {
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        const Vec3 p = (2 * Vec3(i, j, k) - Vec3::Constant(n - 1)) / n;
        dense.setValue(openvdb::Coord(lo + i, lo + j, lo + k), static_cast<float>(density(options.seed, p)));
      }
  });

  const auto grid = openvdb::FloatGrid::create(0);
  openvdb::tools::copyFromDense(dense, *grid, 0.f);
  grid->setSaveFloatAsHalf(options.half);
  write_grid(path, grid, options.index_to_world);
}

void write_dense_vdb(const std::string& path, const Index3& shape, std::span<const float> values, const Affine& index_to_world) {
  initialize_openvdb();
  const openvdb::Coord last(shape[0] - 1, shape[1] - 1, shape[2] - 1);
  openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(openvdb::CoordBBox(openvdb::Coord(0), last));
  std::copy(values.begin(), values.end(), dense.data());
  const auto grid = openvdb::FloatGrid::create(0);
  openvdb::tools::copyFromDense(dense, *grid, 0.f);
  // What is 0 is background.  The active box is what bounds the medium, so its corners are active whatever they hold.
  auto accessor = grid->getAccessor();
  accessor.setValueOn(openvdb::Coord(0), values.front());
  accessor.setValueOn(last, values.back());
  write_grid(path, grid, index_to_world);
}

}  // namespace nullmark
