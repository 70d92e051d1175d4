#pragma once

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <unistd.h>

#include <filesystem>
#include <initializer_list>
#include <random>
#include <string>
#include <tuple>

#include "media/volumes/volume.h"

/// Grids written to files, and what the reader says of those that it refuses.
namespace nullmark::vdb_test {

namespace fs = std::filesystem;
using openvdb::Coord;

/// A folder of this process, removed at the end.
class Vdb : public ::testing::Test {
 protected:
  void SetUp() override {
    openvdb::initialize();
    folder_ = fs::temp_directory_path() / ("nullmark_vdb_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const char* name = "grid.vdb") const { return (folder_ / name).string(); }

  template <class... Grids>
  std::string written(const Grids&... grids) const {
    openvdb::io::File file(path());
    file.write(openvdb::GridCPtrVec{grids...});
    file.close();
    return path();
  }

  fs::path folder_;
};

template <class Grid = openvdb::FloatGrid>
typename Grid::Ptr cloud(const Coord& lo, const Coord& hi, double background = 0) {
  auto grid = Grid::create(static_cast<typename Grid::ValueType>(background));
  grid->setName("density");
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform;
  auto accessor = grid->getAccessor();
  for (int i = lo[0]; i <= hi[0]; ++i)
    for (int j = lo[1]; j <= hi[1]; ++j)
      for (int k = lo[2]; k <= hi[2]; ++k) {
        const auto v = static_cast<typename Grid::ValueType>(uniform(random));
        if (uniform(random) < 0.7)
          accessor.setValue(Coord(i, j, k), v);
        else if (v < 0.2)
          accessor.setValueOff(Coord(i, j, k), v);  // inactive, with a value of its own
      }
  accessor.setValue(lo, typename Grid::ValueType(1));
  accessor.setValue(hi, typename Grid::ValueType(1));
  return grid;
}

inline openvdb::Mat4d rotated_sheared() {
  openvdb::Mat4d m = openvdb::Mat4d::identity();
  m.setToScale(openvdb::Vec3d(0.1, 0.25, 0.07));
  m.postShear(openvdb::math::X_AXIS, openvdb::math::Y_AXIS, 0.3);
  m.postRotate(openvdb::math::Z_AXIS, 0.7);
  m.postRotate(openvdb::math::X_AXIS, -1.1);
  m.postTranslate(openvdb::Vec3d(-3, 20, 0.5));
  return m;
}

inline std::tuple<std::string, std::string> refusal(const std::string& file, const std::string& grid) {
  try {
    read_vdb(file, grid);
  } catch (const ParameterError& error) {
    return {error.parameter, error.what()};
  }
  return {"", "accepted"};
}

inline void expect_refusal(const std::tuple<std::string, std::string>& refusal, const std::string& file, const std::string& grid,
                           const char* parameter, std::initializer_list<const char*> words) {
  const auto& [where, message] = refusal;
  EXPECT_EQ(where, parameter) << message;
  EXPECT_NE(message.find(file), std::string::npos) << message;
  EXPECT_NE(message.find("\"" + grid + "\""), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  for (const char* word : words) EXPECT_NE(message.find(word), std::string::npos) << word << " in: " << message;
}

inline void expect_refused(const std::string& file, const std::string& grid, const char* parameter,
                           std::initializer_list<const char*> words) {
  expect_refusal(refusal(file, grid), file, grid, parameter, words);
}

}  // namespace nullmark::vdb_test
