// Decomposition tracking: lookups that the control saves, weights, and a listing that is wrong in print.

#include <gtest/gtest.h>

#include <array>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "estimators/analog_decomposition.h"
#include "estimators/delta.h"
#include "estimators/planted/decomposition_reset.h"
#include "estimators/sampler_test.h"
#include "estimators/theory/kinks.h"
#include "estimators/weighted_decomposition.h"
#include "harness/kernel/estimator_template.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"

namespace nullmark {
namespace {

using namespace sampler_test;

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
  EXPECT_THROW(EstimatorTemplate<AnalogDecompositionTracking>().check(three), ParameterError);
  EXPECT_THROW(EstimatorTemplate<WeightedDecompositionTracking>().check(three), ParameterError);
  EXPECT_THROW(with<WeightedDecompositionTracking>([](auto& e) { e.control = "given"; }).check(grey), ParameterError);
  EXPECT_THROW(with<WeightedDecompositionTracking>([](auto& e) { e.controls = {1}; }).check(grey), ParameterError);
}

}  // namespace
}  // namespace nullmark
