#include "harness/run/problem_volume.h"

#include <fmt/format.h>

#include <cmath>

#include "harness/io/file_io.h"
#include "media/volumes/vdb_reader.h"

namespace nullmark {

DenseGrid sampled_grid(const Medium& medium, int resolution, const std::string& name) {
  const Box box = medium.bounds();
  const Vec3 step = box.extent() / resolution, first = box.lo + step / 2;
  DenseGrid grid;
  grid.shape = Index3::Constant(resolution);
  grid.index_to_world = medium.world_to_local().inverse() * Affine(Eigen::Translation<Real, 3>(first)) * Eigen::Scaling(step);
  const auto n = static_cast<std::size_t>(resolution);
  grid.values.reserve(n * n * n);
  std::vector<Real> x(n), y(n), z(n), extinction(n);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t i = 0; i < n; ++i) {
        x[i] = first.x() + static_cast<Real>(i) * step.x();
        y[i] = first.y() + static_cast<Real>(j) * step.y();
        z[i] = first.z() + static_cast<Real>(k) * step.z();
      }
      medium.extinction({x.data(), y.data(), z.data(), n}, extinction.data());
      for (std::size_t i = 0; i < n; ++i) {
        const auto value = static_cast<float>(extinction[i]);
        if (!std::isfinite(value))
          throw InputError(
              fmt::format("{}: found extinction {} at voxel ({}, {}, {}) of {}^3; a grid cannot hold it; try another "
                          "--resolution",
                          name, extinction[i], i, j, k, resolution));
        grid.values.push_back(value);
      }
    }
  return grid;
}

DenseGrid active_grid(const std::string& file, const std::string& name, int border) {
  const VolumeData data = read_vdb(file, name);
  DenseGrid grid;
  const Index3 lo = data.active.lo - Index3::Constant(border), hi = data.active.hi + Index3::Constant(border);
  grid.shape = hi - lo + Index3::Ones();
  grid.index_to_world = data.index_to_world * Affine(Eigen::Translation<Real, 3>(lo.cast<Real>()));
  std::int64_t voxels = 1;
  for (int axis = 0; axis < 3; ++axis)
    if (voxels <= kMostRawVoxels) voxels *= grid.shape[axis];
  if (voxels > kMostRawVoxels) return grid;
  grid.values.reserve(static_cast<std::size_t>(voxels));
  for (int k = lo[2]; k <= hi[2]; ++k)
    for (int j = lo[1]; j <= hi[1]; ++j)
      for (int i = lo[0]; i <= hi[0]; ++i) grid.values.push_back(data.values.value(i, j, k));
  return grid;
}

void write_raw(const std::string& path, std::span<const float> values) {
  write_atomically(path, std::string(reinterpret_cast<const char*>(values.data()), values.size_bytes()));
}

Json grid_json(const DenseGrid& grid) {
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) {
    Json numbers = Json::array();
    for (int column = 0; column < 4; ++column) numbers.push_back(grid.index_to_world(row, column));
    rows.push_back(std::move(numbers));
  }
  return {{"dims", {grid.shape[0], grid.shape[1], grid.shape[2]}}, {"index_to_world", std::move(rows)}};
}

}  // namespace nullmark
