// Laws and theory of free-path samplers, and what must hold for every single weight.

#include "estimators/sampler_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "estimators/analog_decomposition.h"
#include "estimators/closed_form.h"
#include "estimators/delta.h"
#include "estimators/hero_wavelength.h"
#include "estimators/marching_inversion.h"
#include "estimators/multi_volume.h"
#include "estimators/null_collision.h"
#include "estimators/planted/weighted.h"
#include "estimators/regular_inversion.h"
#include "estimators/spectral.h"
#include "estimators/weighted_decomposition.h"
#include "estimators/weighted_delta.h"
#include "harness/kernel/estimator_template.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "media/base/channels.h"
#include "media/base/sum.h"
#include "media/cosine.h"
#include "media/homogeneous.h"
#include "media/layers.h"
#include "media/polynomial.h"

namespace nullmark {
namespace {

using namespace sampler_test;

std::vector<std::shared_ptr<const Medium>> grey_media() {
  return {constant(1.3), linear(0.2, 2.5), linear(2, 0), rising_exponential(3, -2)};
}

template <template <class> class E>
void expect_grey_law(auto set, std::initializer_list<Real> looseness = {1, 3}, int most_pieces = 4) {
  std::size_t which = 0;
  for (const auto& medium : grey_media())
    for (const Real loose : looseness)
      for (const int pieces : {1, most_pieces}) {
        SCOPED_TRACE(std::string(E<Real>::kName) + " on medium " + std::to_string(which++));
        HandWalked<E> walked(with<E>(set), medium, 1, loose, pieces);
        walked.ray.albedo = 0.3;
        walked.prepare();
        expect_law(walked, 60000);
        expect_theory(walked, 60000);
      }
}

TEST(Sampler, GreyTrackersKeepTheLawOfFreePaths) {
  expect_grey_law<DeltaTracking>(kDefault);
  expect_grey_law<WeightedDeltaTracking>(kDefault, {1, 3, 0.7});
  expect_grey_law<AnalogDecompositionTracking>(kDefault);
  expect_grey_law<AnalogDecompositionTracking>([](auto& e) { e.factor = 0.5; });
  expect_grey_law<WeightedDecompositionTracking>(kDefault, {1, 3, 0.8});
  expect_grey_law<WeightedDecompositionTracking>([](auto& e) { e.control = "average"; });
  expect_grey_law<WeightedDecompositionTracking>([](auto& e) {
    e.control = "given";
    e.controls = {0.1, 0.15};
  });
  expect_grey_law<SpectralTracking>(kDefault, {1, 3, 0.7});
  expect_grey_law<SpectralTracking>([](auto& e) { e.control = SpectralControl::minimum; }, {1, 3, 0.7});
  expect_grey_law<HeroWavelengthTracking>(kDefault);
  expect_grey_law<NullCollisionTracking>(kDefault, {1, 3, 0.7});
  expect_grey_law<NullCollisionTracking>([](auto& e) { e.roulette = "three"; }, {1, 0.7});
  expect_grey_law<NullCollisionTracking>([](auto& e) { e.probabilities = "fixed"; }, {1, 0.7});
  expect_grey_law<NullCollisionTracking>([](auto& e) {
    e.probabilities = "fixed";
    e.roulette = "three";
    e.null = 0.9;
  });
}

/// Those that need a bound see min(mu, mub) without one, and say so.
TEST(Sampler, TheoryHoldsWhereTheMajorantIsViolated) {
  for (const Real looseness : {0.6, 0.8}) {
    const HandWalked<AnalogDecompositionTracking> analog({}, linear(0.5, 1.5), 1, looseness);
    EXPECT_GT(*analog.theory().mean, 1.02 * analog.transmittance(1));
    expect_theory(analog);
    const HandWalked<HeroWavelengthTracking, Spectrum> hero(
        {}, std::make_shared<Spectral>(linear(0.5, 1.5), std::vector<Real>{1, 0.5}), 1, looseness);
    EXPECT_GT(*hero.theory(0).mean, 1.02 * hero.transmittance(1)[0]);
    expect_theory(hero);
  }
}

TEST(Sampler, RegularInversionKeepsTheLawOfFreePaths) {
  Polynomial cubic;
  cubic.profile.coefficients = {1, -1, 0.5, 0.2};
  Layers layers;
  layers.profile.values = {0.2, 3, 0, 1};
  for (const auto& medium : {constant(1.3), linear(0.2, 2.5), linear(2, 0), built(cubic), built(layers)}) {
    const HandWalked<RegularInversion> walked({}, medium, 1);
    expect_law(walked);
    expect_theory(walked, 100000);
    for (std::uint64_t i = 0; i < 1000; ++i) {
      const auto event = walked.walk(i).event;
      Rng rng(SampleAddress{20170701, 0, i});
      if (event.kind == EventKind::collision) {
        EXPECT_NEAR(-std::log(walked.transmittance(event.distance)), rng.exponential(), 1e-13);
      }
    }
  }
}

TEST(Sampler, ClosedFormInversionIsExact) {
  Cosine cosine;
  cosine.target_depth = 2;
  for (const auto& medium : {constant(1.3), linear(0.2, 2.5), linear(2, 0), linear(0, 1), rising_exponential(3, -2),
                             rising_exponential(0.01, 6), rising_exponential(2, 0), built(cosine)}) {
    const HandWalked<ClosedForm> walked({}, medium, 1);
    int escaped = 0;
    for (std::uint64_t i = 0; i < 2000; ++i) {
      Rng rng(SampleAddress{20170701, 0, i});
      const Real depth = rng.exponential();
      const auto event = walked.walk(i).event;
      if (event.kind == EventKind::escape) {
        EXPECT_GE(depth, *walked.ray.exact_depth);
        ++escaped;
      } else {
        EXPECT_NEAR(-std::log(walked.transmittance(event.distance)), depth, 2e-13);
      }
    }
    EXPECT_GT(escaped, 0);
    EXPECT_EQ(walked.ray.distance_at_depth(0), 0);
    EXPECT_EQ(walked.ray.distance_at_depth(2 * *walked.ray.exact_depth), kInfinity);
  }
  expect_law(HandWalked<ClosedForm>({}, linear(2, 0), 1));
  EXPECT_EQ(HandWalked<ClosedForm>({}, constant(0), 1).walk(1).event.kind, EventKind::escape);
}

/// Components with boxes of their own, so that their shares change from segment to segment.
TEST(Sampler, MultiVolumeLooksOneComponentUpAndKeepsTheLaw) {
  Homogeneous slab;
  slab.value = 2;
  slab.lo = Vec3(0.4, 0, 0);
  slab.hi = Vec3(0.7, 1, 1);
  const auto sum = std::make_shared<Sum>(
      std::vector<std::shared_ptr<const Medium>>{linear(0.3, 1), rising_exponential(1, -2), built(slab), constant(0)});
  const HandWalked<DeltaTracking> delta({}, sum, 1, 1.5, 4);
  for (const int pieces : {1, 4}) {
    const HandWalked<MultiVolumeTracking> walked({}, sum, 1, 1.5, pieces);
    for (const Real t : {0.1, 0.5, 0.9}) {
      Real each = 0;
      const Vec3 p(t, 0.5, 0.5);
      for (int i = 0; i < sum->components(); ++i) each += sum->component_extinction(i, p);
      EXPECT_NEAR(each, walked.extinction(t), 1e-14);
      const Real h = 1e-6;
      EXPECT_NEAR(std::log(walked.transmittance(t - h) / walked.transmittance(t + h)) / (2 * h), each, 1e-8);
    }
    expect_law(walked);
    expect_theory(walked);
  }
  EXPECT_EQ(*delta.theory().lookups, *HandWalked<MultiVolumeTracking>({}, sum, 1, 1.5, 4).theory().lookups);
  const Extrema two = {Spectrum::Ones(2), Spectrum::Ones(2), Spectrum::Ones(2)};
  EXPECT_THROW(EstimatorTemplate<MultiVolumeTracking>().check(two), ParameterError);
}

/// The distance's error against exact inversion falls with the order of the march's depth.
TEST(Sampler, MarchingInversionConverges) {
  for (const auto& [offset, order] : {std::pair{"left", 1}, {"midpoint", 2}, {"right", 1}}) {
    std::vector<Real> errors;
    for (const int steps : {64, 256}) {
      const auto march = with<MarchingInversion>([&, name = offset](auto& e) {
        e.steps = steps;
        e.offset = name;
      });
      const HandWalked<MarchingInversion> walked(march, rising_exponential(3, -2), 1);
      const HandWalked<ClosedForm> exact({}, rising_exponential(3, -2), 1);
      Real worst = 0;
      for (std::uint64_t i = 0; i < 2000; ++i) {
        const auto a = walked.walk(i).event, b = exact.walk(i).event;
        if (a.kind == b.kind) worst = std::max(worst, std::abs(a.distance - b.distance));
      }
      errors.push_back(worst);
    }
    EXPECT_NEAR(std::log(errors[0] / errors[1]) / std::log(4.), order, 0.3) << offset;
  }
  const HandWalked<MarchingInversion> walked({}, constant(1.3), 1);
  const HandWalked<ClosedForm> exact({}, constant(1.3), 1);
  for (std::uint64_t i = 0; i < 1000; ++i) EXPECT_NEAR(walked.walk(i).event.distance, exact.walk(i).event.distance, 1e-14);
}

/// lin T = .5 with a rate below the largest extinction (1.386).
TEST(Sampler, WeightedDeltaHasTheStatedVarianceAndLookups) {
  struct Row {
    Real rate, variance, lookups;
  };
  for (const Row& row : {Row{1, .32248, .8149}, Row{.7, .62693, .5861}, Row{.4, 2.9465, .3557}}) {
    const auto medium = linear(0, 1, std::log(2));
    const HandWalked<WeightedDeltaTracking> walked({}, medium, 1, row.rate / (2 * std::log(2.)));
    EXPECT_NEAR(*walked.theory().variance, row.variance, 5e-5 * row.variance + 1e-5);
    EXPECT_NEAR(*walked.theory().lookups, row.lookups, 6e-5);
    expect_theory(walked, 2000000);
  }
}

TEST(Sampler, WeightsAreOneToTheLastBitWhereNothingChangesSign) {
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const HandWalked<WeightedDeltaTracking> delta({}, linear(0.2, 2.5), 1, 1.7, 3);
    EXPECT_EQ(delta.walk(i).event.weight, 1);
    const HandWalked<WeightedDecompositionTracking> decomposition({}, linear(0.2, 2.5), 1, 1.7, 3);
    EXPECT_EQ(decomposition.walk(i).event.weight, 1);
  }
}

/// Collisions of the printed weighted delta tracking lack 1/P: E[w; collision] = int (mu/s) mu T, here with s = mub = 2 mu.
TEST(Sampler, CollisionsThatAreNotDividedByTheirProbabilityAreTooLight) {
  const HandWalked<PlantedCollisionWeight> walked({}, constant(1), 1, 2);
  Estimate collision, escape;
  for (std::uint64_t i = 0; i < 100000; ++i) {
    const auto outcome = walked.walk(i);
    collision.add(is_collision(outcome.event.kind) ? outcome.event.weight : 0);
    escape.add(outcome.result);
  }
  EXPECT_NEAR(escape.mean(), std::exp(-1.), kSigmas * escape.error());
  EXPECT_NEAR(collision.mean(), -std::expm1(-1.) / 2, kSigmas * collision.error());
  EXPECT_LT(collision.mean(), -std::expm1(-1.) - 50 * collision.error());
}

TEST(Sampler, NullCollisionRefusesProbabilitiesThatDoNotSumToOne) {
  const auto fixed = [](Real absorb, Real scatter, Real null, const char* roulette) {
    return with<NullCollisionTracking>([&](auto& e) {
      e.probabilities = "fixed";
      e.roulette = roulette;
      e.absorb = absorb;
      e.scatter = scatter;
      e.null = null;
    });
  };
  const Extrema grey = Extrema::grey(0.5, 1, 2);
  EXPECT_NO_THROW(fixed(.2, .3, .5, "one").check(grey));
  EXPECT_THROW(fixed(.2, .3, .4, "one").check(grey), ParameterError);
  EXPECT_NO_THROW(fixed(.2, .3, .4, "three").check(grey));
  EXPECT_THROW(fixed(1, .3, .4, "three").check(grey), ParameterError);
}

TEST(Sampler, NullCollisionRefusesChancesThatItDoesNotUse) {
  const auto proportional = [](Real absorb) {
    return with<NullCollisionTracking>([&](auto& e) { e.absorb = absorb; });
  };
  const Extrema grey = Extrema::grey(0.5, 1, 2);
  EXPECT_NO_THROW(proportional(.25).check(grey));
  EXPECT_THROW(proportional(.2).check(grey), ParameterError);
}

}  // namespace
}  // namespace nullmark
