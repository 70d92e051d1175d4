#include "media/volumes/flat_volume.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <random>

#include "media/base/parameters.h"

namespace nullmark {
namespace {

/// A grid of two leaves and a tile, as its reader hands it over, to be damaged.
struct Example {
  FlatHeader header;
  std::vector<FlatLeaf> leaves;
  std::vector<FlatTile> tiles;

  Example() {
    header.magic = FlatHeader::kMagic;
    header.grid_class = 2;
    header.active_voxels = 700;
    header.hi[0] = 23;
    header.hi[1] = header.hi[2] = 7;
    header.map[0] = header.map[5] = header.map[10] = 0.5;
    for (const int x : {0, 8}) {
      leaves.push_back({{x, 0, 0}, {}});
      for (int v = 0; v < 512; ++v) leaves.back().values[v] = static_cast<float>(x + v);
    }
    tiles.push_back({{16, 0, 0}, 8, 0.25f});
  }

  std::string bytes() {
    header.leaves = leaves.size();
    header.tiles = tiles.size();
    std::string text = raw(header);
    for (const FlatLeaf& leaf : leaves) text += raw(leaf);
    for (const FlatTile& tile : tiles) text += raw(tile);
    return text;
  }

  template <class T>
  static std::string raw(const T& value) {
    return {reinterpret_cast<const char*>(&value), sizeof value};
  }
};

VolumeData parsed(const std::string& bytes) { return unflatten(std::as_bytes(std::span(bytes)), "f.vdb", "density"); }

std::string error_of(const std::string& bytes) {
  try {
    parsed(bytes);
  } catch (const ParameterError& error) {
    return error.parameter + ": " + error.what();
  }
  return "accepted";
}

std::string error_after(const std::function<void(Example&)>& damage) {
  Example example;
  damage(example);
  return error_of(example.bytes());
}

TEST(FlatVolume, LeavesTilesAndBackgroundBecomeVoxels) {
  const VolumeData data = parsed(Example().bytes());
  EXPECT_EQ(data.values.value(0, 0, 0), 0);
  EXPECT_EQ(data.values.value(7, 7, 7), 511);
  EXPECT_EQ(data.values.value(8, 0, 1), 9);
  EXPECT_EQ(data.values.value(20, 3, 3), 0.25f);
  EXPECT_EQ(data.values.value(24, 3, 3), 0) << "the tile ends with the active box";
  EXPECT_EQ(data.values.value(-1, 0, 0), 0);
  EXPECT_EQ(data.grid_class, "fog volume");
  EXPECT_EQ(data.voxel_size, Vec3::Constant(0.5));
  EXPECT_EQ(data.active_voxels, 700);
}

/// Pages of this process that hold anything, in bytes.
std::size_t resident() {
  std::size_t all = 0, here = 0;
  std::ifstream("/proc/self/statm") >> all >> here;
  return here * static_cast<std::size_t>(::getpagesize());
}

// The box is what a file claims, the leaves and tiles what it holds.
TEST(FlatVolume, FewLeavesInTheLargestBoxTakeLittleMemory) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer keeps a shadow of all that was ever in use";
#endif
  Example example;
  for (int axis = 0; axis < 3; ++axis) example.header.hi[axis] = 4070;
  example.leaves.push_back({{4064, 4064, 4064}, {}});
  for (float& value : example.leaves.back().values) value = 3;
  const std::size_t before = resident();
  const VolumeData data = parsed(example.bytes());
  EXPECT_LT(resident(), before + (std::size_t{64} << 20)) << "a table of 2^27 bricks has 512 MB";
  EXPECT_EQ(data.values.value(8, 0, 1), 9);
  EXPECT_EQ(data.values.value(4070, 4070, 4070), 3);
  EXPECT_EQ(data.values.value(2000, 2000, 2000), 0);
  EXPECT_EQ(data.values.summary(data.active).maximum, 519);
}

// What a fuzzer found: bricks whose values were written out one by one, and stored, a hundred million times.
TEST(FlatVolume, OneTileInAFlatBoxIsStoredOnce) {
  Example example;
  example.leaves.clear();
  example.tiles = {{{0, 0, 0}, 4096, 0.25f}};
  example.header.hi[0] = example.header.hi[1] = 4090;
  example.header.hi[2] = 12;
  const VolumeData data = parsed(example.bytes());
  constexpr std::size_t kTable = 513 * 513 * 3 * sizeof(std::uint32_t);
  EXPECT_LT(data.values.bytes(), kTable + 100 * BrickGrid::kBrickValues * sizeof(float));
  EXPECT_EQ(data.values.value(4090, 17, 12), 0.25f);
  EXPECT_EQ(data.values.value(4090, 17, 13), 0.25f) << "the layer around the active voxels";
  EXPECT_EQ(data.values.value(4090, 17, 14), 0);
}

TEST(FlatVolume, CutAnywhereIsRefused) {
  const std::string bytes = Example().bytes();
  for (std::size_t length = 0; length < bytes.size(); ++length)
    EXPECT_NE(error_of(bytes.substr(0, length)).find("does not hold together"), std::string::npos) << length;
  EXPECT_NE(error_of(bytes + "x").find("does not hold together"), std::string::npos);
}

TEST(FlatVolume, DamageIsRefused) {
  constexpr std::uint64_t kHuge = std::numeric_limits<std::uint64_t>::max();
  const auto damaged = [](const std::function<void(Example&)>& damage, const char* words) {
    const std::string error = error_after(damage);
    EXPECT_NE(error.find(words), std::string::npos) << error << "; expected " << words;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  };
  damaged([](Example& e) { e.header.magic = 0; }, "incomplete");
  damaged([](Example& e) { e.header.kind = FlatHeader::Kind{9}; }, "no known kind");
  damaged([](Example& e) { e.header.grid_class = 4; }, "grid class 4");
  damaged([](Example& e) { e.header.active_voxels = 0; }, "0 active voxels");
  damaged([](Example& e) { e.header.map[5] = 0; }, "singular");
  damaged([](Example& e) { e.header.map[3] = std::nan(""); }, "not finite");
  damaged([](Example& e) { std::swap(e.header.lo[0], e.header.hi[0]); }, "expected a non-empty range");
  damaged([](Example& e) { e.header.hi[1] = std::numeric_limits<int>::max(); }, "voxel indices");
  damaged([](Example& e) { e.header.hi[0] = e.header.hi[1] = e.header.hi[2] = 1 << 29; }, "exceeds the limit");
  damaged([](Example& e) { e.leaves[1].origin[0] = 0; }, "overlap");
  damaged([](Example& e) { e.tiles[0].side = 128; }, "begins at 16");
  damaged([](Example& e) { e.tiles[0].side = 16; }, "a tile of 16 voxels");
  damaged([](Example& e) { e.tiles[0].side = 0; }, "a tile of 0 voxels");
  damaged([](Example& e) { e.tiles[0] = {{0, 0, 0}, 4096, 1}; }, "overlap");
  damaged([](Example& e) { e.leaves[0].origin[2] = 4; }, "begins at 4");
  damaged([](Example& e) { e.leaves[0].origin[2] = 1024; }, "outside the box");
  damaged([](Example& e) { e.leaves[0].origin[2] = std::numeric_limits<int>::min(); }, "outside the box");
  damaged([](Example& e) { e.leaves[0].values[511] = -1; }, "voxel (7, 7, 7) holds -1");
  damaged([](Example& e) { e.tiles[0].value = std::nanf(""); }, "holds nan");
  damaged([](Example& e) { e.header.background = HUGE_VALF; }, "its background is inf");
  for (const std::uint64_t count : {std::uint64_t{1}, std::uint64_t{3}, kHuge, kHuge / sizeof(FlatLeaf) + 2}) {
    Example example;
    std::string bytes = example.bytes();
    std::memcpy(bytes.data() + offsetof(FlatHeader, leaves), &count, sizeof count);
    EXPECT_NE(error_of(bytes).find("leaves and"), std::string::npos) << count;
    bytes = example.bytes();
    const std::uint64_t tiles = count == 1 ? 0 : count;
    std::memcpy(bytes.data() + offsetof(FlatHeader, tiles), &tiles, sizeof tiles);
    EXPECT_NE(error_of(bytes).find("leaves and"), std::string::npos) << count;
  }
}

TEST(FlatVolume, MessagesAreOneLineOfPlainText) {
  FlatHeader header;
  header.magic = FlatHeader::kMagic;
  header.kind = FlatHeader::Kind::bad_grid;
  std::string unprintable = Example::raw(header);
  unprintable += "a\nb\x1b\xff\"";
  EXPECT_EQ(error_of(unprintable), "grid: f.vdb: grid \"density\": a?b??\"");
  header.kind = FlatHeader::Kind::bad_file;
  EXPECT_LT(error_of(Example::raw(header) + std::string(100'000, 'x')).size(), 3000u);
}

// Any byte may have any value: a volume or one line, and memory checkers find nothing.
TEST(FlatVolume, RandomDamageIsAVolumeOrOneLine) {
  std::mt19937 random(5);
  const std::string intact = Example().bytes();
  int refused = 0;
  for (int n = 0; n < 4000; ++n) {
    std::string bytes = intact;
    for (auto flips = 1 + random() % 3; flips > 0; --flips) {
      // Voxels are most of the bytes; headers are where the trouble lies.
      const std::size_t place = random() % (n % 2 ? bytes.size() : sizeof(FlatHeader));
      bytes[place] = static_cast<char>(static_cast<unsigned>(bytes[place]) ^ 1u << random() % 8);
    }
    // A box of more than a few thousand bricks only takes time.
    FlatHeader header;
    std::memcpy(&header, bytes.data(), sizeof header);
    bool large = false;
    for (int axis = 0; axis < 3; ++axis)
      large |= std::abs(std::int64_t{header.hi[axis]} - header.lo[axis]) > 1 << 12 && std::abs(header.hi[axis]) < 1 << 29;
    if (!large) refused += error_of(bytes) != "accepted";
  }
  EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace nullmark
