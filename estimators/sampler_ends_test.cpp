// Free-path samplers at the ends of the ranges of extinctions, albedos and random numbers.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "estimators/analog_decomposition.h"
#include "estimators/delta.h"
#include "estimators/hero_wavelength.h"
#include "estimators/null_collision.h"
#include "estimators/sampler_test.h"
#include "estimators/spectral.h"
#include "estimators/weighted_decomposition.h"
#include "estimators/weighted_delta.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "media/base/channels.h"
#include "media/layers.h"

namespace nullmark {
namespace {

using namespace sampler_test;

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
      walked.prepare();
      walked.ray.draws_absorption = draws;
      for (int pattern = 0; pattern < 8; ++pattern) {
        // u = 0 does not leave its place, so a walk whose flights all are 0 long would not end.
        Forced forced{pattern, 0};
        struct Limited {
          Forced& source;
          int left = 300;
          Real uniform() { return source.uniform(); }
          Real uniform_where(bool drawn) { return drawn ? uniform() : 0; }
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
      for (const SpectralScheme scheme : {SpectralScheme::maximum, SpectralScheme::average, SpectralScheme::history_aware_maximum,
                                          SpectralScheme::history_aware_average})
        for (const SpectralControl control : {SpectralControl::none, SpectralControl::minimum}) {
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
