#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "estimators/estimator.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "media/exponential.h"

/// Free-path samplers, walk by walk: the laws of their events, and their theory.
namespace nullmark::sampler_test {

inline std::shared_ptr<const Medium> rising_exponential(Real amplitude, Real rate) {
  Exponential field;
  field.profile = {amplitude, rate};
  return built(field);
}

/// A tracker with some of its parameters set.
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

/// Sets nothing.
inline constexpr auto kDefault = [](auto&) {};

}  // namespace nullmark::sampler_test
