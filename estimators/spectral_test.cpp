// Samplers of chromatic media: variances, laws of every channel, weights of whole paths.

#include "estimators/spectral.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "estimators/hero_wavelength.h"
#include "estimators/null_collision.h"
#include "estimators/sampler_test.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "media/base/channels.h"

namespace nullmark {
namespace {

using namespace sampler_test;

constexpr SpectralScheme kSchemes[] = {SpectralScheme::maximum, SpectralScheme::average, SpectralScheme::history_aware_maximum,
                                       SpectralScheme::history_aware_average};

/// mu_s = (1, 2, 4), mu_a = (.5, .2, .1): the constant chromatic medium of the tables.
struct Chromatic {
  std::shared_ptr<const Medium> medium = std::make_shared<Spectral>(constant(1), std::vector<Real>{1.5, 2.2, 4.1});
  Spectrum albedo = Spectrum::Zero(3);
  Chromatic() { albedo << 1 / 1.5, 2 / 2.2, 4 / 4.1; }

  template <template <class> class E>
  std::unique_ptr<HandWalked<E, Spectrum>> walked(auto set, Real majorant = 4.3) const {
    auto walked = std::make_unique<HandWalked<E, Spectrum>>(with<E, Spectrum>(set), medium, 1, majorant / 4.1);
    walked->ray.albedo = albedo;
    walked->prepare();
    return walked;
  }
};

/// Gives every choice one word.
struct Says final : ParameterVisitor {
  explicit Says(std::string one) : word(std::move(one)) {}
  void number(const char*, Real&, Range, const char*, const char*) override {}
  void integer(const char*, int&, int, int, const char*) override {}
  void flag(const char*, bool&, const char*) override {}
  void choice(const char* name, std::string& value, std::initializer_list<const char*>, const char*) override {
    if (name == std::string("scheme")) value = word;
  }
  void text(const char*, std::string&, const char*) override {}
  void numbers(const char*, std::vector<Real>&, int, int, Range, const char*, const char*) override {}
  void texts(const char*, std::vector<std::string>&, const char*) override {}
  void object(const char*, std::string&, const char*) override {}
  void point(const char*, Vec3&, const char*, const char*) override {}
  std::string word;
};

TEST(Spectral, SchemesGoByTheirWords) {
  const auto scheme = [](const char* word) {
    Says says(word);
    SpectralTracking<Real> spectral;
    spectral.parameters(says);
    return spectral.scheme;
  };
  EXPECT_EQ(scheme("maximum"), SpectralScheme::maximum);
  EXPECT_EQ(scheme("average"), SpectralScheme::average);
  EXPECT_EQ(scheme("history_aware_maximum"), SpectralScheme::history_aware_maximum);
  EXPECT_EQ(scheme("history_aware_average"), SpectralScheme::history_aware_average);
  EXPECT_THROW(scheme("none"), ParameterError);
}

/// Variances of the escape weight and largest weights seen.
TEST(Spectral, SchemesHaveTheStatedVariances) {
  struct Row {
    SpectralScheme scheme;
    Real red, green, blue;
  };
  for (const Row& row :
       {Row{SpectralScheme::maximum, 1.52401, .184406, .013627}, Row{SpectralScheme::average, 1.31605, .169335, .013617},
        Row{SpectralScheme::history_aware_maximum, .359939, .096333, .013626},
        Row{SpectralScheme::history_aware_average, .396968, .098865, .013616}}) {
    SCOPED_TRACE(static_cast<int>(row.scheme));
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
    const bool by_history = row.scheme >= SpectralScheme::history_aware_maximum;
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
  for (const SpectralScheme scheme : kSchemes)
    for (const SpectralControl control : {SpectralControl::none, SpectralControl::minimum})
      for (const bool draws : {true, false}) {
        SCOPED_TRACE(fmt::format("scheme {}, control {}{}", static_cast<int>(scheme), static_cast<int>(control),
                                 draws ? "" : ", without absorption"));
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
          walked.prepare();
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
  const auto walked = [&](SpectralScheme scheme, SpectralControl control) {
    return std::make_unique<HandWalked<SpectralTracking, Spectrum>>(with<SpectralTracking, Spectrum>([&](auto& e) {
                                                                      e.scheme = scheme;
                                                                      e.control = control;
                                                                    }),
                                                                    channels, 1, 1, 2);
  };
  for (const SpectralScheme scheme : {SpectralScheme::maximum, SpectralScheme::average, SpectralScheme::history_aware_average}) {
    const auto plain = walked(scheme, SpectralControl::none), split = walked(scheme, SpectralControl::minimum);
    EXPECT_LT(*split->theory(0).lookups, 0.8 * *plain->theory(0).lookups) << static_cast<int>(scheme);
    expect_theory(*plain);
    expect_theory(*split);
  }
}

/// Whole paths in an infinite medium whose coefficients change from point to point, throughput carried from flight to flight:
/// with history-aware average the mean over the channels is 1 to 1e-12 and no weight exceeds their number, ever; with the other
/// schemes weights grow.
TEST(Spectral, HistoryAwareAverageKeepsTheMeanWeightOverAMillionPaths) {
  const auto longest = [](SpectralScheme scheme, int paths, Real& worst_mean, int& most_events) {
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
        if (walk.end.kind == EventKind::absorb) break;
        if (walk.end.kind == EventKind::scatter) {
          walked->ray.throughput = throughput;
          walked->estimator.init(walk, walked->ray, flight, rng);
        }
      }
    }
    return largest_weight;
  };
  Real off = 0;
  int events = 0;
  EXPECT_LE(longest(SpectralScheme::history_aware_average, 1000000, off, events), 3 * (1 + 1e-12));
  EXPECT_LT(off, 1e-12);
  EXPECT_GT(events, 100);
  std::printf("history-aware average: mean weight off by %.2g at most, %d events in the longest path\n", off, events);
  Real ignored = 0;
  for (const SpectralScheme scheme : {SpectralScheme::maximum, SpectralScheme::average, SpectralScheme::history_aware_maximum}) {
    const Real largest_weight = longest(scheme, 100000, ignored, events);
    std::printf("scheme %d: largest weight %.3g\n", static_cast<int>(scheme), largest_weight);
    EXPECT_GT(largest_weight, 3) << static_cast<int>(scheme);
  }
}

}  // namespace
}  // namespace nullmark
