#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/kernel/kernel.h"
#include "harness/testing/built_media.h"
#include "media/base/albedo.h"
#include "media/base/channels.h"
#include "media/cosine.h"
#include "media/exponential_cube.h"
#include "media/gaussian_bump.h"
#include "media/gaussian_hole.h"
#include "media/layers.h"
#include "media/majorants/global.h"
#include "media/majorants/grid.h"
#include "media/volumes/volume.h"

namespace nullmark {

inline constexpr std::uint64_t kKey = 0x5eed, kFirst = (std::uint64_t{1} << 33) - 1000;

struct Sampled {
  std::vector<Real> values;
  std::vector<std::uint32_t> lookups;
  Counters counters;
};

struct Case {
  std::string name;
  std::shared_ptr<const Medium> medium;
  std::shared_ptr<const MajorantStructure> majorant;
  Ray world;
  std::shared_ptr<const AlbedoField> albedo = nullptr;
};

/// Voxels 0 to 31 on each axis, a smooth blob with a vacuum around it.
inline std::shared_ptr<const Medium> volume() {
  auto data = std::make_shared<VolumeData>();
  data->active = {Index3::Constant(2), Index3::Constant(29)};
  const auto value = [](int i, int j, int k) {
    const Real x = i - 15.3, y = j - 14.8, z = k - 16.1;
    const Real r = (x * x + y * y + 2 * z * z) / 100;
    return r < 1 ? static_cast<float>(0.8 * (1 - r) + 0.1 * std::cos(i * 1.7 + j)) : 0.f;
  };
  data->values = BrickGrid::build(
      {Index3::Constant(0), Index3::Constant(31)}, 0.f,
      [](const Index3&, const auto& shape, const auto& visit) { visit(0, shape[0] * shape[1] * shape[2], nullptr); },
      [&](const Index3& at, float* out) {
        for (int i = 0; i <= 8; ++i)
          for (int j = 0; j <= 8; ++j)
            for (int k = 0; k <= 8; ++k) *out++ = std::max(0.f, value(at[0] + i, at[1] + j, at[2] + k));
      },
      [](std::size_t n, const auto& body) {
        for (std::size_t i = 0; i < n; ++i) body(i);
      });
  data->index_to_world = Affine(Eigen::Scaling(Vec3::Constant(Real{1} / 32)));
  return std::make_shared<FilteredVolume<TrilinearFilter>>(std::move(data), Real{40});
}

/// Media and bounds of which each asks something else of a walk; in colour where a spectrum of at most four channels is given.
inline std::vector<Case> cases(const std::vector<Real>& spectrum = {}) {
  GaussianBump bump;
  bump.profile.amplitude = 9;
  GaussianHole hole;
  hole.profile.level = 6;
  Cosine cosine;
  cosine.target_depth = 4;
  ExponentialCube cube;
  const Ray slanted{{0.02, 0.1, 0.3}, Vec3(1, 0.5, 0.25).normalized(), 0, kInfinity};
  std::vector<Case> all;
  const auto under_bounds = [&](const std::string& name, std::shared_ptr<const Medium> medium, const Ray& world) {
    const auto with = [&](const std::string& majorant, std::shared_ptr<const MajorantStructure> structure) {
      all.push_back({name + "/" + majorant, medium, std::move(structure), world});
    };
    with("global", std::make_shared<GlobalMajorant>(*medium, 1.5));
    with("violated", std::make_shared<GlobalMajorant>(*medium, 0.7));
    with("grid", std::make_shared<GridMajorant>(*medium, std::array{7, 3, 5}, 1));
    with("rewind", std::make_shared<GridMajorant>(*medium, std::array{7, 3, 5}, 1.2, Crossing::rewind));
  };
  const auto add = [&](const std::string& name, std::shared_ptr<const Medium> medium, const Ray& world) {
    if (!spectrum.empty()) medium = std::make_shared<Spectral>(medium, spectrum);
    under_bounds(name, medium, world);
  };
  cube.profile.x0 = 0.01;
  add("constant", constant(3), slanted);
  add("bump", built(bump), slanted);
  add("hole", built(hole), slanted);
  add("cosine", built(cosine), slanted);
  add("cube", built(cube), slanted);
  add("volume", volume(), slanted);
  // Along an axis two coordinates of a walk's points stay as they are.
  add("volume along x", volume(), {{-1, 0.4, 0.6}, {1, 0, 0}, 0, kInfinity});
  add("volume along -y", volume(), {{0.4, 2, 0.6}, {0, -1, 0}, 0, kInfinity});
  add("volume along z", volume(), {{0.6, 0.4, -1}, {0, 0, 1}, 0, kInfinity});
  all.push_back(all.front());
  all.back().name = "constant, of an albedo that varies";
  cosine.target_depth = 0.5;
  all.back().albedo = std::make_shared<FieldAlbedo>(built(cosine), all.back().medium->channels());
  if (!spectrum.empty()) {
    std::vector<std::shared_ptr<const Medium>> channels = {built(bump), built(hole), constant(2), built(cosine)};
    channels.resize(spectrum.size());
    under_bounds("a field for each channel", std::make_shared<PerChannel>(channels), slanted);
  }
  return all;
}

inline Sampled sampled(const Kernel& kernel, const Case& with, std::size_t count, Quantity quantity = Quantity::transmittance) {
  const auto workspace = kernel.workspace();
  const Extrema extrema = with.medium->extrema(with.medium->bounds());
  PreparedRay context;
  context.index = 5;
  context.local = clipped(transformed(with.world, with.medium->world_to_local()), with.medium->bounds());
  context.world = with.world;
  context.world.begin = context.local.begin;
  context.world.end = context.local.end;
  context.bounds.start(*with.majorant, context.world, context.local);
  if (kernel.needs_optical_depth()) context.exact_depth = Spectrum::Constant(with.medium->channels(), 1.25);
  if (with.albedo) {
    context.albedo = with.albedo->most(with.medium->channels());
    context.albedo_field = with.albedo.get();
  }
  kernel.begin_ray(*workspace, *with.medium, extrema, context);
  Sampled out;
  SampleBlock block;
  kernel.sample(*workspace, *with.medium, context, kKey, kFirst, count, quantity, block, out.counters);
  out.values = block.values;
  out.lookups = block.lookups;
  return out;
}

inline void expect_same(const Sampled& a, const Sampled& b, const std::string& where) {
  EXPECT_EQ(a.values, b.values) << where;
  EXPECT_EQ(a.lookups, b.lookups) << where;
  EXPECT_EQ(a.counters.lookups, b.counters.lookups) << where;
  EXPECT_EQ(a.counters.draws, b.counters.draws) << where;
  EXPECT_EQ(a.counters.null_collisions, b.counters.null_collisions) << where;
  EXPECT_EQ(a.counters.violations, b.counters.violations) << where;
  EXPECT_EQ(a.counters.largest_violation, b.counters.largest_violation) << where;
}

}  // namespace nullmark
