// Files and grids that are refused, and readers that die on them.

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstring>
#include <fstream>
#include <optional>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "media/volumes/vdb_test.h"
#include "media/volumes/vdb_writer.h"
#include "media/volumes/volume.h"

namespace nullmark {
namespace {

using namespace vdb_test;

TEST_F(Vdb, RepeatedNamesMustBeChosen) {
  const auto a = cloud(Coord(0), Coord(3)), b = cloud(Coord(0), Coord(5)), c = cloud(Coord(0), Coord(7)),
             d = cloud(Coord(0), Coord(2));
  d->setName("other");
  const std::string file = written(a, b, c, d);
  expect_refused(file, "density", "grid", {"appears 3 times; choose density[0], density[1] or density[2]"});
  expect_refused(file, "density[3]", "grid", {"not found", "density[0], density[1], density[2] and other"});
  expect_refused(file, "heat", "grid", {"not found", "density[0]"});
  EXPECT_EQ(read_vdb(file, "density[0]").active.hi, Index3(3, 3, 3));
  EXPECT_EQ(read_vdb(file, "density[1]").active.hi, Index3(5, 5, 5));
  EXPECT_EQ(read_vdb(file, "density[2]").active.hi, Index3(7, 7, 7));
  EXPECT_EQ(read_vdb(file, "other").active.hi, Index3(2, 2, 2));
}

TEST_F(Vdb, RefusesWhatIsNoExtinction) {
  auto grid = cloud(Coord(0), Coord(9));
  const Coord place(4, 5, 6);
  for (const auto& [value, word] : {std::pair{std::nanf(""), "nan"}, {HUGE_VALF, "inf"}, {-0.5f, "-0.5"}}) {
    grid->tree().setValue(place, value);
    expect_refused(written(grid), "density", "grid", {"(4, 5, 6)", word, "expected"});
    grid->tree().setValueOff(place, value);  // inactive, yet interpolated
    expect_refused(written(grid), "density", "grid", {"(4, 5, 6)", word});
  }
  grid->tree().setValue(place, 1);
  grid->tree().setValueOff(Coord(40, 40, 40), -1);  // out of the support's reach
  EXPECT_NO_THROW(read_vdb(written(grid), "density"));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->tree().setValue(place, -1);
  expect_refused(written(grid), "density", "grid", {"level set", "sdfToFogVolume"});
  grid = cloud(Coord(0), Coord(9), -1);
  expect_refused(written(grid), "density", "grid", {"background", "-1"});
}

TEST_F(Vdb, RefusesEmptyAbsurdAndForeignGrids) {
  auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  expect_refused(written(grid), "density", "grid", {"empty", "0 active voxels"});
  grid->tree().setValue(Coord(0), 1);
  grid->tree().setValue(Coord(2000000000, 0, 0), 1);
  expect_refused(written(grid), "density", "grid", {"voxel indices", "2000000001", "crop"});
  grid = cloud(Coord(0), Coord(3));
  grid->tree().setValue(Coord(1000000, 1000000, 1000000), 1);
  expect_refused(written(grid), "density", "grid", {"bounding box", "1000003 x 1000003 x 1000003", "crop"});
  const auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("velocity");
  vectors->tree().setValue(Coord(0), openvdb::Vec3f(1));
  expect_refused(written(vectors), "velocity", "grid", {"vec3s", "expected float or double"});
  const auto frustum = cloud(Coord(0), Coord(9));
  frustum->setTransform(
      openvdb::math::Transform::createFrustumTransform(openvdb::BBoxd(openvdb::Vec3d(0.), openvdb::Vec3d(9.)), 0.5, 2, 0.1));
  expect_refused(written(frustum), "density", "grid", {"NonlinearFrustumMap", "affine"});
}

TEST_F(Vdb, RefusesSingularMaps) {
  const auto grid = cloud(Coord(0), Coord(9));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(rotated_sheared()));
  const std::string file = written(grid);
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  in.close();
  const openvdb::Mat4d matrix = rotated_sheared();
  const std::string row(reinterpret_cast<const char*>(matrix.asPointer()), 3 * sizeof(double));
  const std::size_t place = bytes.find(row);
  ASSERT_NE(place, std::string::npos);
  for (const double entry : {0., std::nan("")}) {
    for (std::size_t i = 0; i < 3; ++i) std::memcpy(bytes.data() + place + i * sizeof(double), &entry, sizeof entry);
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
    const auto [where, message] = refusal(file, "density");
    EXPECT_FALSE(where.empty()) << message;
    EXPECT_NE(message.find(file), std::string::npos) << message;
  }
}

TEST_F(Vdb, RefusesFilesThatAreCutOrForeignAndReportsMissingOnes) {
  const auto a = cloud(Coord(0), Coord(30)), b = cloud(Coord(0), Coord(30));
  b->setName("heat");
  const std::string file = written(a, b);
  std::ifstream in(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  in.close();
  for (std::size_t n = 0; n < 200; ++n) {
    const std::size_t length = n < 100 ? bytes.size() * n / 100 : n < 150 ? bytes.size() - (n - 99) : 10 * (n - 150);
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes.substr(0, length);
    expect_refused(file, "density", "file", {});
  }
  std::ofstream(file, std::ios::trunc) << "not a volume at all, but long enough to be read as a header of something";
  expect_refused(file, "density", "file", {"not a readable OpenVDB file"});
  expect_refused(folder_.string(), "density", "file", {});
  EXPECT_THROW(read_vdb(path("absent.vdb"), "density"), MissingData);
  EXPECT_THROW(read_vdb("", "density"), ParameterError);
}

TEST_F(Vdb, SizesThatNoFileOfItsSizeNeedsMeetTheLimitOfMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the limit is on addresses, of which sanitizers take all";
#endif
  const std::string file = written(cloud(Coord(0), Coord(9)));
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  in.close();
  // The length of the grid's name, as the file declares it.
  const std::size_t name = bytes.find("density");
  ASSERT_NE(name, std::string::npos);
  const std::uint32_t huge = 0xfffffff0;
  std::memcpy(bytes.data() + name - sizeof huge, &huge, sizeof huge);
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
  expect_refused(file, "density", "file", {"more memory", "damaged"});
}

TEST_F(Vdb, WhatIsNoFileIsNotOpened) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0666), 0);
  expect_refused(path("pipe"), "density", "file", {"not a regular file"});
  expect_refused("/dev/zero", "density", "file", {"not a regular file"});
}

TEST_F(Vdb, NamesInFilesAreShownAsPlainText) {
  auto grid = cloud(Coord(0), Coord(3));
  grid->setName("two\nlines\x1b[31m\xff");
  expect_refused(written(grid), "density", "grid", {"the file has two?lines?[31m?"});
}

/// A child of this process, once its limits are set; the text of them.  Nothing where `over` comes first.
std::optional<pid_t> limited_child(std::string& limits, const std::atomic<bool>& over) {
  while (!over)
    for (const auto& entry : fs::directory_iterator("/proc")) {
      std::ifstream stat(entry.path() / "stat");
      pid_t id = 0, parent = 0;
      std::string name, state;
      if (!(stat >> id >> name >> state >> parent) || parent != ::getpid()) continue;
      std::ifstream in(entry.path() / "limits");
      limits.assign(std::istreambuf_iterator<char>(in), {});
      if (limits.find("Max cpu time              unlimited") == std::string::npos && !limits.empty()) return id;
    }
  return std::nullopt;
}

/// What OpenVDB does on damaged files, at the hands of the test: the reader dies of a signal, or is stopped by a limit.
TEST_F(Vdb, ReadersThatDieAreAnError) {
  ProceduralVdb options;
  options.resolution = 192;
  write_procedural_vdb(path(), options);
  for (const auto& [signal, words] :
       std::vector<std::pair<int, const char*>>{{SIGSEGV, "crashed on it (signal 11, Segmentation fault)"},
                                                {SIGABRT, "crashed on it (signal 6, Aborted)"},
                                                {SIGXCPU, "without an end; the file is damaged"},
                                                {SIGALRM, "did not finish in"},
                                                {SIGKILL, "was killed (signal 9)"}}) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    if (signal == SIGSEGV) continue;  // the sanitizer makes an exit of it
#endif
    std::string limits;
    std::tuple<std::string, std::string> answer;
    // On a busy machine a reader may be done before it is found: then the next one is.
    do {
      std::atomic<bool> over = false;
      std::thread killer([&, number = signal] {
        if (const auto child = limited_child(limits, over)) ::kill(*child, number);
      });
      answer = refusal(path(), "density");
      over = true;
      killer.join();
    } while (std::get<0>(answer).empty());
    expect_refusal(answer, path(), "density", "file", {words});
    // Soft and hard: a megabyte of file a second, and three.
    const auto seconds = std::to_string(3 + fs::file_size(path()) / 1'000'000);
    EXPECT_NE(limits.find("Max cpu time              " + seconds + " "), std::string::npos) << limits;
    EXPECT_NE(limits.find("Max core file size        0 "), std::string::npos) << limits;
  }
  EXPECT_NO_THROW(read_vdb(path(), "density"));
}

}  // namespace
}  // namespace nullmark
