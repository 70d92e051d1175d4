#include "media/volumes/volume.h"

#include <benchmark/benchmark.h>
#include <nanovdb/NanoVDB.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <nanovdb/util/SampleFromVoxels.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include "harness/model/names.h"
#include "harness/sampling/reference_loops.h"
#include "harness/testing/bench_kernel.h"
#include "harness/testing/example_media.h"

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

/// Ratio tracking by hand along the ray: distances in units of the ray's length.  Each reader of voxels serves one benchmark
/// only: what is used once is inlined, and a baseline that is not would be slower than need be.
template <class Reader>
void walk(benchmark::State& state, const Reader& value) {
  const Ray ray = Fixture::instance().local;
  const Real length = ray.length(), majorant = kExtinction * length;
  const auto extinction = [&](Real s) { return majorant * value(Vec3(ray.at(ray.begin + s * length))); };
  run_plain_bench(state,
                  [&](PlainRng& rng, std::uint64_t& lookups) { return plain_ratio_loop(rng, majorant, extinction, lookups); });
}

/// Bounds of 16^3 cells over the volume, and the ratio tracker that one would write by hand over them: a 3D-DDA in the loop of
/// each sample, one exponential carried across cells.
class BoundedWalk {
 public:
  BoundedWalk() {
    const FilteredVolume<TrilinearFilter> medium(Fixture::instance().data, kExtinction);
    box_ = medium.bounds();
    size_ = box_.extent() / kCells;
    for (int z = 0; z < kCells; ++z)
      for (int y = 0; y < kCells; ++y)
        for (int x = 0; x < kCells; ++x) {
          const Vec3 lo = box_.lo + Vec3(x, y, z).cwiseProduct(size_);
          bounds_.push_back(medium.extrema({lo, lo + size_}).maximum[0]);
        }
  }

  template <class Reader>
  Real sample(PlainRng& rng, const Ray& ray, const Reader& value, std::uint64_t& lookups) const {
    int at[3], step[3];
    Real next[3], apart[3];
    const Vec3 start = ray.at(ray.begin);
    for (int k = 0; k < 3; ++k) {
      at[k] = std::clamp(static_cast<int>((start[k] - box_.lo[k]) / size_[k]), 0, kCells - 1);
      step[k] = ray.direction[k] > 0 ? 1 : -1;
      next[k] = (box_.lo[k] + (at[k] + (step[k] > 0)) * size_[k] - ray.origin[k]) / ray.direction[k];
      apart[k] = size_[k] / std::abs(ray.direction[k]);
    }
    Real t = ray.begin, weight = 1, depth = -std::log(1 - rng.uniform());
    for (;;) {
      const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
      const Real bound = bounds_[static_cast<std::size_t>((at[2] * kCells + at[1]) * kCells + at[0])];
      const Real end = std::min(next[axis], ray.end);
      while (depth < bound * (end - t)) {
        t += depth / bound;
        ++lookups;
        weight *= (bound - kExtinction * value(Vec3(ray.at(t)))) / bound;
        depth = -std::log(1 - rng.uniform());
      }
      depth -= bound * (end - t);
      t = end;
      at[axis] += step[axis];
      if (!(t < ray.end) || at[axis] < 0 || at[axis] >= kCells) return weight;
      next[axis] += apart[axis];
    }
  }

 private:
  static constexpr int kCells = 16;
  Box box_;
  Vec3 size_;
  std::vector<Real> bounds_;
};

template <class Reader>
void walk_bounded(benchmark::State& state, const Reader& value) {
  const BoundedWalk walk;
  const Ray ray = Fixture::instance().local;
  run_plain_bench(state, [&](PlainRng& rng, std::uint64_t& lookups) { return walk.sample(rng, ray, value, lookups); });
}

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  const std::string group = "ratio tracking, trilinear volume, global majorant/";
  benchmark::RegisterBenchmark((group + "0 NanoVDB ReadAccessor, hand-written").c_str(), [](benchmark::State& state) {
    const auto* grid = Fixture::instance().nano.grid<float>();
    const auto accessor = grid->getAccessor();
    const auto sampler = nanovdb::createSampler<1>(accessor);
    walk(state, [&](const Vec3& p) { return static_cast<Real>(sampler(nanovdb::Vec3d(p.x(), p.y(), p.z()))); });
  });
  benchmark::RegisterBenchmark((group + "dense array, hand-written").c_str(), [](benchmark::State& state) {
    const Fixture& fixture = Fixture::instance();
    walk(state, [&](const Vec3& p) { return fixture.dense_trilinear(p.x(), p.y(), p.z()); });
  });
  benchmark::RegisterBenchmark((group + "OpenVDB GridSampler, hand-written").c_str(), [](benchmark::State& state) {
    const auto accessor = Fixture::instance().grid->getConstAccessor();
    using Sampler = openvdb::tools::BoxSampler;
    walk(state, [&](const Vec3& p) { return static_cast<Real>(Sampler::sample(accessor, openvdb::Vec3d(p.x(), p.y(), p.z()))); });
  });
  const std::string bounded = "ratio tracking, trilinear volume, 16^3 bounds/";
  benchmark::RegisterBenchmark((bounded + "0 dense array, hand-written").c_str(), [](benchmark::State& state) {
    const Fixture& fixture = Fixture::instance();
    walk_bounded(state, [&](const Vec3& p) { return fixture.dense_trilinear(p.x(), p.y(), p.z()); });
  });
  for (const Precision precision : {Precision::float64, Precision::float32}) {
    const auto run = [precision](const Component& majorant) {
      return [=](benchmark::State& state) {
        const auto medium = std::make_shared<FilteredVolume<TrilinearFilter>>(Fixture::instance().data, kExtinction);
        run_kernel_bench(state, KernelBench({"ratio", {}, {}, {}}, medium, majorant, Fixture::world_ray(), precision));
      };
    };
    const std::string name = "nullmark, ratio, " + to_string(precision);
    benchmark::RegisterBenchmark((group + name).c_str(), run({"prescribed", {{"value", kExtinction}}, {}, {}}));
    benchmark::RegisterBenchmark((bounded + name).c_str(), run({"grid", {{"resolution", 16}}, {}, {}}));
  }
});

}  // namespace
}  // namespace nullmark
