// Kernels of light paths: they agree, cost what a scene needs, and refuse what does not fit.

#include "harness/kernel/path_kernel.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "estimators/delta.h"
#include "estimators/ratio.h"
#include "estimators/regular.h"
#include "harness/kernel/estimator_template.h"
#include "harness/kernel/path_test.h"
#include "media/exponential.h"
#include "media/majorants/global.h"

namespace nullmark {
namespace path_test {

/// Collision probabilities from the history-aware average of what every channel carries [Kutz et al. 2017, Sec. 5]; on a grey
/// medium, analog tracking that draws absorption and scattering itself.
template <class Value>
struct SpectralTracking {
  static constexpr const char* kName = "test_spectral";
  static constexpr const char* kSummary = "spectral tracking";
  static constexpr const char* kSource = "Kutz et al. 2017, Sec. 5";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct RayData : MediumRay<Value> {
    Value throughput;
  };
  struct Walk {
    Event<Value> event;
  };

  void init(Walk& walk, const RayData& ray, Flight&, auto&) const { walk.event = {EventKind::escape, ray.end, ray.value(1)}; }
  bool propose(Walk& walk, const RayData&, Flight& flight, auto& rng) const {
    return !is_collision(walk.event.kind) && flight.next(rng);
  }
  void consume(Walk& walk, const RayData& ray, const Flight& at, const Value& extinction, auto& rng) const {
    const Value absorption = ray.draws_absorption ? Value(extinction * (1 - ray.albedo)) : ray.value(0);
    const Value scattering = extinction * ray.albedo, null = at.rate() - extinction;
    const auto carried = [&](const Value& mu) {
      Real sum = 0;
      for (int c = 0; c < ray.channels; ++c) sum += channel(walk.event.weight, c) * channel(ray.throughput, c) * channel(mu, c);
      return sum;
    };
    const Real a = carried(absorption), s = carried(scattering), n = carried(null);
    const Real u = rng.uniform() * (a + s + n);
    const auto choose = [&](EventKind kind, const Value& mu, Real share) {
      walk.event.kind = kind;
      walk.event.weight *= mu * ((a + s + n) / (share * at.rate()));
      if (kind != EventKind::escape) walk.event.distance = at.position();
    };
    if (u < a)
      choose(EventKind::absorb, absorption, a);
    else if (u < a + s)
      choose(EventKind::scatter, scattering, s);
    else
      choose(EventKind::escape, null, n);
  }
  /// Told by every walk that ended so.
  inline static std::uint64_t absorbed = 0;
  Event<Value> event(const Walk& walk, const RayData&, const Flight&) const {
    absorbed += walk.event.kind == EventKind::absorb;
    return walk.event;
  }
  Value result(const Walk& walk, const RayData& ray) const {
    return is_collision(walk.event.kind) ? ray.value(0) : walk.event.weight;
  }
  int real_collisions(const Walk& walk, const RayData&) const { return is_collision(walk.event.kind); }
};

const EstimatorTemplate<DeltaTracking> kDeltaTracking;
const EstimatorTemplate<SpectralTracking> kSpectralTracking;
const EstimatorTemplate<RatioTracking> kRatioTracking;

const EstimatorSource &kDelta = kDeltaTracking, &kSpectral = kSpectralTracking, &kRatio = kRatioTracking;

}  // namespace path_test

namespace {

using namespace path_test;

/// Every effect on and left out, by two samplers: the general kernel, the specialised one and another tracker agree.
TEST(PathKernel, GeneralAndSpecialisedKernelsAgree) {
  int run = 0;
  for (const bool constant : {false, true})
    for (const bool chromatic : {false, true})
      for (const bool emission : {false, true})
        for (const Real g : {0., 0.7})
          for (const bool surfaces : {false, true})
            for (const NextEvent next : {NextEvent::off, NextEvent::phase}) {
              const auto grey = constant ? homogeneous(4) : bump(8);
              TransportScene scene =
                  scene_of(chromatic ? times(grey, {0.4, 1}) : grey, chromatic ? spectrum({0.5, 0.9}) : spectrum({0.8}));
              const Eigen::Index channels = chromatic ? 2 : 1;
              scene.environment.radiance = Spectrum::LinSpaced(channels, 1, 2);
              if (emission) scene.emission = {Spectrum::Constant(channels, 0.7), along<ExponentialProfile>("y", {3, -1})};
              if (surfaces) scene.surfaces = {{Box{{0.6, 0.6, -1}, {0.9, 2, 0.4}}, Spectrum::Constant(channels, 4)}};
              scene.mean_cosine = g;
              scene.options.next_event = next;
              const EstimatorSource& sampler = chromatic ? static_cast<const EstimatorSource&>(kSpectral) : kDelta;
              const Estimate specialised = radiance(sampler, scene, kOblique, 20000, false, 5);
              expect_equal(specialised, radiance(sampler, scene, kOblique, 20000, true, 6));
              expect_equal(specialised, radiance(kSpectral, scene, kOblique, 20000, false, 7));
              ++run;
            }
  EXPECT_EQ(run, 64);
}

TEST(PathEffects, AreReadFromTheScene) {
  TransportScene scene = scene_of(homogeneous(1), {});
  EXPECT_EQ(effect_names(effects_of(scene)), std::vector<std::string>{"absorption"});
  scene.options.next_event = NextEvent::phase;
  scene.mean_cosine = 0.5;
  EXPECT_EQ(effect_names(effects_of(scene)), std::vector<std::string>{"absorption"});
  scene.albedo = spectrum({1});
  scene.emission.radiance = spectrum({1});
  EXPECT_EQ(effect_names(effects_of(scene)), (std::vector<std::string>{"scattering", "anisotropic"}));
  scene = scene_of(times(bump(1), {1, 2}), spectrum({0.5, 1}));
  scene.mean_cosine = 0.5;
  scene.emission.radiance = scene.environment.radiance = spectrum({0, 1});
  scene.surfaces.emplace_back();
  scene.options.next_event = NextEvent::uniform;
  EXPECT_EQ(effects_of(scene), Effects{});
}

/// What a scene leaves out is in neither lookups nor draws.
TEST(PathEffects, LeftOutOnesCostNothing) {
  const auto cost = [](const EstimatorSource& sampler, const TransportScene& scene) {
    return radiance(sampler, scene, kOblique, 5000).counters;
  };
  TransportScene scene = scene_of(homogeneous(2), {});
  scene.environment.radiance = spectrum({1});
  Counters counters = cost(kDelta, scene);  // absorption in closed form
  EXPECT_EQ(counters.lookups + counters.draws, 0u);

  scene.emission.radiance = spectrum({1});  // one flight in closed form, nothing to choose
  counters = cost(kDelta, scene);
  EXPECT_EQ(counters.lookups, 0u);
  EXPECT_EQ(counters.draws, counters.samples);

  scene = scene_of(bump(2), {});  // one flight: the draws and lookups of transmittance
  scene.environment.radiance = spectrum({1});
  const Counters transmittance = cost(kDelta, scene);
  scene.emission.radiance = spectrum({1});
  counters = cost(kDelta, scene);
  EXPECT_EQ(counters.lookups, transmittance.lookups);
  EXPECT_EQ(counters.null_collisions, transmittance.null_collisions);
  EXPECT_EQ(counters.draws, transmittance.draws);
  scene.emission.field = homogeneous(1);  // and one read of the field where it was absorbed
  counters = cost(kDelta, scene);
  EXPECT_EQ(counters.lookups, 2 * transmittance.lookups - transmittance.null_collisions);

  // Scattering in closed form: one draw a flight, two a direction, none for absorption, anisotropy, surfaces or next events.
  scene = scene_of(homogeneous(2), spectrum({0.5}));
  scene.environment.radiance = spectrum({1});
  scene.options.roulette_from.reset();
  scene.options.most_scatterings = 1;
  for (const Real g : {0., 0.5}) {
    scene.mean_cosine = g;
    const Estimate estimate = radiance(kDelta, scene, kOblique, 5000);
    // First flights, directions and second flights of those that collided: all samples of one path each draw 1 or 4 numbers.
    EXPECT_EQ(estimate.counters.lookups, 0u);
    EXPECT_EQ((estimate.counters.draws - estimate.counters.samples) % 3, 0u);
    EXPECT_LT(estimate.counters.draws, 4 * estimate.counters.samples);
  }
  // Samplers that tell absorption apart do so only where it emits.
  std::uint64_t& absorbed = SpectralTracking<Real>::absorbed;
  scene = scene_of(bump(2), spectrum({0.5}));
  absorbed = 0;
  cost(kSpectral, scene);
  EXPECT_EQ(absorbed, 0u);
  scene.emission.radiance = spectrum({1});
  cost(kSpectral, scene);
  EXPECT_GT(absorbed, 0u);

  // The general kernel draws between absorption and scattering, and looks constant extinction up.
  scene = scene_of(homogeneous(2), spectrum({0.5}));
  scene.options.most_scatterings = 0;
  counters = cost(kDelta, scene);
  EXPECT_EQ(counters.draws, counters.samples);
  counters = radiance(kDelta, scene, kOblique, 5000, true).counters;
  EXPECT_GT(counters.lookups, 0u);
  EXPECT_GT(counters.draws, counters.samples + counters.lookups);
}

TEST(PathKernel, SamplesDependOnTheirAddressAlone) {
  TransportScene scene = scene_of(bump(6), spectrum({0.9}), true);
  scene.environment.radiance = spectrum({1});
  scene.mean_cosine = 0.5;
  scene.options.next_event = NextEvent::phase;
  const auto kernel = make_path_kernel(kDelta, scene);
  const Extrema extrema = scene.medium->extrema(scene.medium->bounds());
  const PreparedRay context = context_of(scene, kOblique, 3), another = context_of(scene, camera({0.5, 0.5, -1}, {0, 0.1, 1}), 4);
  SampleBlock whole, part;
  Counters counters, again;
  const auto workspace = kernel->workspace(), used = kernel->workspace();
  kernel->begin_ray(*workspace, *scene.medium, extrema, context);
  kernel->sample(*workspace, *scene.medium, context, 9, 100, 50, Quantity::transmittance, whole, counters);
  kernel->begin_ray(*used, *scene.medium, extrema, another);
  kernel->sample(*used, *scene.medium, another, 9, 0, 7, Quantity::transmittance, part, again);
  kernel->begin_ray(*used, *scene.medium, extrema, context);
  for (const std::uint64_t i : {149u, 100u, 123u}) {
    kernel->sample(*used, *scene.medium, context, 9, i, 1, Quantity::transmittance, part, again);
    EXPECT_EQ(part.values[0], whole.values[i - 100]);
    EXPECT_EQ(part.lookups[0], whole.lookups[i - 100]);
  }
}

/// Endless paths are given up and counted, or stop when asked to.
TEST(PathKernel, PathsThatDoNotEndAreOverruns) {
  TransportScene scene = scene_of(homogeneous(1e6), spectrum({1}));
  scene.environment.radiance = spectrum({1});
  scene.options.most_events = 1000;
  for (const bool general : {false, true}) {
    const auto kernel = make_path_kernel(kDelta, scene, general);
    const auto workspace = kernel->workspace();
    const PreparedRay context = context_of(scene, camera({0.5, 0.5, 0.5}, {1, 0, 0}));
    kernel->begin_ray(*workspace, *scene.medium, scene.medium->extrema(scene.medium->bounds()), context);
    SampleBlock block;
    Counters counters;
    kernel->sample(*workspace, *scene.medium, context, 1, 0, 8, Quantity::transmittance, block, counters);
    EXPECT_EQ(counters.overruns, 8u);
    scene.options.most_events = std::uint64_t{1} << 60;
    const auto endless = make_path_kernel(kDelta, scene, general);
    const auto other = endless->workspace();
    other->stop = [] { return true; };
    endless->begin_ray(*other, *scene.medium, scene.medium->extrema(scene.medium->bounds()), context);
    counters = {};
    endless->sample(*other, *scene.medium, context, 1, 0, 8, Quantity::transmittance, block, counters);
    EXPECT_EQ(counters.overruns, 0u);
    scene.options.most_events = 1000;
  }
}

TEST(PathKernel, ViolatedMajorantsAreCounted) {
  TransportScene scene = scene_of(bump(4), spectrum({0.5}));
  scene.majorant = std::make_shared<GlobalMajorant>(*scene.medium, 0.5);
  scene.environment.radiance = spectrum({1});
  const auto kernel = make_path_kernel(kDelta, scene);
  const auto workspace = kernel->workspace();
  const PreparedRay context = context_of(scene, kOblique);
  kernel->begin_ray(*workspace, *scene.medium, scene.medium->extrema(scene.medium->bounds()), context);
  SampleBlock block;
  Counters counters;
  kernel->sample(*workspace, *scene.medium, context, 1, 0, 1000, Quantity::transmittance, block, counters);
  EXPECT_GT(counters.violations, 0u);
  EXPECT_GT(counters.largest_violation, 1.5);
  EXPECT_LE(counters.largest_violation, 2.0000001);
}

TEST(PathKernel, ScenesThatDoNotFitAreRefused) {
  const auto refused = [](const EstimatorSource& estimator, const TransportScene& scene) {
    try {
      make_path_kernel(estimator, scene);
    } catch (const ParameterError& error) {
      return error.parameter;
    }
    return std::string("nothing");
  };
  const TransportScene good = scene_of(bump(1), spectrum({0.5}));
  EXPECT_EQ(refused(kDelta, good), "nothing");
  EXPECT_EQ(refused(kRatio, good), "type");
  EXPECT_EQ(refused(kRatio, scene_of(bump(1), {})), "nothing");
  EXPECT_EQ(refused(EstimatorTemplate<RegularTracking>(), scene_of(bump(1), {})), "type");
  EXPECT_EQ(refused(kRatio, scene_of(homogeneous(1), spectrum({0.5}))), "nothing");
  EXPECT_EQ(refused(kDelta, scene_of(times(bump(1), {1, 2}), spectrum({0.5, 0.5}))), "type");
  const auto but = [&](const auto& change) {
    TransportScene scene = good;
    change(scene);
    return refused(kDelta, scene);
  };
  EXPECT_EQ(but([](TransportScene& s) { s.albedo = spectrum({0.5, 0.5}); }), "albedo");
  EXPECT_EQ(but([](TransportScene& s) { s.albedo = spectrum({1.5}); }), "albedo");
  EXPECT_EQ(but([](TransportScene& s) { s.mean_cosine = 1; }), "g");
  EXPECT_EQ(but([](TransportScene& s) { s.emission.radiance = spectrum({-1}); }), "emission");
  EXPECT_EQ(but([](TransportScene& s) { s.emission = {spectrum({1}), times(bump(1), {1, 2})}; }), "emission");
  EXPECT_EQ(but([](TransportScene& s) { s.environment.radiance = spectrum({1, 2}); }), "environment");
  EXPECT_EQ(but([](TransportScene& s) { s.surfaces = {{Plane{}, spectrum({1, 2})}}; }), "surfaces");
  EXPECT_EQ(but([](TransportScene& s) { s.options.roulette_floor = 0; }), "roulette_floor");
  EXPECT_EQ(but([](TransportScene& s) { s.options.roulette_from = -1; }), "roulette_from");
  EXPECT_EQ(but([](TransportScene& s) { s.options.most_scatterings = -1; }), "most_scatterings");
}

}  // namespace
}  // namespace nullmark
