// What the reader makes of a file is what OpenVDB makes of it; bounds, averages and knots are true of it.

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "media/media_test.h"
#include "media/volumes/vdb_test.h"
#include "media/volumes/vdb_writer.h"
#include "media/volumes/volume.h"

namespace nullmark {
namespace {

using namespace vdb_test;

template <class Filter>
FilteredVolume<Filter> volume_of(const VolumeData& data, Real scale = 1) {
  return FilteredVolume<Filter>(std::make_shared<const VolumeData>(data), scale);
}

Real at(const Medium& medium, const Vec3& p) {
  Real mu = -1;
  medium.extinction({&p[0], &p[1], &p[2], 1}, &mu);
  return mu;
}

Vec3 random_point(std::mt19937_64& random, const Box& box) {
  std::uniform_real_distribution<Real> uniform;
  return box.lo + Vec3(uniform(random), uniform(random), uniform(random)).cwiseProduct(box.extent());
}

/// OpenVDB's own samplers over a double copy of the grid, whose interpolation is in double as well.
template <class Grid>
void expect_matches_openvdb(const VolumeData& data, const Grid& grid, int points) {
  openvdb::DoubleGrid copy(grid);
  // What the reader keeps of doubles.
  for (auto value = copy.beginValueAll(); value; ++value) value.setValue(Real{static_cast<float>(*value)});
  const openvdb::tools::GridSampler<openvdb::DoubleGrid, openvdb::tools::BoxSampler> box(copy);
  const openvdb::tools::GridSampler<openvdb::DoubleGrid, openvdb::tools::PointSampler> point(copy);
  const auto trilinear = volume_of<TrilinearFilter>(data);
  const auto nearest = volume_of<NearestFilter>(data);
  const auto vdb = [](const Vec3& p) { return openvdb::Vec3d(p[0], p[1], p[2]); };
  std::mt19937_64 random(3);
  const Affine to_local = trilinear.world_to_local();
  const Real tolerance = 1e-13 * data.values.summary(data.active).maximum;
  for (int n = 0; n < points; ++n) {
    Vec3 p = random_point(random, trilinear.bounds()), q = random_point(random, nearest.bounds());
    if (n % 3 == 0) p[n / 3 % 3] = std::round(p[n / 3 % 3]);
    if (n % 3 == 1) q[n / 3 % 3] = std::round(q[n / 3 % 3] - 0.5) + 0.5;
    ASSERT_NEAR(at(trilinear, p), box.isSample(vdb(p)), tolerance) << p.transpose();
    ASSERT_EQ(at(nearest, q), point.isSample(vdb(q))) << q.transpose();

    const Vec3 world = data.index_to_world * p;
    const openvdb::Vec3d there = grid.transform().indexToWorld(vdb(p));
    ASSERT_LT((world - Vec3(there[0], there[1], there[2])).norm(), 1e-12 * (1 + world.norm()));
    // The maps back differ by rounding, times the steepest slope.
    ASSERT_NEAR(at(trilinear, to_local * world), box.wsSample(there), 1e4 * tolerance) << world.transpose();
  }
}

// Any box's bounds hold at random points of it; the average is the field's own.
template <class Filter>
void expect_true_bounds(const VolumeData& data, int boxes) {
  const auto volume = volume_of<Filter>(data, 1.75);
  std::mt19937_64 random(5);
  const Real rounding = 1e-12 * volume.extrema(volume.bounds()).maximum[0];
  for (int n = 0; n < boxes; ++n) {
    const Vec3 a = random_point(random, volume.bounds());
    Vec3 b = random_point(random, volume.bounds());
    if (n % 2) b = a + (b - a) / 16;
    Box box{a.cwiseMin(b), a.cwiseMax(b)};
    if (n % 3 == 0) {
      box.lo = box.lo.array().floor();
      box.hi = box.hi.array().ceil();
    }
    const Extrema found = volume.extrema(box);
    for (int m = 0; m < 200; ++m) {
      Vec3 p = random_point(random, box);
      for (int axis = 0; axis < 3; ++axis) {  // faces, edges and corners too
        if (m % 5 == 1 + axis) p[axis] = box.lo[axis];
        if (m % 7 == 1 + axis) p[axis] = box.hi[axis];
      }
      const Real mu = at(volume, p.cwiseMax(volume.bounds().lo).cwiseMin(volume.bounds().hi));
      ASSERT_GE(mu, found.minimum[0] - rounding) << p.transpose();
      ASSERT_LE(mu, found.maximum[0] + rounding) << p.transpose();
    }
    ASSERT_GE(found.average[0], found.minimum[0]);
    ASSERT_LE(found.average[0], found.maximum[0]);
  }
}

/// Optical depth with degree / 2 + 1 Gauss points between knots, against a midpoint march.
template <class Filter>
void expect_knots_suffice(const VolumeData& data, int rays) {
  const auto volume = volume_of<Filter>(data);
  std::mt19937_64 random(11);
  for (int n = 0; n < rays; ++n) {
    const Box whole = volume.bounds();
    const Vec3 far = whole.extent() / 2;
    Ray ray{random_point(random, {whole.lo - far, whole.lo}), Vec3::Zero(), 0, kInfinity};
    ray.direction = (random_point(random, whole) - ray.origin).normalized();
    if (n % 3 == 1) {
      ray.origin = random_point(random, whole);
      ray.direction = Vec3(n % 2 ? -1. : 0., -0., n % 2 ? 0. : 1.);
    }
    const Ray inside = clipped(ray, whole);
    std::vector<Real> t;
    volume.knots(ray, t);
    std::erase_if(t, [&](Real knot) { return knot <= inside.begin || knot >= inside.end; });
    t.push_back(inside.begin);
    t.push_back(inside.end);
    std::sort(t.begin(), t.end());
    Real exact = 0;
    const Real node = *volume.polynomial_degree() == 0 ? 0 : 1 / std::numbers::sqrt3;
    for (std::size_t i = 1; i < t.size(); ++i) {
      const Real middle = (t[i] + t[i - 1]) / 2, half = (t[i] - t[i - 1]) / 2;
      exact += half * (at(volume, ray.at(middle - half * node)) + at(volume, ray.at(middle + half * node)));
    }
    constexpr int kSteps = 1000000;
    Real march = 0;
    const Real h = inside.length() / kSteps;
    for (int i = 0; i < kSteps; ++i) march += at(volume, ray.at(inside.begin + (i + 0.5) * h));
    // Second order where smooth; a jump costs up to a step of the largest value.
    const Real jumps = node == 0 ? static_cast<Real>(t.size()) : 0;
    EXPECT_NEAR(exact, march * h, 1e-9 * (1 + exact) + jumps * h * volume.extrema(whole).maximum[0]) << ray.origin.transpose();
  }
}

template <class Grid>
void expect_all(const std::string& file, const std::string& name, const Grid& grid, int effort = 1) {
  SCOPED_TRACE(file + " " + name);
  const VolumeData data = read_vdb(file, name);
  EXPECT_EQ(static_cast<openvdb::Index64>(data.active_voxels), grid.activeVoxelCount());
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  EXPECT_EQ(data.active.lo, Index3(box.min().x(), box.min().y(), box.min().z()));
  EXPECT_EQ(data.active.hi, Index3(box.max().x(), box.max().y(), box.max().z()));
  for (int axis = 0; axis < 3; ++axis) {
    // Edge lengths of the voxel, also where it is rotated.
    openvdb::Vec3d step(0.);
    step[axis] = 1;
    const openvdb::Vec3d edge = grid.transform().indexToWorld(step) - grid.transform().indexToWorld(openvdb::Vec3d(0.));
    EXPECT_NEAR(data.voxel_size[axis], edge.length(), 1e-12 * edge.length());
  }
  expect_matches_openvdb(data, grid, 20000 * effort);
  expect_true_bounds<TrilinearFilter>(data, 60 * effort);
  expect_true_bounds<NearestFilter>(data, 60 * effort);
}

TEST_F(Vdb, MapsOfEveryAffineKind) {
  const auto grid = cloud(Coord(-13, 2, -30), Coord(9, 21, -8));
  expect_all(written(grid), "density", *grid);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.3));
  expect_all(written(grid), "density", *grid);
  openvdb::Mat4d boxy = openvdb::Mat4d::identity();
  boxy.setToScale(openvdb::Vec3d(0.1, 0.2, -0.4));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(boxy));
  expect_all(written(grid), "density", *grid);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(rotated_sheared()));
  expect_all(written(grid), "density", *grid);
}

TEST_F(Vdb, BackgroundOtherThanZeroShowsInTheSupport) {
  const auto grid = cloud(Coord(-16, 0, 7), Coord(-1, 15, 24), 0.375);
  expect_all(written(grid), "density", *grid);
}

TEST_F(Vdb, HalfAndDoubleStorage) {
  const auto grid = cloud(Coord(-5, -5, -5), Coord(12, 9, 8));
  grid->setSaveFloatAsHalf(true);
  const std::string file = written(grid);
  openvdb::io::File stored(file);
  stored.open(false);
  expect_all(file, "density", *openvdb::gridPtrCast<openvdb::FloatGrid>(stored.readGrid("density")));
  const auto doubles = cloud<openvdb::DoubleGrid>(Coord(-5, -5, -5), Coord(12, 9, 8));
  expect_all(written(doubles), "density", *doubles);
}

TEST_F(Vdb, ActiveTilesOfEveryLevel) {
  const auto grid = cloud(Coord(100, 100, 100), Coord(104, 105, 106));
  grid->tree().addTile(1, Coord(96, 104, 96), 0.5f, true);    // 8^3
  grid->tree().addTile(2, Coord(128, 0, -128), 0.25f, true);  // 128^3
  grid->tree().addTile(1, Coord(-64, 8, 0), 0.125f, false);   // inactive, with a value
  expect_all(written(grid), "density", *grid);
  const auto large = cloud(Coord(-3, -3, -3), Coord(-1, -1, -1));
  large->fill(openvdb::CoordBBox(Coord(0), Coord(511)), 0.75f);
  const VolumeData data = read_vdb(written(large), "density");
  EXPECT_LT(data.values.bytes(), 512u * 512 * 512 * sizeof(float) / 7);
  expect_matches_openvdb(data, *large, 20000);
}

TEST_F(Vdb, ManyAtOnce) {
  const auto grid = cloud(Coord(-9), Coord(9));
  const std::string file = written(grid);
  const std::uint64_t expected = read_vdb(file, "density").content_hash;
  std::vector<std::thread> threads;
  for (int n = 0; n < 8; ++n) threads.emplace_back([&] { EXPECT_EQ(read_vdb(file, "density").content_hash, expected); });
  for (std::thread& thread : threads) thread.join();
}

TEST_F(Vdb, FootprintReachesTheNextVoxel) {
  // One voxel of 1 at (8, 8, 8), the first of its brick: a field of [7, 9]^3.
  auto grid = openvdb::FloatGrid::create();
  grid->setName("density");
  grid->tree().setValue(Coord(0), 0.5f);
  grid->tree().setValue(Coord(8), 1);
  grid->tree().setValue(Coord(16), 0.5f);
  const auto volume = volume_of<TrilinearFilter>(read_vdb(written(grid), "density"));
  EXPECT_EQ(at(volume, Vec3(7.5, 8, 8)), 0.5);
  EXPECT_GE(volume.extrema({{7.1, 7.1, 7.1}, {7.9, 7.9, 7.9}}).maximum[0], at(volume, Vec3(7.9, 7.9, 7.9)));
  EXPECT_GE(volume.extrema({{8.1, 8.1, 8.1}, {8.9, 8.9, 8.9}}).maximum[0], at(volume, Vec3(8.1, 8.1, 8.1)));
  EXPECT_GE(volume.extrema({{7, 7, 7}, {8, 8, 8}}).maximum[0], 1);
  EXPECT_GE(volume.extrema({{8, 8, 8}, {9, 9, 9}}).maximum[0], 1);
  EXPECT_EQ(volume.extrema({{1.5, 1.5, 1.5}, {5.5, 5.5, 5.5}}).maximum[0], 0);
  const auto blocky = volume_of<NearestFilter>(read_vdb(path(), "density"));
  EXPECT_EQ(blocky.extrema({{7.4, 7.4, 7.4}, {7.5, 7.5, 7.5}}).maximum[0], 1);
  EXPECT_EQ(blocky.extrema({{8.4, 8.4, 8.4}, {8.6, 8.6, 8.6}}).maximum[0], 1);
  EXPECT_EQ(blocky.extrema({{8.6, 8.6, 8.6}, {9, 9, 9}}).maximum[0], 0);
}

TEST_F(Vdb, AverageIsTheIntegralOverTheBox) {
  const auto grid = cloud(Coord(-13, 2, -30), Coord(9, 21, -8));
  const VolumeData data = read_vdb(written(grid), "density");
  const auto check = [&](const auto& volume, const Box& box) {
    constexpr int n = 120;
    Real sum = 0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        for (int k = 0; k < n; ++k) sum += at(volume, box.lo + Vec3(i + 0.5, j + 0.5, k + 0.5).cwiseProduct(box.extent()) / n);
    EXPECT_NEAR(volume.extrema(box).average[0], sum / (n * n * n), 4e-3);
  };
  for (const Box& box :
       {Box{{-5.3, 4.2, -22.1}, {-4.1, 9.9, -20}}, Box{{-14, 1, -31}, {10, 22, -7}}, Box{{-2.5, 4, -12}, {5, 5, -11}}}) {
    check(volume_of<TrilinearFilter>(data), box);
    check(volume_of<NearestFilter>(data), {box.lo.cwiseMax(Vec3(-13.5, 1.5, -30.5)), box.hi.cwiseMin(Vec3(9.5, 21.5, -7.5))});
  }
  const auto volume = volume_of<TrilinearFilter>(data);
  EXPECT_NEAR(volume.extrema({{1.25, 5.5, -9}, {1.25, 5.5, -9}}).average[0], 0.5, 0.5);
  EXPECT_EQ(volume.extrema({{100, 100, 100}, {101, 101, 101}}).maximum[0], 0);
}

TEST_F(Vdb, KnotsMakeGaussExact) {
  const auto grid = cloud(Coord(-13, 2, -30), Coord(9, 21, -8), 0.125);
  const VolumeData data = read_vdb(written(grid), "density");
  expect_knots_suffice<TrilinearFilter>(data, 6);
  expect_knots_suffice<NearestFilter>(data, 6);
}

TEST_F(Vdb, HashFollowsValuesAndMap) {
  const auto grid = cloud(Coord(0), Coord(9));
  const std::uint64_t hash = read_vdb(written(grid), "density").content_hash;
  EXPECT_EQ(hash, read_vdb(written(grid), "density").content_hash);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  const std::uint64_t scaled = read_vdb(written(grid), "density").content_hash;
  EXPECT_NE(hash, scaled);
  grid->tree().setValue(Coord(3), 0.987f);
  EXPECT_NE(scaled, read_vdb(written(grid), "density").content_hash);
}

TEST_F(Vdb, SourceIsRegistered) {
  const auto* entry = Registry<MediumEntry>::instance().find("vdb");
  ASSERT_NE(entry, nullptr);
  EXPECT_THROW(entry->make()->build(), ParameterError);  // no file
}

TEST_F(Vdb, ProceduralVolumeReadsBack) {
  ProceduralVdb options;
  options.index_to_world = Affine(Eigen::AngleAxis<Real>(0.6, Vec3(1, 2, -1).normalized()) * Eigen::Scaling(0.02, 0.03, 0.015));
  const auto begin = std::chrono::steady_clock::now();
  write_procedural_vdb(path(), options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  RecordProperty("seconds", std::to_string(seconds.count()));
  openvdb::io::File stored(path());
  stored.open(false);
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(stored.readGrid("density"));
  EXPECT_GT(grid->tree().activeTileCount(), 0u);
  EXPECT_GT(grid->activeVoxelCount(), 300000u);
  expect_all(path(), "density", *grid);
  const VolumeData data = read_vdb(path(), "density");
  EXPECT_TRUE(data.index_to_world.isApprox(options.index_to_world, 1e-14));
  EXPECT_EQ(data.values.summary(data.active).maximum, 1);

  write_procedural_vdb(path("again.vdb"), options);
  EXPECT_EQ(read_vdb(path("again.vdb"), "density").content_hash, data.content_hash);
  options.seed = 2;
  write_procedural_vdb(path("again.vdb"), options);
  EXPECT_NE(read_vdb(path("again.vdb"), "density").content_hash, data.content_hash);
  for (const auto& entry : fs::directory_iterator(folder_)) EXPECT_EQ(entry.path().extension(), ".vdb");
  options.resolution = 1 << 20;
  EXPECT_THROW(write_procedural_vdb(path(), options), ParameterError);
  EXPECT_THROW(write_procedural_vdb(path("absent/grid.vdb")), ParameterError);
}

TEST_F(Vdb, OpticalDepthIsOfTheDiagonal) {
  auto grid = cloud(Coord(-3, 0, 5), Coord(6, 8, 9));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.25));
  const media_test::Settings file = {{"file", written(grid)}};
  const auto with = [&](const media_test::Settings& more) {
    media_test::Settings all = file;
    all.insert(more.begin(), more.end());
    return media_test::make("vdb", all);
  };
  for (const char* filter : {"trilinear", "nearest"}) {
    const media_test::Settings interpolation = {{"interpolation", std::string(filter)}};
    media_test::Settings deep = interpolation;
    deep["optical_depth"] = Real{5};
    const auto plain = with(interpolation), scaled = with(deep);
    const Box box = scaled->bounds();
    const Real diagonal = 0.25 * box.extent().norm();
    EXPECT_NEAR(scaled->extrema(box).average[0] * diagonal, 5, 1e-12) << filter;
    // The same field but for its scale.
    const Vec3 p(1, 2, 7);
    EXPECT_NEAR(at(*scaled, p) / at(*plain, p), 5 / (plain->extrema(box).average[0] * diagonal), 1e-12) << filter;
  }
  EXPECT_THROW(with({{"optical_depth", Real{5}}, {"extinction_per_value", Real{2}}}), ParameterError);
}

TEST_F(Vdb, RealVolumesMatchOpenVdb) {
  const char* root = std::getenv("NULLMARK_DATA");
  if (!root) GTEST_SKIP() << "NULLMARK_DATA is not set: no folder that holds volumes/";
  const fs::path volumes = fs::path(root) / "volumes";
  for (const auto& [file, names] : std::vector<std::pair<const char*, std::vector<const char*>>>{
           {"smoke.vdb", {"density"}},
           {"wdas_cloud_sixteenth.vdb", {"density"}},
           {"dragon_with_xform.vdb", {"density"}},
           {"usd_smoke_000003.vdb", {"density"}},
           {"usd_densityAndHeat.vdb", {"density", "heat"}},
           {"arnold_three_density_grids.vdb", {"density[0]", "density[1]", "density[2]"}}}) {
    const std::string path = (volumes / file).string();
    for (const char* name : names) {
      openvdb::io::File stored(path);
      stored.open(false);
      expect_all(path, name, *openvdb::gridPtrCast<openvdb::FloatGrid>(stored.readGrid(name)), 3);
    }
  }
  expect_refused((volumes / "arnold_three_density_grids.vdb").string(), "density", "grid", {"appears 3 times"});
  expect_refused((volumes / "usd_smoke_000001_empty.vdb").string(), "density", "grid", {"empty"});
  expect_refused((volumes / "usd_smoke_000001_empty.vdb").string(), "obstacles", "grid", {"int32"});
  const VolumeData smoke = read_vdb((volumes / "smoke.vdb").string(), "density");
  expect_knots_suffice<TrilinearFilter>(smoke, 3);
  expect_knots_suffice<NearestFilter>(smoke, 3);
}

}  // namespace
}  // namespace nullmark
