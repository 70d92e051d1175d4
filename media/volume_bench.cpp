#include "media/volume.h"

#include <benchmark/benchmark.h>
#include <nanovdb/NanoVDB.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/SampleFromVoxels.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include "harness/bench_kernel.h"
#include "harness/calibration.h"
#include "media/example_media.h"

namespace nullmark {
namespace {

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
    data = std::make_shared<VolumeData>(read_vdb(example_volume_file(), "density"));
    openvdb::io::File file(example_volume_file());
    file.open();
    grid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
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

template <class Filter>
std::shared_ptr<const Medium> volume() {
  return std::make_shared<FilteredVolume<Filter>>(Fixture::instance().data, kExtinction);
}

// Hand-written readers of the voxels: functions of a point.

auto nanovdb_reader(const auto& sampler) {
  return [&](const Vec3& p) { return static_cast<Real>(sampler(nanovdb::Vec3d(p.x(), p.y(), p.z()))); };
}

template <class Sampler>
auto openvdb_reader(const auto& accessor) {
  return [&](const Vec3& p) { return static_cast<Real>(Sampler::sample(accessor, openvdb::Vec3d(p.x(), p.y(), p.z()))); };
}

auto dense_reader() {
  return [&fixture = Fixture::instance()](const Vec3& p) { return fixture.dense_trilinear(p.x(), p.y(), p.z()); };
}

// Flattened, or readers that are used twice are called instead of inlined, and the baselines slower than need be.

/// Ratio tracking by hand along the ray: distances in units of the ray's length.
[[gnu::flatten]] void walk(benchmark::State& state, const auto& value) {
  const Ray ray = Fixture::instance().local;
  PlainRng rng(1);
  std::uint64_t lookups = 0, samples = 0;
  const Real length = ray.length(), majorant = kExtinction * length;
  for ([[maybe_unused]] auto _ : state) {
    for (int i = 0; i < 64; ++i)
      benchmark::DoNotOptimize(plain_ratio_loop(
          rng, majorant, [&](Real s) { return majorant * value(Vec3(ray.at(ray.begin + s * length))); }, lookups));
    samples += 64;
  }
  count_items(state, "sample", samples);
  count_lookups(state, lookups);
}

/// Points as a block of walks asks for them: scattered along the ray.
struct RandomPoints {
  RandomPoints() {
    const Ray ray = Fixture::instance().local;
    PlainRng rng(1);
    for (int i = 0; i < 4096; ++i) {
      const Vec3 p = ray.at(ray.begin + rng.uniform() * ray.length());
      x.push_back(p.x()), y.push_back(p.y()), z.push_back(p.z());
    }
  }
  std::vector<Real> x, y, z;
};

[[gnu::flatten]] void look_up(benchmark::State& state, const auto& value) {
  const RandomPoints points;
  std::vector<Real> out(points.x.size());
  std::uint64_t lookups = 0;
  for ([[maybe_unused]] auto _ : state) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = kExtinction * value(Vec3(points.x[i], points.y[i], points.z[i]));
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
    lookups += out.size();
  }
  count_items(state, "point", lookups);
}

void look_up_in_blocks(benchmark::State& state, const Medium& medium) {
  constexpr std::size_t kBlock = 256;
  const RandomPoints points;
  std::vector<Real> out(kBlock);
  std::uint64_t lookups = 0;
  for ([[maybe_unused]] auto _ : state) {
    const std::size_t first = lookups % points.x.size();
    medium.extinction({&points.x[first], &points.y[first], &points.z[first], kBlock}, out.data());
    benchmark::DoNotOptimize(out.data());
    benchmark::ClobberMemory();
    lookups += kBlock;
  }
  count_items(state, "point", lookups);
}

template <int order>
void with_nanovdb(benchmark::State& state, bool walks) {
  const auto accessor = Fixture::instance().nano.grid<float>()->getAccessor();
  const auto sampler = nanovdb::createSampler<order>(accessor);
  walks ? walk(state, nanovdb_reader(sampler)) : look_up(state, nanovdb_reader(sampler));
}

template <class Sampler>
void with_openvdb(benchmark::State& state, bool walks) {
  const auto accessor = Fixture::instance().grid->getConstAccessor();
  walks ? walk(state, openvdb_reader<Sampler>(accessor)) : look_up(state, openvdb_reader<Sampler>(accessor));
}

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  using benchmark::State;
  using openvdb::tools::BoxSampler, openvdb::tools::PointSampler;
  const auto add = [](const std::string& name, auto function) { benchmark::RegisterBenchmark(name.c_str(), function); };
  const std::string walks = "ratio tracking, trilinear volume, global majorant/", smooth = "trilinear lookup along a ray/",
                    voxels = "nearest lookup along a ray/";
  add(walks + "0 NanoVDB ReadAccessor, hand-written", [](State& state) { with_nanovdb<1>(state, true); });
  add(walks + "dense array, hand-written", [](State& state) { walk(state, dense_reader()); });
  add(walks + "OpenVDB GridSampler, hand-written", [](State& state) { with_openvdb<BoxSampler>(state, true); });
  add(walks + "nullmark, ratio", [](State& state) {
    run_kernel_bench(state, KernelBench({"ratio", {}, {}, {}}, volume<TrilinearFilter>(),
                                        {"prescribed", {{"value", kExtinction}}, {}, {}}, Fixture::world_ray()));
  });
  add(smooth + "0 NanoVDB ReadAccessor", [](State& state) { with_nanovdb<1>(state, false); });
  add(smooth + "dense array", [](State& state) { look_up(state, dense_reader()); });
  add(smooth + "OpenVDB GridSampler", [](State& state) { with_openvdb<BoxSampler>(state, false); });
  add(smooth + "nullmark, blocks of 256", [](State& state) { look_up_in_blocks(state, *volume<TrilinearFilter>()); });
  add(voxels + "0 NanoVDB ReadAccessor", [](State& state) { with_nanovdb<0>(state, false); });
  add(voxels + "OpenVDB GridSampler", [](State& state) { with_openvdb<PointSampler>(state, false); });
  add(voxels + "nullmark, blocks of 256", [](State& state) { look_up_in_blocks(state, *volume<NearestFilter>()); });
});

}  // namespace
}  // namespace nullmark
