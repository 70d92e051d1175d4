#include "media/volume.h"

#include <benchmark/benchmark.h>
#include <nanovdb/NanoVDB.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/SampleFromVoxels.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <filesystem>

#include "estimators/ratio.h"
#include "harness/bench_kernel.h"
#include "harness/calibration.h"
#include "media/vdb_writer.h"

namespace nullmark {
namespace {

constexpr int kResolution = 128;
constexpr Real kExtinction = 20;

/// The procedural volume, once as a file's grid, once through the project's reader, once as a dense array.
struct Fixture {
  std::shared_ptr<const VolumeData> data;
  openvdb::FloatGrid::Ptr grid;
  nanovdb::GridHandle<nanovdb::HostBuffer> nano;
  openvdb::Coord lo, size;
  std::vector<float> dense;
  Ray local;

  static const Fixture& instance() {
    static const Fixture fixture;
    return fixture;
  }

  Real dense_trilinear(Real x, Real y, Real z) const {
    x -= lo.x();
    y -= lo.y();
    z -= lo.z();
    const Real fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
    const auto i = static_cast<std::size_t>(fx), j = static_cast<std::size_t>(fy), k = static_cast<std::size_t>(fz);
    const std::size_t row = static_cast<std::size_t>(size.x()), slab = row * static_cast<std::size_t>(size.y());
    const float* at = &dense[k * slab + j * row + i];
    const Real u = x - fx, v = y - fy, w = z - fz;
    const auto mix = [](Real a, Real b, Real t) { return a + t * (b - a); };
    return mix(mix(mix(at[0], at[1], u), mix(at[row], at[row + 1], u), v),
               mix(mix(at[slab], at[slab + 1], u), mix(at[slab + row], at[slab + row + 1], u), v), w);
  }

 private:
  Fixture() {
    openvdb::initialize();
    const std::string path = (std::filesystem::temp_directory_path() / "nullmark_volume_bench.vdb").string();
    write_procedural_vdb(path, {.resolution = kResolution});
    data = std::make_shared<VolumeData>(read_vdb(path, "density"));
    openvdb::io::File file(path);
    file.open();
    grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
    std::filesystem::remove(path);
    nano = nanovdb::openToNanoVDB(*grid);
    const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
    lo = box.min().offsetBy(-2);
    size = box.dim().offsetBy(5);
    dense.resize(static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(size.z()));
    const auto accessor = grid->getConstAccessor();
    std::size_t at = 0;
    for (int z = 0; z < size.z(); ++z)
      for (int y = 0; y < size.y(); ++y)
        for (int x = 0; x < size.x(); ++x) dense[at++] = accessor.getValue(lo.offsetBy(x, y, z));
    const FilteredVolume<TrilinearFilter> volume(data, kExtinction);
    local = clipped(transformed(world_ray(), volume.world_to_local()), volume.bounds());
  }

 public:
  static Ray world_ray() { return {{-2, -1.7, -1.6}, Vec3(2, 1.75, 1.62).normalized(), 0, kInfinity}; }
};

/// The hand-written loop on the same ray: distances in units of the ray's length.
template <class Value>
void hand_loop(benchmark::State& state, const Value& value) {
  const Fixture& fixture = Fixture::instance();
  const Ray ray = fixture.local;
  PlainRng rng(1);
  std::uint64_t lookups = 0;
  const Real length = ray.length(), majorant = kExtinction * length;
  for ([[maybe_unused]] auto _ : state)
    for (int i = 0; i < 64; ++i)
      benchmark::DoNotOptimize(plain_ratio_loop(
          rng, majorant, [&](Real s) { return majorant * value(Vec3(ray.at(ray.begin + s * length))); }, lookups));
  state.counters["items"] = static_cast<double>(lookups);
}

[[maybe_unused]] const bool kRegistered = [] {
  const std::string group = "ratio tracking, trilinear volume, global majorant";
  benchmark::RegisterBenchmark((group + "/0 NanoVDB ReadAccessor, hand loop").c_str(), [](benchmark::State& state) {
    const auto* grid = Fixture::instance().nano.grid<float>();
    const auto accessor = grid->getAccessor();
    const auto sampler = nanovdb::createSampler<1>(accessor);
    hand_loop(state, [&](const Vec3& p) { return static_cast<Real>(sampler(nanovdb::Vec3d(p.x(), p.y(), p.z()))); });
  });
  benchmark::RegisterBenchmark((group + "/dense array, hand loop").c_str(), [](benchmark::State& state) {
    const Fixture& fixture = Fixture::instance();
    hand_loop(state, [&](const Vec3& p) { return fixture.dense_trilinear(p.x(), p.y(), p.z()); });
  });
  benchmark::RegisterBenchmark((group + "/OpenVDB GridSampler, hand loop").c_str(), [](benchmark::State& state) {
    const auto accessor = Fixture::instance().grid->getConstAccessor();
    using Sampler = openvdb::tools::BoxSampler;
    hand_loop(state, [&](const Vec3& p) {
      return static_cast<Real>(Sampler::sample(accessor, openvdb::Vec3d(p.x(), p.y(), p.z())));
    });
  });
  benchmark::RegisterBenchmark((group + "/nullmark, ratio").c_str(), [](benchmark::State& state) {
    const auto medium = std::make_shared<FilteredVolume<TrilinearFilter>>(Fixture::instance().data, kExtinction);
    run_kernel_bench<RatioTracking>(state, medium, kExtinction, Fixture::world_ray());
  });
  return true;
}();

}  // namespace
}  // namespace nullmark
