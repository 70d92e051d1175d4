// Scattered light against quadrature, bounds and reciprocity.

#include <gtest/gtest.h>

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "estimators/transport/phase.h"
#include "harness/kernel/path_test.h"
#include "harness/registry/register_estimator.h"
#include "media/exponential.h"
#include "media/linear.h"

namespace nullmark {
namespace {

using namespace path_test;

/// A wide slab seen along its normal: int_0^1 mu_s T(0,z) 2 pi int p(m) T(z, m) dm dz, p the phase function at cosine m to the
/// axis.
Real singly_scattered(const std::function<Real(Real)>& extinction, const std::function<Real(Real)>& depth, Real albedo, Real g) {
  using Rule = boost::math::quadrature::gauss_kronrod<Real, 61>;
  const HenyeyGreenstein phase(g);
  return Rule::integrate(
      [&](Real z) {
        const auto towards = [&](Real m) {
          const Real path = m > 0 ? (depth(1) - depth(z)) / m : depth(z) / -m;
          return phase.value(Vec3::UnitZ(), {std::sqrt(1 - m * m), 0, m}) * std::exp(-path);
        };
        return albedo * extinction(z) * std::exp(-depth(z)) * 2 * kPi *
               (Rule::integrate(towards, -1., 0., 12, 1e-10) + Rule::integrate(towards, 0., 1., 12, 1e-10));
      },
      0., 1., 12, 1e-9);
}

TEST(PathScattering, SingleScatteringInASlabMeetsQuadrature) {
  const Vec3 lo(-1e4, -1e4, 0), hi(1e4, 1e4, 1);
  const Ray axis = camera({0.1, 0.2, -1}, {0, 0, 1});
  struct Slab {
    std::shared_ptr<const Medium> medium;
    std::function<Real(Real)> extinction, depth;
  };
  const std::vector<Slab> slabs = {{homogeneous(1.5, lo, hi), [](Real) { return 1.5; }, [](Real z) { return 1.5 * z; }},
                                   {along<ExponentialProfile>("z", {3, -2}, lo, hi), [](Real z) { return 3 * std::exp(-2 * z); },
                                    [](Real z) { return -1.5 * std::expm1(-2 * z); }}};
  for (const Slab& slab : slabs)
    for (const Real g : {0., 0.6})
      for (const NextEvent next : {NextEvent::off, NextEvent::phase, NextEvent::uniform, NextEvent::mis})
        for (const bool general : {false, true}) {
          TransportScene scene = scene_of(slab.medium, spectrum({0.4}));
          scene.environment.radiance = spectrum({2});
          scene.mean_cosine = g;
          scene.options = {.next_event = next, .roulette_from = 1, .most_scatterings = 1};
          const Real exact = std::exp(-slab.depth(1)) + singly_scattered(slab.extinction, slab.depth, 0.4, g);
          const Estimate estimate = radiance(kDelta, scene, axis, 100000, general);
          expect_mean(estimate, spectrum({2 * exact}));
          EXPECT_TRUE(std::isnan(estimate.expected[0]));
        }
}

/// Every registered sampler of free paths that claims to be honest, on a grey and a chromatic slab it can walk.
TEST(PathScattering, EveryHonestSamplerMeetsSingleScattering) {
  const Vec3 lo(-1e4, -1e4, 0), hi(1e4, 1e4, 1);
  const std::vector<Real> factors = {0.4, 1, 2};
  const Spectrum albedos = spectrum({0.9, 0.4, 0.7});
  LinearProfile profile;
  profile.begin = 2;
  profile.end = 0.5;
  const auto grey = along<LinearProfile>("z", profile, lo, hi);
  const auto exact = [&](Real factor, Real albedo) {
    const auto depth = [=](Real z) { return factor * (2 * z - 0.75 * z * z); };
    return std::exp(-depth(1)) + singly_scattered([=](Real z) { return factor * (2 - 1.5 * z); }, depth, albedo, 0.6);
  };
  int walked = 0;
  for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries()) {
    if (entry.foreign) continue;
    const auto estimator = entry.make();
    const Guarantee claim = estimator->claim(Quantity::free_path);
    if (entry.planted || (claim != Guarantee::exact && claim != Guarantee::unbiased)) continue;
    for (const bool chromatic : {false, true}) {
      TransportScene scene = scene_of(chromatic ? times(grey, factors) : grey, chromatic ? albedos : spectrum({0.4}), true);
      scene.mean_cosine = 0.6;
      scene.environment.radiance = Spectrum::Ones(scene.medium->channels());
      scene.options = {.next_event = NextEvent::phase, .most_scatterings = 1};
      if (!why_no_paths(*estimator, scene).empty()) continue;
      SCOPED_TRACE(entry.name + (chromatic ? ", chromatic" : ""));
      Spectrum expected(scene.medium->channels());
      for (Eigen::Index c = 0; c < expected.size(); ++c)
        expected[c] = chromatic ? exact(factors[static_cast<std::size_t>(c)], albedos[c]) : exact(1, 0.4);
      for (const bool emits : {false, true}) {  // absorption left to weights, or drawn
        if (emits) scene.emission.radiance = scene.environment.radiance * 1e-9;
        expect_mean(radiance(*estimator, scene, camera({0.1, 0.2, -1}, {0, 0, 1}), 40000), expected);
      }
      ++walked;
    }
  }
  RecordProperty("walked", walked);
  EXPECT_GE(walked, 1);
}

/// A phase function so narrow that uniform directions all but never meet it: these would give about .2 of what is scattered.
TEST(PathScattering, NarrowPhaseFunctionsMeetNextEventsByMis) {
  const Vec3 lo(-1e4, -1e4, 0), hi(1e4, 1e4, 1);
  TransportScene scene = scene_of(homogeneous(1.5, lo, hi), spectrum({1}));
  scene.environment.radiance = spectrum({1});
  for (const Real g : {0.999, -0.999}) {
    scene.mean_cosine = g;
    scene.options = {.next_event = NextEvent::mis, .roulette_from = {}, .most_scatterings = {}};
    const Estimate all = radiance(kDelta, scene, camera({0.1, 0.2, -1}, {0, 0, 1}), 20000);
    expect_mean(all, spectrum({1}));
    EXPECT_LT(all.error[0], 0.01) << g;
    scene.options.most_scatterings = 1;
    const Estimate once = radiance(kDelta, scene, camera({0.1, 0.2, -1}, {0, 0, 1}), 20000);
    // Scattered straight on or straight back, which the lobe's width changes by less than a hundredth.
    const Real straight = g > 0 ? std::exp(-1.5) * 1.5 : -std::expm1(-3) / 2;
    EXPECT_NEAR(once.mean[0] / (std::exp(-1.5) + straight), 1, 0.03) << g;
  }
}

/// Without a limit, all orders at albedo a lie between the first order and a geometric bound: what is scattered n times is at
/// most a^n times the environment.
TEST(PathScattering, AllOrdersApproachSingleScatteringForSmallAlbedos) {
  const Vec3 lo(-1e4, -1e4, 0), hi(1e4, 1e4, 1);
  TransportScene scene = scene_of(homogeneous(1.5, lo, hi), spectrum({0.05}));
  scene.environment.radiance = spectrum({1});
  const Real first = singly_scattered([](Real) { return 1.5; }, [](Real z) { return 1.5 * z; }, 0.05, 0);
  const Estimate estimate = radiance(kDelta, scene, camera({0, 0, -1}, {0, 0, 1}), 400000);
  EXPECT_GT(estimate.mean[0] + kErrors * estimate.error[0], std::exp(-1.5) + first);
  EXPECT_LT(estimate.mean[0] - kErrors * estimate.error[0], std::exp(-1.5) + first + 0.05 * 0.05 / (1 - 0.05));
}

/// Power that leaves a black sphere and arrives at another is the same both ways, per emitted radiance, through any medium.
TEST(PathScattering, PowerExchangeBetweenSpheresIsReciprocal) {
  const Sphere one{{0.2, 0.3, 0.25}, 0.15}, other{{0.75, 0.7, 0.65}, 0.25};
  for (const bool general : {false, true}) {
    const auto power = [&](const Sphere& from, const Sphere& to, std::uint64_t key) {
      TransportScene scene = scene_of(bump(3), spectrum({0.9}), true);
      scene.mean_cosine = 0.6;
      scene.surfaces = {{from, spectrum({1})}, {to, {}}};
      const auto kernel = make_path_kernel(kDelta, scene, general);
      const auto workspace = kernel->workspace();
      const Extrema extrema = scene.medium->extrema(scene.medium->bounds());
      Estimate sum;
      sum.mean = sum.error = Spectrum::Zero(1);
      constexpr std::uint32_t kRays = 200000;
      SampleBlock block;
      for (std::uint32_t i = 0; i < kRays; ++i) {
        Rng rng(SampleAddress{key, i, 0});
        const Vec3 normal = Isotropic{}.sample(Vec3::UnitZ(), rng);
        const Vec3 lambert = (normal + Isotropic{}.sample(Vec3::UnitZ(), rng)).normalized();  // cosine-weighted
        const PreparedRay context = context_of(scene, camera(to.center + to.radius * normal, lambert), i);
        kernel->begin_ray(*workspace, *scene.medium, extrema, context);
        kernel->sample(*workspace, *scene.medium, context, key + 1, 0, 1, Quantity::transmittance, block, sum.counters);
        sum.mean[0] += block.values[0] / kRays;
        sum.error[0] += block.values[0] * block.values[0] / kRays;
      }
      const Real area = 4 * kPi * to.radius * to.radius;
      sum.error[0] = area * std::sqrt((sum.error[0] - sum.mean[0] * sum.mean[0]) / kRays);
      sum.mean *= area;
      return sum;
    };
    const Estimate forth = power(one, other, 11), back = power(other, one, 23);
    expect_equal(forth, back);
    EXPECT_LT(forth.error[0], 0.03 * forth.mean[0]);
  }
}

}  // namespace
}  // namespace nullmark
