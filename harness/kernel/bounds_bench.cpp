#include <fmt/format.h>

#include <array>

#include "estimators/delta.h"
#include "estimators/spectral.h"
#include "harness/kernel/estimator_template.h"
#include "harness/kernel/path_kernel.h"
#include "harness/sampling/scene.h"
#include "harness/testing/bench.h"
#include "harness/testing/example_media.h"
#include "media/majorants/grid.h"

namespace nullmark {
namespace {

// One light path a camera ray, as renderers draw them, through structures of bounds over a volume; beside each grid a
// hand-written path that walks the same bounds.  Items are paths.

constexpr Real kAlbedo = 0.8, kRouletteFloor = 0.05;
constexpr int kRouletteFrom = 4;

Ray camera(std::size_t i) {
  const Real u = static_cast<Real>(i % 64) / 64, v = static_cast<Real>(i / 64 % 64) / 64;
  return {{-0.5, u, v}, Vec3(1, 0.3 * (0.5 - u), 0.2 * (0.5 - v)).normalized(), 0, kInfinity};
}

TransportScene scene_with(std::shared_ptr<const Medium> medium, std::shared_ptr<const MajorantStructure> majorant) {
  TransportScene scene;
  scene.medium = std::move(medium);
  scene.majorant = std::move(majorant);
  scene.environment.radiance = Spectrum::Ones(scene.medium->channels());
  scene.albedo = Spectrum::Constant(scene.medium->channels(), kAlbedo);
  scene.options.roulette_from = kRouletteFrom;
  scene.options.roulette_floor = kRouletteFloor;
  return scene;
}

/// Delta tracking, or history-aware spectral tracking by averages [Kutz et al. 2017, Sec. 5], by 3D-DDA with early exit
/// [Amanatides and Woo 1987].
template <std::size_t kChannels>
class PlainPaths {
  using Value = std::array<Real, kChannels>;

 public:
  PlainPaths(std::shared_ptr<const Medium> medium, int cells)
      : medium_(std::move(medium)), box_(medium_->bounds()), map_(medium_->world_to_local()), cells_(cells) {
    const Vec3 size = box_.extent() / cells, margin = 1e-9 * size;
    for (int z = 0; z < cells; ++z)
      for (int y = 0; y < cells; ++y)
        for (int x = 0; x < cells; ++x) {
          const Vec3 lo = box_.lo + Vec3(x, y, z).cwiseProduct(size);
          bounds_.push_back(medium_->extrema({lo - margin, lo + size + margin}).maximum.maxCoeff());
        }
  }

  Real path(Ray ray, Rng& rng) {
    Value throughput;
    throughput.fill(1);
    for (int scatterings = 0;; ++scatterings) {
      const Ray local = clipped(transformed(ray, map_), box_);
      Real t = local.begin;
      if (!(local.length() > 0) || !collides(local, t, throughput, rng)) return throughput.back();
      if (scatterings + 1 >= kRouletteFrom) {
        const Real most = *std::max_element(throughput.begin(), throughput.end());
        const Real probability = std::max(kRouletteFloor, std::min<Real>(1, most));
        for (Real& weight : throughput) weight /= probability;
        if (!(rng.uniform() < probability)) return 0;
      }
      ray = {ray.at(t), Isotropic().sample(ray.direction, rng), 0, kInfinity};
    }
  }

  std::uint64_t lookups = 0;

 private:
  /// Whether a tentative collision scatters; weighs the throughput.
  static bool scatters(const Value& extinction, Real rate, Value& throughput, Rng& rng) {
    if constexpr (kChannels == 1) {
      if (!(rng.uniform() * rate < extinction[0])) return false;
      throughput[0] *= kAlbedo;
      return true;
    } else {
      Real scatter = 0, null = 0;
      for (std::size_t c = 0; c < kChannels; ++c) {
        scatter += throughput[c] * kAlbedo * extinction[c];
        null += throughput[c] * (rate - extinction[c]);
      }
      const Real sum = scatter + null;
      const bool chosen = rng.uniform() * sum < scatter;
      const Real factor = sum / (rate * (chosen ? scatter : null));
      for (std::size_t c = 0; c < kChannels; ++c)
        throughput[c] *= factor * (chosen ? kAlbedo * extinction[c] : rate - extinction[c]);
      return chosen;
    }
  }

  bool collides(const Ray& ray, Real& t, Value& throughput, Rng& rng) {
    std::array<int, 3> cell, step;
    std::array<Real, 3> next, width;
    const Vec3 start = ray.at(ray.begin);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      const Real direction = ray.direction[a], size = box_.extent()[a] / cells_;
      cell[axis] = std::clamp(static_cast<int>((start[a] - box_.lo[a]) / size), 0, cells_ - 1);
      step[axis] = direction > 0 ? 1 : -1;
      width[axis] = direction == 0 ? kInfinity : size / std::abs(direction);
      const Real plane = box_.lo[a] + (cell[axis] + (direction > 0)) * size;
      next[axis] = direction == 0 ? kInfinity : (plane - ray.origin[a]) / direction;
    }
    Real depth = rng.exponential();
    for (;;) {
      const std::size_t axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
      const Real end = std::min(ray.end, next[axis]);
      const Real rate = bounds_[static_cast<std::size_t>((cell[2] * cells_ + cell[1]) * cells_ + cell[0])];
      while (depth < rate * (end - t)) {
        t += depth / rate;
        const Vec3 p = ray.at(t);
        Value extinction;
        medium_->extinction({&p.x(), &p.y(), &p.z(), 1}, extinction.data());
        ++lookups;
        if (scatters(extinction, rate, throughput, rng)) return true;
        depth = rng.exponential();
      }
      depth -= rate * (end - t);
      cell[axis] += step[axis];
      if (!(next[axis] < ray.end) || cell[axis] < 0 || cell[axis] == cells_) return false;
      t = next[axis];
      next[axis] += width[axis];
    }
  }

  std::shared_ptr<const Medium> medium_;
  Box box_;
  Affine map_;
  int cells_;
  std::vector<Real> bounds_;
};

template <std::size_t kChannels>
void plain(benchmark::State& state, std::shared_ptr<const Medium> medium, int cells) {
  PlainPaths<kChannels> paths(std::move(medium), cells);
  std::uint64_t drawn = 0;
  Real sum = 0;
  for ([[maybe_unused]] auto _ : state)
    for (std::size_t i = 0; i < 4096; ++i) {
      Rng rng(SampleAddress{1, static_cast<std::uint32_t>(i), drawn / 4096});
      sum += paths.path(camera(i), rng);
      ++drawn;
    }
  benchmark::DoNotOptimize(sum);
  count_items(state, "path", drawn);
  count_lookups(state, paths.lookups);
}

template <class Source>
void composed(benchmark::State& state, const Source& tracker, std::shared_ptr<const Medium> medium,
              std::shared_ptr<const MajorantStructure> majorant) {
  const TransportScene scene = scene_with(std::move(medium), std::move(majorant));
  const auto kernel = make_path_kernel(tracker, scene);
  const auto workspace = kernel->workspace();
  const Extrema extrema = scene.medium->extrema(scene.medium->bounds());
  // Rays are stored one path ahead: a read waits for a store that was made a moment ago, and renderers have theirs ready.
  std::array<PreparedRay, 2> rays;
  rays[0].world = camera(0);
  SampleBlock block;
  Counters counters;
  for ([[maybe_unused]] auto _ : state)
    for (std::size_t i = 0; i < 4096; ++i) {
      rays[(i + 1) % 2].world = camera(i + 1);
      PreparedRay& context = rays[i % 2];
      context.index = static_cast<std::uint32_t>(i);
      kernel->begin_ray(*workspace, *scene.medium, extrema, context);
      kernel->sample(*workspace, *scene.medium, context, 1, counters.samples / 4096, 1, Quantity::radiance, block, counters);
    }
  count_items(state, "path", counters.samples);
  count_lookups(state, counters.lookups);
}

[[maybe_unused]] const BenchmarkGroup kGroup([] {
  MediumSpec spec;
  spec.field = example_medium("vdb");
  spec.field.values["extinction_per_value"] = 400.;
  const auto built = std::make_shared<const BuiltMedium>(build_medium(spec));
  spec.spectrum = {1, 0.7, 0.4, 0.2};
  const auto colour = std::make_shared<const BuiltMedium>(build_medium(spec));
  const auto structure = [](const BuiltMedium& medium, const char* name, const ParameterValues& values) {
    return build_majorant({name, values, {}, {}}, medium).structure;
  };
  const auto add = [&](const std::string& group, const std::shared_ptr<const BuiltMedium>& medium, const char* bounds,
                       const ParameterValues& values, const auto& tracker) {
    benchmark::RegisterBenchmark(fmt::format("{}/{}", group, tracker.second).c_str(), [=](benchmark::State& state) {
      composed(state, tracker.first, medium->medium, structure(*medium, bounds, values));
    });
  };
  const std::pair delta(EstimatorTemplate<DeltaTracking>(), "delta");
  const std::pair spectral(EstimatorTemplate<SpectralTracking>(), "spectral");
  for (const int cells : {1, 16, 64}) {
    const std::string group = fmt::format("paths through a grid of {:02}^3 bounds", cells), coloured = "coloured " + group;
    benchmark::RegisterBenchmark((group + "/0 hand-written").c_str(),
                                 [=](benchmark::State& state) { plain<1>(state, built->medium, cells); });
    add(group, built, "grid", {{"resolution", cells}}, delta);
    benchmark::RegisterBenchmark((coloured + "/0 hand-written").c_str(),
                                 [=](benchmark::State& state) { plain<4>(state, colour->medium, cells); });
    add(coloured, colour, "grid", {{"resolution", cells}}, spectral);
  }
  for (const char* name : {"kd_tree", "octree", "vdb_nodes"}) {
    const std::string group = fmt::format("paths through a {}", name);
    add(group, built, name, {}, delta);
    add("coloured " + group, colour, name, {}, spectral);
  }
});

}  // namespace
}  // namespace nullmark
