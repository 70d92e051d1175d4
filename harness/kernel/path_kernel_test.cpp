// Oracles of radiance: furnaces, closed forms, quadrature, reciprocity.  Means are compared within 5 standard errors (6e-7 a
// comparison, two-sided normal; about 700 of them, so 4e-4 for the file, at fixed seeds), the error being the samples' own.

#include "harness/kernel/path_kernel.h"

#include <gtest/gtest.h>

#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cstdlib>
#include <numbers>

#include "estimators/delta.h"
#include "estimators/ratio.h"
#include "estimators/regular.h"
#include "harness/kernel/estimator_template.h"
#include "harness/registry/register_estimator.h"
#include "media/base/channels.h"
#include "media/exponential.h"
#include "media/gaussian_bump.h"
#include "media/homogeneous.h"
#include "media/linear.h"
#include "media/majorants/global.h"
#include "media/majorants/grid.h"
#include "media/volumes/volume.h"

namespace nullmark {
namespace path_kernel_test {

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

}  // namespace path_kernel_test

namespace {

constexpr Real kPi = std::numbers::pi, kErrors = 5;

const EstimatorTemplate<DeltaTracking> kDelta;
const EstimatorTemplate<path_kernel_test::SpectralTracking> kSpectral;
const EstimatorTemplate<RatioTracking> kRatio;

std::shared_ptr<const Medium> homogeneous(Real extinction, const Vec3& lo = Vec3::Zero(), const Vec3& hi = Vec3::Ones()) {
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
  field.prepare();
  return std::make_shared<FieldMedium<AlongAxis<Profile>>>(field);
}

std::shared_ptr<const Medium> bump(Real amplitude) { return along<GaussianBumpProfile>("x", {amplitude, {0.4, 0.2}}); }

std::shared_ptr<const Medium> times(std::shared_ptr<const Medium> grey, const std::vector<Real>& spectrum) {
  return std::make_shared<Spectral>(std::move(grey), spectrum);
}

Spectrum spectrum(std::initializer_list<Real> values) {
  return Eigen::Map<const Spectrum>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

TransportScene scene_of(std::shared_ptr<const Medium> medium, const Spectrum& albedo, bool grid = false) {
  TransportScene scene;
  if (grid)
    scene.majorant = std::make_shared<GridMajorant>(*medium, std::array{4, 4, 4}, 1);
  else
    scene.majorant = std::make_shared<GlobalMajorant>(*medium, 1.3);
  scene.medium = std::move(medium);
  scene.albedo = albedo;
  return scene;
}

Ray camera(const Vec3& from, const Vec3& direction) { return {from, direction.normalized(), 0, kInfinity}; }

PreparedRay context_of(const TransportScene& scene, const Ray& ray, std::uint32_t index = 0) {
  PreparedRay context;
  context.world = ray;
  context.local = clipped(transformed(ray, scene.medium->world_to_local()), scene.medium->bounds());
  context.world.begin = context.local.begin;
  context.world.end = context.local.end;
  context.index = index;
  scene.majorant->segments(context.world, context.local, context.segments);
  return context;
}

struct Estimate {
  Spectrum mean, error, expected;
  std::vector<Real> values;
  Counters counters;
};

Estimate sample(const Kernel& kernel, const TransportScene& scene, const Ray& ray, std::size_t count, std::uint64_t key = 1) {
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

Estimate radiance(const EstimatorSource& sampler, const TransportScene& scene, const Ray& ray, std::size_t count,
                  bool general = false, std::uint64_t key = 1) {
  return sample(*make_path_kernel(sampler, scene, general), scene, ray, count, key);
}

void expect_mean(const Estimate& estimate, const Spectrum& expected) {
  for (Eigen::Index c = 0; c < expected.size(); ++c)
    EXPECT_LT(std::abs(estimate.mean[c] - expected[c]), kErrors * estimate.error[c] + 1e-12 * (1 + expected[c]))
        << "channel " << c << ": " << estimate.mean[c] << " +- " << estimate.error[c] << ", expected " << expected[c];
}

void expect_equal(const Estimate& a, const Estimate& b) {
  for (Eigen::Index c = 0; c < a.mean.size(); ++c)
    EXPECT_LT(std::abs(a.mean[c] - b.mean[c]), kErrors * std::hypot(a.error[c], b.error[c]) + 1e-12)
        << "channel " << c << ": " << a.mean[c] << " +- " << a.error[c] << " and " << b.mean[c] << " +- " << b.error[c];
}

const Ray kOblique = camera({-0.3, 0.2, 0.1}, {1, 0.4, 0.5});

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
      for (const NextEvent next : {NextEvent::off, NextEvent::phase, NextEvent::uniform})
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
    for (const NextEvent next : {NextEvent::off, NextEvent::phase, NextEvent::uniform})
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
        for (const NextEvent next : {NextEvent::off, NextEvent::uniform})
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
    scene.majorant->segments(context.world, context.local, context.segments);
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
      for (const NextEvent next : {NextEvent::off, NextEvent::phase, NextEvent::uniform})
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
  std::uint64_t& absorbed = path_kernel_test::SpectralTracking<Real>::absorbed;
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
