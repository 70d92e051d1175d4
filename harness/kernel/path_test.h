#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "harness/kernel/optical_depth.h"
#include "harness/kernel/path_kernel.h"
#include "harness/testing/built_media.h"
#include "media/base/along_axis.h"
#include "media/base/channels.h"
#include "media/gaussian_bump.h"
#include "media/homogeneous.h"
#include "media/majorants/global.h"
#include "media/majorants/grid.h"

/// Oracles of radiance: furnaces, closed forms, quadrature, reciprocity.  Means are compared within 5 standard errors (6e-7 a
/// comparison, two-sided normal; about 700 of them, so 4e-4 for all tests of paths, at fixed seeds), the error being the samples'
/// own.
namespace nullmark::path_test {

inline constexpr Real kPi = std::numbers::pi, kErrors = 5;

/// Two that draw the events of paths and one that walks transmittance; defined in path_kernel_test.cpp, for their kernels take
/// long to compile.
extern const EstimatorSource &kDelta, &kSpectral, &kRatio;

inline std::shared_ptr<const Medium> homogeneous(Real extinction, const Vec3& lo = Vec3::Zero(), const Vec3& hi = Vec3::Ones()) {
  return std::make_shared<FieldMedium<Homogeneous>>(Homogeneous{extinction, lo, hi});
}

template <class Profile>
std::shared_ptr<const Medium> along(const char* axis, const Profile& profile, const Vec3& lo = Vec3::Zero(),
                                    const Vec3& hi = Vec3::Ones()) {
  AlongAxis<Profile> field;
  field.profile = profile;
  field.axis_name = axis;
  field.lo = lo;
  field.hi = hi;
  return built(field);
}

inline std::shared_ptr<const Medium> bump(Real amplitude) { return along<GaussianBumpProfile>("x", {amplitude, {0.4, 0.2}}); }

inline std::shared_ptr<const Medium> times(std::shared_ptr<const Medium> grey, const std::vector<Real>& spectrum) {
  return std::make_shared<Spectral>(std::move(grey), spectrum);
}

inline Spectrum spectrum(std::initializer_list<Real> values) {
  return Eigen::Map<const Spectrum>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

inline TransportScene scene_of(std::shared_ptr<const Medium> medium, const Spectrum& albedo, bool grid = false) {
  TransportScene scene;
  if (grid)
    scene.majorant = std::make_shared<GridMajorant>(*medium, std::array{4, 4, 4}, 1);
  else
    scene.majorant = std::make_shared<GlobalMajorant>(*medium, 1.3);
  scene.medium = std::move(medium);
  scene.albedo = albedo;
  return scene;
}

inline Ray camera(const Vec3& from, const Vec3& direction) { return {from, direction.normalized(), 0, kInfinity}; }

inline PreparedRay context_of(const TransportScene& scene, const Ray& ray, std::uint32_t index = 0) {
  PreparedRay context;
  context.world = ray;
  context.local = clipped(transformed(ray, scene.medium->world_to_local()), scene.medium->bounds());
  context.world.begin = context.local.begin;
  context.world.end = context.local.end;
  context.index = index;
  context.bounds.start(*scene.majorant, context.world, context.local);
  return context;
}

struct Estimate {
  Spectrum mean, error, expected;
  std::vector<Real> values;
  Counters counters;
};

inline Estimate sample(const Kernel& kernel, const TransportScene& scene, const Ray& ray, std::size_t count,
                       std::uint64_t key = 1) {
  const auto workspace = kernel.workspace();
  const PreparedRay context = context_of(scene, ray);
  kernel.begin_ray(*workspace, *scene.medium, scene.medium->extrema(scene.medium->bounds()), context);
  Estimate estimate;
  SampleBlock block;
  kernel.sample(*workspace, *scene.medium, context, key, 0, count, Quantity::transmittance, block, estimate.counters);
  estimate.expected = kernel.expected(*workspace, optical_depth(*scene.medium, context.local).depth, Quantity::transmittance);
  estimate.values = block.values;
  const auto channels = scene.medium->channels();
  const Eigen::Map<const Eigen::ArrayXXd> values(block.values.data(), channels, static_cast<Eigen::Index>(count));
  estimate.mean = values.rowwise().mean();
  const Spectrum squares = values.square().rowwise().mean();
  estimate.error = ((squares - estimate.mean.square()).max(0) / static_cast<Real>(count)).sqrt();
  EXPECT_EQ(estimate.counters.samples, count);
  EXPECT_EQ(estimate.counters.overruns, 0u);
  EXPECT_EQ(estimate.counters.violations, 0u);
  return estimate;
}

inline Estimate radiance(const EstimatorSource& sampler, const TransportScene& scene, const Ray& ray, std::size_t count,
                         bool general = false, std::uint64_t key = 1) {
  return sample(*make_path_kernel(sampler, scene, general), scene, ray, count, key);
}

inline void expect_mean(const Estimate& estimate, const Spectrum& expected) {
  for (Eigen::Index c = 0; c < expected.size(); ++c)
    EXPECT_LT(std::abs(estimate.mean[c] - expected[c]), kErrors * estimate.error[c] + 1e-12 * (1 + expected[c]))
        << "channel " << c << ": " << estimate.mean[c] << " +- " << estimate.error[c] << ", expected " << expected[c];
}

inline void expect_equal(const Estimate& a, const Estimate& b) {
  for (Eigen::Index c = 0; c < a.mean.size(); ++c)
    EXPECT_LT(std::abs(a.mean[c] - b.mean[c]), kErrors * std::hypot(a.error[c], b.error[c]) + 1e-12)
        << "channel " << c << ": " << a.mean[c] << " +- " << a.error[c] << " and " << b.mean[c] << " +- " << b.error[c];
}

inline const Ray kOblique = camera({-0.3, 0.2, 0.1}, {1, 0.4, 0.5});

}  // namespace nullmark::path_test
