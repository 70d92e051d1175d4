// Free-path samplers, walk by walk: laws of their events, theory, and what must hold for every single weight.

#include <gtest/gtest.h>

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>
#include <numbers>

#include "estimators/analog_decomposition.h"
#include "estimators/closed_form.h"
#include "estimators/delta.h"
#include "estimators/hero_wavelength.h"
#include "estimators/marching_inversion.h"
#include "estimators/multi_volume.h"
#include "estimators/null_collision.h"
#include "estimators/planted/decomposition_reset.h"
#include "estimators/planted/weighted.h"
#include "estimators/regular_inversion.h"
#include "estimators/spectral.h"
#include "estimators/weighted_decomposition.h"
#include "estimators/weighted_delta.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "media/base/channels.h"
#include "media/base/sum.h"
#include "media/cosine.h"
#include "media/exponential.h"
#include "media/homogeneous.h"
#include "media/layers.h"
#include "media/polynomial.h"

namespace nullmark {
namespace {

/// Statistical tests here are two-sided at 5.5 standard errors, 4e-8 each, on fixed streams.
constexpr Real kSigmas = 5.5;

std::shared_ptr<const Medium> rising_exponential(Real amplitude, Real rate) {
  Exponential field;
  field.profile = {amplitude, rate};
  return built(field);
}

/// 2 + cos(2 pi x), the medium of Kutz et al. 2017, Fig. 5, over a given length.
struct TwoPlusCosine {
  Real length = 1;

  Box bounds() const { return {Vec3::Zero(), Vec3(length, 1, 1)}; }
  Real extinction(const Vec3& p) const { return 2 + std::cos(2 * std::numbers::pi * p.x()); }
  Extrema extrema(const Box&) const { return Extrema::grey(1, 2, 3); }
  void knots(const Ray& ray, std::vector<Real>& t) const {
    for (Real x = std::ceil(ray.begin) + 0.5; x < ray.end; ++x) t.push_back(x);
  }
  std::optional<Real> optical_depth(const Ray& ray) const { return antiderivative(ray.end) - antiderivative(ray.begin); }

 private:
  static Real antiderivative(Real x) { return 2 * x + std::sin(2 * std::numbers::pi * x) / (2 * std::numbers::pi); }
};

std::shared_ptr<const Medium> two_plus_cosine(Real length) { return built(TwoPlusCosine{length}); }

template <template <class> class E, class Value = Real>
E<Value> with(auto set) {
  E<Value> tracker;
  set(tracker);
  return tracker;
}

/// E[w; collision in a bin] = T(a) - T(b) for ten bins, split by the albedo where the tracker says absorb and scatter, and E[w;
/// escape] = T; with absorption left to weights, the scattering part alone.
template <class Walked>
void expect_law(const Walked& walked, int samples = 200000) {
  constexpr std::size_t kBins = 10;
  const auto& ray = walked.ray;
  const auto channels = static_cast<std::size_t>(ray.channels);
  std::vector<std::array<std::array<Estimate, 3>, kBins>> bins(channels);  // [channel][bin]: absorb, scatter, both
  std::vector<Estimate> escape(channels), result(channels);
  bool chooses = false;
  for (int i = 0; i < samples; ++i) {
    const auto outcome = walked.walk(static_cast<std::uint64_t>(i));
    const auto& event = outcome.event;
    ASSERT_TRUE(event.distance >= ray.begin && event.distance <= ray.end) << event.distance;
    const auto bin = std::min<std::size_t>(kBins - 1, static_cast<std::size_t>(kBins * event.distance / ray.end));
    chooses = chooses || event.kind > EventKind::collision;
    for (std::size_t c = 0; c < channels; ++c) {
      const Real w = channel(event.weight, static_cast<int>(c));
      const bool collided = is_collision(event.kind);
      for (std::size_t b = 0; b < kBins; ++b) {
        const Real here = collided && b == bin ? w : 0;
        bins[c][b][0].add(event.kind == EventKind::absorb ? here : 0);
        bins[c][b][1].add(event.kind == EventKind::scatter ? here : 0);
        bins[c][b][2].add(here);
      }
      escape[c].add(collided ? 0 : w);
      result[c].add(channel(outcome.result, static_cast<int>(c)));
    }
  }
  const auto agree = [&](const Estimate& estimate, Real expected) {
    EXPECT_NEAR(estimate.mean(), expected, kSigmas * estimate.error() + 1e-12 + (estimate.squares == 0 ? 30. / samples : 0));
  };
  for (std::size_t c = 0; c < channels; ++c) {
    SCOPED_TRACE(c);
    const int k = static_cast<int>(c);
    const Real albedo = channel(ray.albedo, k);
    for (std::size_t b = 0; b < kBins; ++b) {
      SCOPED_TRACE(b);
      const auto before = walked.transmittance(ray.end * static_cast<Real>(b) / kBins);
      const auto after = walked.transmittance(ray.end * static_cast<Real>(b + 1) / kBins);
      const Real collided = channel(before, k) - channel(after, k);
      if (chooses || !ray.draws_absorption) {
        agree(bins[c][b][0], ray.draws_absorption ? (1 - albedo) * collided : 0);
        agree(bins[c][b][1], albedo * collided);
      } else {
        agree(bins[c][b][2], collided);
      }
    }
    agree(escape[c], channel(walked.transmittance(ray.end), k));
    agree(result[c], channel(walked.transmittance(ray.end), k));
  }
}

/// Variance and lookups of the escape weight against theory, at 4 % and 1 %.
template <class Walked>
void expect_theory(const Walked& walked, int samples = 400000) {
  std::vector<Estimate> weight(static_cast<std::size_t>(walked.ray.channels));
  Estimate lookups;
  for (int i = 0; i < samples; ++i) {
    const auto outcome = walked.walk(static_cast<std::uint64_t>(i));
    for (int c = 0; c < walked.ray.channels; ++c) weight[static_cast<std::size_t>(c)].add(channel(outcome.result, c));
    lookups.add(outcome.lookups);
  }
  for (int c = 0; c < walked.ray.channels; ++c) {
    SCOPED_TRACE(c);
    const Theory theory = walked.theory(c);
    const Estimate& w = weight[static_cast<std::size_t>(c)];
    const Real mean = theory.mean.value_or(channel(walked.transmittance(walked.ray.end), c));
    EXPECT_NEAR(w.mean(), mean, kSigmas * w.error() + 1e-12);
    // Of heavier tails no such number of samples tells the variance.
    if (theory.variance && *theory.variance < 5 * mean * mean) {
      EXPECT_NEAR(w.variance(), *theory.variance, 0.04 * *theory.variance + 1e-12);
    }
    ASSERT_TRUE(theory.lookups);
    EXPECT_NEAR(lookups.mean(), *theory.lookups, kSigmas * lookups.error() + 1e-12);
    if (theory.lookups_variance) {
      EXPECT_NEAR(lookups.variance(), *theory.lookups_variance, 0.04 * *theory.lookups_variance + 1e-12);
    }
  }
}

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
        expect_law(walked, 60000);
        expect_theory(walked, 60000);
      }
}

constexpr auto kDefault = [](auto&) {};

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
  expect_grey_law<SpectralTracking>([](auto& e) { e.control = "minimum"; }, {1, 3, 0.7});
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
  EXPECT_THROW(MultiVolumeTracking<Real>{}.check(two), ParameterError);
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

// Decomposition

/// rho = 1 - mu_c/mub (Kutz et al. 2017), analog and weighted alike, with and without super-voxels; the delta relation is exact.
TEST(Decomposition, LookupsAreTheShareThatTheMajorantLeavesOverTheControl) {
  const auto medium = two_plus_cosine(3);
  const Real delta = *HandWalked<DeltaTracking>({}, medium, 3).theory().lookups;
  for (const Real factor : {0., .5, 1.}) {
    const HandWalked<AnalogDecompositionTracking> analog(with<AnalogDecompositionTracking>([&](auto& e) { e.factor = factor; }),
                                                         medium, 3);
    const HandWalked<WeightedDecompositionTracking> weighted(with<WeightedDecompositionTracking>([&](auto& e) {
                                                               e.control = "given";
                                                               e.controls = {factor / 2, factor / 2};
                                                             }),
                                                             medium, 3);
    EXPECT_NEAR(*analog.theory().lookups, (1 - factor / 3) * delta, 1e-9);
    EXPECT_NEAR(*weighted.theory().lookups, (1 - factor / 3) * delta, 1e-9);
    EXPECT_NEAR(*analog.theory().lookups_variance, *weighted.theory().lookups_variance, 1e-9);
    expect_theory(analog);
    expect_theory(weighted);
    expect_law(analog);
    expect_law(weighted);
  }
}

/// The table for 2 + cos(2 pi x), infinite, mub = 3: moments of the weight at the first collision, lookups against delta
/// tracking's; infinite variance beyond mu_c = 2.2330.  A ray of 30 stands for infinity where weights shrink fast enough.
TEST(Decomposition, WeightsAtTheFirstCollisionHaveTheStatedVariance) {
  constexpr Real kLength = 30;
  const auto medium = two_plus_cosine(kLength);
  const Real delta = *HandWalked<DeltaTracking>({}, medium, kLength).theory().lookups;
  EXPECT_NEAR(delta, 1.440087, 1e-6);
  struct Row {
    Real control, variance, lookups;
  };
  // int_0^1 of the exponent of K: the second moment is finite where it is negative.
  const auto exponent = [](Real mu_c) {
    return boost::math::quadrature::gauss_kronrod<Real, 31>::integrate(
        [&](Real x) {
          const Real mu = 2 + std::cos(2 * std::numbers::pi * x);
          return (std::abs(mu - mu_c) + 3 - mu) * (3 - mu) / (3 - mu_c) - 3;
        },
        0., 1., 15, 1e-12);
  };
  EXPECT_LT(exponent(2.2329), 0);
  EXPECT_GT(exponent(2.2331), 0);

  for (const Row& row : {Row{0, 0, 1}, Row{.5, 0, .83333}, Row{1, 0, .66667}, Row{1.2, .05227, .58636}, Row{1.5, .28333, .46187},
                         Row{2, 2.6125, .27810}, Row{2.2, 25.76, .21394}}) {
    SCOPED_TRACE(row.control);
    const HandWalked<WeightedDecompositionTracking> walked(with<WeightedDecompositionTracking>([&](auto& e) {
                                                             e.control = "given";
                                                             e.controls = {row.control};
                                                           }),
                                                           medium, kLength);
    EXPECT_NEAR(*walked.theory().lookups / delta, row.lookups, 6e-6);
    // E[w^2; first collision] over whole periods: a geometric series in K(1).
    const Real grown = exponent(row.control), mu_c = row.control;
    const HandWalked<WeightedDecompositionTracking> once(walked.estimator, two_plus_cosine(1), 1);
    const RayProfile profile = cut_at_levels(once.profile(), once.ray.rate, {&once.ray.rate, &once.ray.control});
    const auto decay = profile.running(0, [&](const RayProfile::Node& at) {
      return (std::abs(at.extinction - mu_c) + 3 - at.extinction) * (3 - at.extinction) / (3 - mu_c) - 3;
    });
    std::size_t j = 0;
    const Real period = profile.integrate(0, [&](const RayProfile::Node& at) {
      const Real rest = std::abs(at.extinction - mu_c);
      return (mu_c + rest * (rest + 3 - at.extinction) / (3 - mu_c)) * std::exp(decay[j++]);
    });
    EXPECT_NEAR(period / -std::expm1(grown) - 1, row.variance, 2e-3 * row.variance + 1e-5);

    Estimate weight, square, lookups;
    for (std::uint64_t i = 0; i < 400000; ++i) {
      const auto outcome = walked.walk(i);
      const Real w = is_collision(outcome.event.kind) ? outcome.event.weight : 0;
      if (row.control <= 1) {
        EXPECT_EQ(outcome.event.weight, 1);
      }
      weight.add(w);
      square.add(w * w);
      lookups.add(outcome.lookups);
    }
    EXPECT_NEAR(lookups.mean(), row.lookups * delta, kSigmas * lookups.error() + 1e-5);
    if (row.control > 1.5) continue;  // their fourth moments are beyond any sample
    EXPECT_NEAR(weight.mean(), 1, kSigmas * weight.error() + 1e-12);
    EXPECT_NEAR(square.mean() - 1, row.variance, kSigmas * square.error() + 1e-5);
  }
}

/// The printed listing sets the residual's path to 0 at each null collision: the control wins too often, and the law is another.
TEST(Decomposition, AResidualPathThatStartsAnewHasAnotherLaw) {
  constexpr Real kLength = 30;
  const HandWalked<AnalogDecompositionTracking> right({}, two_plus_cosine(kLength), kLength);
  const HandWalked<PlantedDecompositionReset> reset({}, two_plus_cosine(kLength), kLength);
  std::array<Estimate, 2> path, beyond, lookups;
  for (std::uint64_t i = 0; i < 400000; ++i)
    for (const std::size_t k : {0u, 1u}) {
      const auto add = [&](const auto& outcome) {
        path[k].add(outcome.event.distance);
        beyond[k].add(outcome.event.distance > 0.5);
        lookups[k].add(outcome.lookups);
      };
      k == 0 ? add(right.walk(i)) : add(reset.walk(i));
    }
  EXPECT_NEAR(path[0].mean(), .480029, kSigmas * path[0].error());
  EXPECT_NEAR(beyond[0].mean(), std::exp(-1.), kSigmas * beyond[0].error());
  EXPECT_NEAR(lookups[0].mean(), .960058, kSigmas * lookups[0].error());
  EXPECT_NEAR(path[1].mean(), .318, .002);
  EXPECT_NEAR(beyond[1].mean(), .222, .004);
  EXPECT_NEAR(lookups[1].mean(), 1.052, .008);
  EXPECT_GT((path[0].mean() - path[1].mean()) / path[1].error(), 100);
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

TEST(Decomposition, RefusesWhatItCannotBound) {
  const Extrema grey = Extrema::grey(0.5, 1, 2);
  const auto with_value = [](Real value) {
    return with<AnalogDecompositionTracking>([&](auto& e) {
      e.control = "given";
      e.value = value;
    });
  };
  EXPECT_NO_THROW(with_value(0.5).check(grey));
  EXPECT_THROW(with_value(0.51).check(grey), ParameterError);
  const Extrema three = {Spectrum::Ones(3), Spectrum::Ones(3), Spectrum::Ones(3)};
  EXPECT_THROW(AnalogDecompositionTracking<Real>{}.check(three), ParameterError);
  EXPECT_THROW(WeightedDecompositionTracking<Real>{}.check(three), ParameterError);
  EXPECT_THROW(with<WeightedDecompositionTracking>([](auto& e) { e.control = "given"; }).check(grey), ParameterError);
  EXPECT_THROW(with<WeightedDecompositionTracking>([](auto& e) { e.controls = {1}; }).check(grey), ParameterError);
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

// Spectral

/// mu_s = (1, 2, 4), mu_a = (.5, .2, .1): the constant chromatic medium of the tables.
struct Chromatic {
  std::shared_ptr<const Medium> medium = std::make_shared<Spectral>(constant(1), std::vector<Real>{1.5, 2.2, 4.1});
  Spectrum albedo = Spectrum::Zero(3);
  Chromatic() { albedo << 1 / 1.5, 2 / 2.2, 4 / 4.1; }

  template <template <class> class E>
  std::unique_ptr<HandWalked<E, Spectrum>> walked(auto set, Real majorant = 4.3) const {
    auto walked = std::make_unique<HandWalked<E, Spectrum>>(with<E, Spectrum>(set), medium, 1, majorant / 4.1);
    walked->ray.albedo = albedo;
    return walked;
  }
};

/// Variances of the escape weight and largest weights seen.
TEST(Spectral, SchemesHaveTheStatedVariances) {
  struct Row {
    const char* scheme;
    Real red, green, blue;
  };
  for (const Row& row :
       {Row{"maximum", 1.52401, .184406, .013627}, Row{"average", 1.31605, .169335, .013617},
        Row{"history_aware_maximum", .359939, .096333, .013626}, Row{"history_aware_average", .396968, .098865, .013616}}) {
    SCOPED_TRACE(row.scheme);
    const auto walked = Chromatic{}.walked<SpectralTracking>([&](auto& e) { e.scheme = row.scheme; });
    EXPECT_NEAR(*walked->theory(0).variance, row.red, 6e-6);
    EXPECT_NEAR(*walked->theory(1).variance, row.green, 2e-6);
    EXPECT_NEAR(*walked->theory(2).variance, row.blue, 1e-6);
    Real largest_weight = 0;
    std::array<Estimate, 3> weight;
    Estimate lookups;
    for (std::uint64_t i = 0; i < 500000; ++i) {
      const auto outcome = walked->walk(i);
      for (int c = 0; c < 3; ++c) weight[static_cast<std::size_t>(c)].add(outcome.result[c]);
      largest_weight = std::max(largest_weight, outcome.event.weight.maxCoeff());
      lookups.add(outcome.lookups);
    }
    for (int c = 0; c < 3; ++c) {
      const Estimate& w = weight[static_cast<std::size_t>(c)];
      EXPECT_NEAR(w.mean(), walked->transmittance(1)[c], kSigmas * w.error());
    }
    EXPECT_NEAR(lookups.mean(), *walked->theory(0).lookups, kSigmas * lookups.error());
    const bool by_history = std::string(row.scheme).starts_with("history");
    EXPECT_EQ(largest_weight < 3, by_history) << largest_weight;
  }
  const auto best = Chromatic{}.walked<SpectralTracking>(kDefault);
  EXPECT_NEAR(*best->theory(0).lookups, 1.66547, 6e-6);
  EXPECT_NEAR(best->transmittance(1).mean(), .116835, 1e-6);
}

TEST(Spectral, HeroWavelengthHasTheLawOfHistoryAwareAverage) {
  const auto hero = Chromatic{}.walked<HeroWavelengthTracking>(kDefault);
  const auto average = Chromatic{}.walked<SpectralTracking>(kDefault);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(*hero->theory(c).variance, *average->theory(c).variance, 1e-12);
  EXPECT_NEAR(*hero->theory(0).lookups, *average->theory(0).lookups, 1e-9);
  expect_theory(*hero);
  expect_law(*hero);
}

TEST(Spectral, EventsFollowTheLawPerChannel) {
  for (const char* scheme : {"maximum", "average", "history_aware_maximum", "history_aware_average"})
    for (const char* control : {"none", "minimum"})
      for (const bool draws : {true, false}) {
        SCOPED_TRACE(std::string(scheme) + " " + control + (draws ? "" : " without absorption"));
        const auto set = [&](auto& e) {
          e.scheme = scheme;
          e.control = control;
        };
        const auto flat = Chromatic{}.walked<SpectralTracking>(set);
        flat->ray.draws_absorption = draws;
        expect_law(*flat);
        for (const Real looseness : {1., .8}) {
          const auto channels = std::make_shared<PerChannel>(
              std::vector<std::shared_ptr<const Medium>>{linear(0.3, 1), rising_exponential(2, -1), constant(0.8)});
          HandWalked<SpectralTracking, Spectrum> walked(with<SpectralTracking, Spectrum>(set), channels, 1, looseness, 3);
          walked.ray.albedo << 0.2, 0.9, 1;
          walked.ray.draws_absorption = draws;
          expect_law(walked);
        }
      }
  for (const bool draws : {true, false}) {
    const auto hero = Chromatic{}.walked<HeroWavelengthTracking>(kDefault);
    hero->ray.draws_absorption = draws;
    expect_law(*hero);
    const auto fixed = Chromatic{}.walked<NullCollisionTracking>([](auto& e) { e.probabilities = "fixed"; });
    fixed->ray.draws_absorption = draws;
    expect_law(*fixed);
  }
}

/// Spectral decomposition keeps the variance of history-aware average and saves the control's lookups: int avg (mub - mu_c) T.
TEST(Spectral, DecompositionSavesLookups) {
  const auto channels = std::make_shared<PerChannel>(
      std::vector<std::shared_ptr<const Medium>>{linear(0.3, 1), rising_exponential(2, -1), constant(0.8)});
  const auto walked = [&](const char* scheme, const char* control) {
    return std::make_unique<HandWalked<SpectralTracking, Spectrum>>(with<SpectralTracking, Spectrum>([&](auto& e) {
                                                                      e.scheme = scheme;
                                                                      e.control = control;
                                                                    }),
                                                                    channels, 1, 1, 2);
  };
  for (const char* scheme : {"maximum", "average", "history_aware_average"}) {
    const auto plain = walked(scheme, "none"), split = walked(scheme, "minimum");
    EXPECT_LT(*split->theory(0).lookups, 0.8 * *plain->theory(0).lookups) << scheme;
    expect_theory(*plain);
    expect_theory(*split);
  }
}

/// Whole paths in an infinite medium whose coefficients change from point to point, throughput carried from flight to flight:
/// with history-aware average the mean over the channels is 1 to 1e-12 and no weight exceeds their number, ever; with the other
/// schemes weights grow.
TEST(Spectral, HistoryAwareAverageKeepsTheMeanWeightOverAMillionPaths) {
  const auto longest = [](const char* scheme, int paths, Real& worst_mean, int& most_events) {
    const auto walked = Chromatic{}.walked<SpectralTracking>([&](auto& e) { e.scheme = scheme; });
    using E = SpectralTracking<Spectrum>;
    constexpr int kMostEvents = 10000;
    Real largest_weight = 0;
    for (int path = 0; path < paths; ++path) {
      Rng rng(SampleAddress{7, 0, static_cast<std::uint64_t>(path)});
      E::Walk walk;
      Flight flight;
      walked->ray.throughput = Spectrum::Ones(3);
      flight.start(walked->ray.majorant);
      walked->estimator.init(walk, walked->ray, flight, rng);
      for (int events = 1; events <= kMostEvents; ++events) {
        Spectrum extinction(3);
        for (int c = 0; c < 3; ++c) extinction[c] = 4.1 * rng.uniform();
        walked->estimator.consume(walk, walked->ray, flight, extinction, rng);
        const Spectrum throughput = walked->ray.throughput * walk.weight;
        worst_mean = std::max(worst_mean, std::abs(throughput.mean() - 1));
        largest_weight = std::max(largest_weight, throughput.maxCoeff());
        most_events = std::max(most_events, events);
        if (walk.kind == EventKind::absorb) break;
        if (walk.kind == EventKind::scatter) {
          walked->ray.throughput = throughput;
          walked->estimator.init(walk, walked->ray, flight, rng);
        }
      }
    }
    return largest_weight;
  };
  Real off = 0;
  int events = 0;
  EXPECT_LE(longest("history_aware_average", 1000000, off, events), 3 * (1 + 1e-12));
  EXPECT_LT(off, 1e-12);
  EXPECT_GT(events, 100);
  std::printf("history-aware average: mean weight off by %.2g at most, %d events in the longest path\n", off, events);
  Real ignored = 0;
  for (const char* scheme : {"maximum", "average", "history_aware_maximum"}) {
    const Real largest_weight = longest(scheme, 100000, ignored, events);
    std::printf("%s: largest weight %.3g\n", scheme, largest_weight);
    EXPECT_GT(largest_weight, 3) << scheme;
  }
}

// Ends of ranges

/// Random numbers at the ends of [0, 1), in every order of three.
struct Forced {
  int pattern = 0, at = 0;
  Real uniform() { return pattern >> (at++ % 3) & 1 ? 1 - 0x1p-53 : 0; }
  Real exponential() { return -std::log(1 - uniform()); }
};

template <template <class> class E, class Value>
void expect_finite(const std::shared_ptr<const Medium>& medium, Real looseness, auto set) {
  for (const Real albedo : {0., 1., 0.5})
    for (const bool draws : {true, false}) {
      HandWalked<E, Value> walked(with<E, Value>(set), medium, 1, looseness, 2);
      walked.ray.albedo = walked.ray.value(albedo);
      walked.ray.draws_absorption = draws;
      for (int pattern = 0; pattern < 8; ++pattern) {
        // u = 0 does not leave its place, so a walk whose flights all are 0 long would not end.
        Forced forced{pattern, 0};
        struct Limited {
          Forced& source;
          int left = 300;
          Real uniform() { return source.uniform(); }
          Real exponential() { return left-- > 0 ? source.exponential() : 1e9; }
        } rng{forced};
        const auto outcome = walked.walk(rng);
        for (int c = 0; c < walked.ray.channels; ++c) {
          EXPECT_TRUE(std::isfinite(channel(outcome.result, c))) << E<Value>::kName << " " << pattern << " " << albedo << draws;
          EXPECT_TRUE(std::isfinite(channel(outcome.event.weight, c))) << E<Value>::kName << " " << pattern;
        }
        EXPECT_TRUE(std::isfinite(outcome.event.distance));
      }
    }
}

TEST(Sampler, NothingIsUndefinedAtTheEndsOfRanges) {
  Layers gap;
  gap.profile.values = {0, 2};
  for (const auto& medium : {constant(0), constant(2), linear(0, 2), built(gap)})
    for (const Real looseness : {1., 2.}) {
      expect_finite<DeltaTracking, Real>(medium, looseness, kDefault);
      expect_finite<WeightedDeltaTracking, Real>(medium, looseness, kDefault);
      expect_finite<AnalogDecompositionTracking, Real>(medium, looseness, kDefault);
      for (const char* control : {"minimum", "average", "maximum"})
        expect_finite<WeightedDecompositionTracking, Real>(medium, looseness, [&](auto& e) { e.control = control; });
      expect_finite<HeroWavelengthTracking, Real>(medium, looseness, kDefault);
      const auto spectral = std::make_shared<Spectral>(medium, std::vector<Real>{1, 0.5, 0});
      expect_finite<HeroWavelengthTracking, Spectrum>(spectral, looseness, kDefault);
      for (const char* roulette : {"one", "three"})
        for (const char* probabilities : {"proportional", "fixed"}) {
          const auto set = [&](auto& e) {
            e.roulette = roulette;
            e.probabilities = probabilities;
          };
          // Weights of fixed chances grow by up to 2 at each of 300 null collisions.
          expect_finite<NullCollisionTracking, Real>(medium, looseness, set);
          expect_finite<NullCollisionTracking, Spectrum>(spectral, looseness, set);
        }
      for (const char* scheme : {"maximum", "average", "history_aware_maximum", "history_aware_average"})
        for (const char* control : {"none", "minimum"}) {
          const auto set = [&](auto& e) {
            e.scheme = scheme;
            e.control = control;
          };
          expect_finite<SpectralTracking, Real>(medium, looseness, set);
          expect_finite<SpectralTracking, Spectrum>(spectral, looseness, set);
        }
    }
}

}  // namespace
}  // namespace nullmark
