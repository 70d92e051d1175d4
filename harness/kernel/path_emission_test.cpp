// What is emitted or lies behind the medium and arrives unscattered.

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "harness/kernel/optical_depth.h"
#include "harness/kernel/path_test.h"
#include "media/exponential.h"
#include "media/volumes/volume.h"

namespace nullmark {
namespace {

using namespace path_test;

TEST(PathEmission, AConstantEmitterHasItsClosedForm) {
  const Ray axis = camera({-1, 0.5, 0.5}, {1, 0, 0});
  for (const auto& medium : {homogeneous(1.2), along<ExponentialProfile>("x", {3, -2})})
    for (const bool general : {false, true}) {
      TransportScene scene = scene_of(medium, {});
      scene.emission.radiance = spectrum({5});
      scene.environment.radiance = spectrum({0.5});
      const Real transmittance = std::exp(-(*medium->optical_depth(context_of(scene, axis).local))[0]);
      const Estimate estimate = radiance(kDelta, scene, axis, 400000, general);
      expect_mean(estimate, spectrum({5 * (1 - transmittance) + 0.5 * transmittance}));
      EXPECT_NEAR(estimate.expected[0], 5 * (1 - transmittance) + 0.5 * transmittance, 1e-12);
    }
  TransportScene walled = scene_of(along<ExponentialProfile>("x", {3, -2}), {});
  walled.emission.radiance = spectrum({5});
  walled.surfaces = {{Plane{{0.3, 0, 0}, {1, 0, 0}}, spectrum({2})}};
  const Real seen = std::exp(1.5 * std::expm1(-0.6));
  for (const bool general : {false, true})
    expect_mean(radiance(kDelta, walled, axis, 400000, general), spectrum({5 * (1 - seen) + 2 * seen}));
  TransportScene scene = scene_of(times(bump(1), {0.5, 1, 4}), {});
  scene.emission.radiance = spectrum({1, 2, 3});
  scene.environment.radiance = spectrum({3, 0, 1});
  const Spectrum t = (-*scene.medium->optical_depth(context_of(scene, axis).local)).exp();
  for (const bool general : {false, true})
    expect_mean(radiance(kSpectral, scene, axis, 400000, general),
                scene.emission.radiance * (1 - t) + scene.environment.radiance * t);
}

/// mu = 3 e^(-2x) and L_e = 2 * 1.5 e^(2x - ...) in a smaller box: int mu L_e T by quadrature.
TEST(PathEmission, AFieldEmitsWithinItsOwnBoxByQuadrature) {
  const auto medium = along<ExponentialProfile>("x", {3, -2});
  const auto field = along<ExponentialProfile>("x", {1.5, 4}, {0.25, 0, 0}, {0.75, 1, 1});
  TransportScene scene = scene_of(medium, {});
  scene.emission = {spectrum({2}), field};
  scene.environment.radiance = spectrum({0.5});
  const auto depth = [](Real x) { return 1.5 * -std::expm1(-2 * x); };
  const Real emitted = boost::math::quadrature::gauss_kronrod<Real, 31>::integrate(
      [&](Real x) { return 3 * std::exp(-2 * x) * std::exp(-depth(x)) * 2 * 1.5 * std::exp(4 * (x - 0.25) / 0.5); }, 0.25, 0.75);
  for (const bool general : {false, true}) {
    const Estimate estimate = radiance(kDelta, scene, camera({-1, 0.5, 0.5}, {1, 0, 0}), 400000, general);
    expect_mean(estimate, spectrum({emitted + 0.5 * std::exp(-depth(1))}));
    EXPECT_TRUE(std::isnan(estimate.expected[0]));
  }
}

/// Against the same emitter seen through a scattering medium, where only unscattered emission is asked for.
TEST(PathEmission, ScatteringMediaEmitTheAbsorbedShareOnly) {
  struct Case {
    std::shared_ptr<const Medium> medium;
    Spectrum albedo, radiance;
    const EstimatorSource* sampler;
  };
  const Ray axis = camera({-1, 0.5, 0.5}, {1, 0, 0});
  for (const Case& one :
       {Case{bump(4), spectrum({0.3}), spectrum({5}), &kDelta}, Case{bump(4), spectrum({0.3}), spectrum({5}), &kSpectral},
        Case{homogeneous(4), spectrum({0.3}), spectrum({5}), &kDelta},
        Case{times(homogeneous(4), {0.2, 1}), spectrum({0.3, 0.8}), spectrum({5, 2}), &kSpectral},
        Case{times(bump(4), {0.2, 1}), spectrum({0.3, 0.8}), spectrum({5, 2}), &kSpectral}}) {
    TransportScene scene = scene_of(one.medium, one.albedo);
    scene.emission.radiance = one.radiance;
    scene.options.most_scatterings = 0;
    const Spectrum transmittance = (-*scene.medium->optical_depth(context_of(scene, axis).local)).exp();
    for (const bool general : {false, true})
      expect_mean(radiance(*one.sampler, scene, axis, 200000, general), (1 - one.albedo) * one.radiance * (1 - transmittance));
  }
}

/// Grids of one file with boxes of their own: heat glows through the density, int mu L_e T by Gauss points from knot to knot.
TEST(PathEmission, AGridOfHeatGlowsThroughAGridOfDensity) {
  const char* root = std::getenv("NULLMARK_DATA");
  if (!root) GTEST_SKIP() << "NULLMARK_DATA is not set: no folder that holds volumes/";
  const std::string file = std::string(root) + "/volumes/usd_densityAndHeat.vdb";
  const auto grid = [&](const char* name, Real scale) {
    return std::make_shared<FilteredVolume<TrilinearFilter>>(std::make_shared<const VolumeData>(read_vdb(file, name)), scale);
  };
  const auto density = grid("density", 1), heat = grid("heat", 1);
  const Affine to_world = density->world_to_local().inverse();
  const Box box = density->bounds();
  const Vec3 middle = to_world * ((box.lo + box.hi) / 2);
  const Real size = (to_world.linear() * box.extent()).norm();
  const auto thick = grid("density", 30 / size);
  TransportScene scene = scene_of(thick, {}, true);
  scene.emission = {spectrum({3}), heat};
  const Ray ray = camera(middle - size * Vec3(0.6, 0.5, 0.62).normalized(), Vec3(0.6, 0.5, 0.62));

  const Ray local = context_of(scene, ray).local;
  std::vector<Real> knots;
  sorted_knots(*thick, local, knots);
  const Ray within = clipped(transformed(ray, heat->world_to_local()), heat->bounds());
  heat->knots(within, knots);
  knots.insert(knots.end(), {within.begin, within.end});
  std::erase_if(knots, [&](Real t) { return t < local.begin || t > local.end; });
  std::sort(knots.begin(), knots.end());
  std::uint64_t reads = 0;
  Real exact = 0, depth = 0;
  for (std::size_t i = 1; i < knots.size(); ++i) {
    const auto part = [&](Real end) {
      return optical_depth(*thick, {local.origin, local.direction, knots[i - 1], end}).depth[0];
    };
    if (!(knots[i] > knots[i - 1])) continue;
    exact += boost::math::quadrature::gauss<Real, 7>::integrate(
        [&](Real t) {
          const Vec3 p = local.at(t);
          Real mu = 0;
          thick->extinction({&p.x(), &p.y(), &p.z(), 1}, &mu);
          return mu * std::exp(-depth - part(t)) * scene.emission.at<Real>(ray.at(t), 1, reads);
        },
        knots[i - 1], knots[i]);
    depth += part(knots[i]);
  }
  EXPECT_GT(depth, 0.5);
  EXPECT_GT(exact, 0.01);
  for (const bool general : {false, true}) expect_mean(radiance(kDelta, scene, ray, 200000, general), spectrum({exact}));

  scene.albedo = spectrum({0.8});
  scene.mean_cosine = 0.5;
  scene.environment.radiance = spectrum({1});
  scene.options.next_event = NextEvent::uniform;
  scene.towards_environment = kRatio.walkers();
  expect_equal(radiance(kDelta, scene, ray, 20000), radiance(kSpectral, scene, ray, 20000, true, 2));
}

/// Absorption alone: the samples are those of the estimator's transmittance, bit by bit, times what lies behind.
TEST(PathAbsorption, IsTheTransmittanceKernelTimesWhatLiesBehind) {
  const auto check = [](const EstimatorSource& estimator, TransportScene scene, Real behind, const Ray& ray, Real end) {
    const Estimate path = radiance(estimator, scene, ray, 3000);
    const auto kernel = estimator.kernel(scene.medium->channels());
    const Ray shortened{ray.origin, ray.direction, 0, end};
    PreparedRay context = context_of(scene, shortened);
    const auto workspace = kernel->workspace();
    SampleBlock block;
    Counters counters;
    // Lengths from the entry, as the path's flights have them.
    for (Ray* each : {&context.world, &context.local})
      *each = {each->at(each->begin), each->direction, 0, each->end - each->begin};
    context.bounds.start(*scene.majorant, context.world, context.local);
    if (kernel->needs_knots()) sorted_knots(*scene.medium, context.local, context.knots);
    kernel->begin_ray(*workspace, *scene.medium, scene.medium->extrema(scene.medium->bounds()), context);
    kernel->sample(*workspace, *scene.medium, context, 1, 0, 3000, Quantity::transmittance, block, counters);
    for (std::size_t i = 0; i < block.values.size(); ++i) ASSERT_EQ(path.values[i], behind * block.values[i]);
    EXPECT_EQ(path.counters.lookups, counters.lookups);
    EXPECT_EQ(path.counters.draws, counters.draws);
    EXPECT_GT(counters.lookups, 0u);
    EXPECT_NEAR(path.expected[0], behind * std::exp(-optical_depth(*scene.medium, context.local).depth[0]), 1e-12);
    expect_mean(path, path.expected);
  };
  TransportScene scene = scene_of(bump(2), {}, true);
  scene.environment.radiance = spectrum({3});
  check(kDelta, scene, 3, kOblique, kInfinity);
  check(kRatio, scene, 3, kOblique, kInfinity);
  scene.surfaces = {{Plane{{0.6, 0, 0}, {1, 0, 0}}, spectrum({7})}};
  check(kRatio, scene, 7, kOblique, 0.9 / kOblique.direction.x());
  scene.surfaces.push_back({Sphere{{-0.3, 0.2, 0.1}, 0.05}, {}});  // around the camera, black
  const Estimate dark = radiance(kRatio, scene, kOblique, 100);
  EXPECT_EQ(dark.mean[0], 0);
  EXPECT_EQ(dark.counters.lookups, 0u);
}

TEST(PathAbsorption, RaysThatMissTheMediumSeeWhatLiesBehind) {
  for (const Real albedo : {0., 0.5})
    for (const bool general : {false, true}) {
      TransportScene scene = scene_of(bump(2), spectrum({albedo}));
      scene.environment.radiance = spectrum({3});
      scene.surfaces = {{Sphere{{5, 0, 0}, 1}, spectrum({7})}};
      EXPECT_EQ(radiance(kDelta, scene, camera({-1, 3, 3}, {1, 0, 0}), 10, general).mean[0], 3);
      EXPECT_EQ(radiance(kDelta, scene, camera({3, 0, 0}, {1, 0, 0}), 10, general).mean[0], 7);
    }
}

}  // namespace
}  // namespace nullmark
