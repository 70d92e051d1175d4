// Scenes whose radiance is the same everywhere, whatever the light meets in them.

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "harness/kernel/path_test.h"
#include "media/base/channels.h"

namespace nullmark {
namespace {

using namespace path_test;

/// Where nothing is absorbed and the same radiance comes from everywhere, every path brings exactly that, whatever the medium.
TEST(PathFurnace, EveryPathOfAGreyMediumBringsTheEnvironmentExactly) {
  for (const auto& medium : {homogeneous(3), bump(8)})
    for (const Real g : {0., 0.8, -0.5})
      for (const bool grid : {false, true}) {
        TransportScene scene = scene_of(medium, spectrum({1}), grid);
        scene.environment.radiance = spectrum({2.5});
        scene.mean_cosine = g;
        for (const EstimatorSource* sampler :
             {static_cast<const EstimatorSource*>(&kDelta), static_cast<const EstimatorSource*>(&kSpectral)}) {
          const Estimate estimate = radiance(*sampler, scene, kOblique, 2000);
          // Weights of the spectral tracker are 1 up to rounding.
          const Real rounding = sampler == &kDelta ? 0 : 1e-12;
          for (const Real value : estimate.values) ASSERT_NEAR(value, 2.5, rounding);
          EXPECT_EQ(estimate.expected[0], 2.5);
          EXPECT_GT(estimate.counters.draws, 3 * estimate.counters.samples);
        }
      }
}

TEST(PathFurnace, NextEventsAndRouletteKeepTheMean) {
  for (const auto& medium : {homogeneous(3), bump(8)})
    for (const Real g : {0., 0.8})
      for (const NextEvent next : {NextEvent::off, NextEvent::phase, NextEvent::uniform, NextEvent::mis})
        for (const bool general : {false, true}) {
          TransportScene scene = scene_of(medium, spectrum({1}));
          scene.environment.radiance = spectrum({1});
          scene.mean_cosine = g;
          scene.options.next_event = next;
          scene.options.roulette_from = 0;
          scene.towards_environment = kRatio.walkers();
          expect_mean(radiance(kDelta, scene, kOblique, 50000, general), spectrum({1}));
        }
}

TEST(PathFurnace, ChromaticMediaKeepTheMeanOfEveryChannel) {
  const auto channels =
      std::make_shared<PerChannel>(std::vector<std::shared_ptr<const Medium>>{homogeneous(0.5), bump(3), bump(1)});
  for (const std::shared_ptr<const Medium>& medium :
       {times(homogeneous(1.5), {0.3, 1, 2}), times(bump(2), {1, 0.5, 2}), std::shared_ptr<const Medium>(channels)})
    for (const NextEvent next : {NextEvent::off, NextEvent::phase, NextEvent::uniform, NextEvent::mis})
      for (const bool general : {false, true}) {
        TransportScene scene = scene_of(medium, spectrum({1, 1, 1}));
        scene.environment.radiance = spectrum({1, 2, 3});
        scene.mean_cosine = 0.5;
        scene.options.next_event = next;
        scene.towards_environment = kRatio.walkers();
        const Estimate estimate = radiance(kSpectral, scene, kOblique, 50000, general);
        expect_mean(estimate, scene.environment.radiance);
        EXPECT_TRUE((estimate.expected == scene.environment.radiance).all());
        // Balanced over the channels, every path carries the mean throughput 1 to its end.
        if (next != NextEvent::off) continue;
        for (std::size_t i = 0; i < estimate.values.size(); i += 3)
          ASSERT_NEAR(estimate.values[i] + estimate.values[i + 1] / 2 + estimate.values[i + 2] / 3, 3, 1e-9);
      }
}

/// In thermal equilibrium radiance is the same everywhere, whatever scatters and absorbs it: sees emission, the split between
/// absorption and scattering, surfaces and next events at once.
TEST(PathFurnace, EquilibriumIsKeptByEveryKernel) {
  struct Case {
    std::shared_ptr<const Medium> medium;
    Spectrum albedo, radiance;
    const EstimatorSource* sampler;
  };
  const std::vector<Case> cases = {
      {homogeneous(3), spectrum({0.7}), spectrum({2}), &kDelta},
      {bump(8), spectrum({0.7}), spectrum({2}), &kDelta},
      {bump(8), spectrum({0.7}), spectrum({2}), &kSpectral},
      {bump(8), spectrum({0}), spectrum({2}), &kDelta},
      {times(homogeneous(1.5), {0.3, 1, 2}), spectrum({0.9, 0.5, 0}), spectrum({1, 2, 3}), &kSpectral},
      {times(bump(3), {0.3, 1, 2}), spectrum({0.9, 0.5, 1}), spectrum({1, 2, 3}), &kSpectral}};
  for (const Case& one : cases)
    for (const Real g : {0., 0.6})
      for (const bool surfaces : {false, true})
        for (const NextEvent next : {NextEvent::off, NextEvent::uniform, NextEvent::mis})
          for (const bool general : {false, true}) {
            TransportScene scene = scene_of(one.medium, one.albedo, true);
            scene.environment.radiance = scene.emission.radiance = one.radiance;
            scene.mean_cosine = g;
            scene.options = {.next_event = next, .roulette_from = 1};
            if (surfaces)
              scene.surfaces = {{Sphere{{0.5, 0.5, 0.9}, 0.2}, one.radiance}, {Plane{{0, -0.1, 0}, {0, 1, 0}}, one.radiance}};
            const Estimate estimate = radiance(*one.sampler, scene, kOblique, 20000, general);
            expect_mean(estimate, one.radiance);
            EXPECT_TRUE((estimate.expected - one.radiance).abs().maxCoeff() < 1e-12);
          }
}

}  // namespace
}  // namespace nullmark
