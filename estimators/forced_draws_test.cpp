// Random numbers at the ends of their range, at every draw, for every tracker: the draws that no million samples show.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "every_estimator.h"
#include "harness/kernel/lane_kernel.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "media/base/channels.h"
#include "media/layers.h"

namespace nullmark {
namespace {

constexpr Real kLargestUniform = 1 - 0x1p-53;

/// A stream of which one draw is forced.
class ForcedRng {
 public:
  ForcedRng(std::uint64_t sample, int at, Real forced) : rng_(SampleAddress{20261122, 0, sample}), left_(at), forced_(forced) {}

  Real uniform(bool) { return uniform(); }
  Real uniform() {
    const Real drawn = rng_.uniform();
    return left_-- == 0 ? forced_ : drawn;
  }
  Real uniform_where(bool drawn) { return drawn ? uniform() : 0; }
  Real exponential() { return negative_logarithm(1 - uniform()); }
  std::uint64_t draws() const { return rng_.draws(); }
  std::uint64_t sample() const { return rng_.sample(); }
  bool reached() const { return left_ < 0; }

 private:
  Rng rng_;
  int left_;
  Real forced_;
};

std::vector<std::shared_ptr<const Medium>> media() {
  Layers gap;
  gap.profile.values = {0, 3, 0, 1};
  return {constant(2), constant(0), linear(0, 3), linear(0, 5e-324), built(gap)};
}

template <class E, class Ray>
constexpr bool tells_events() {
  return requires(const E& tracker, const typename E::Walk& walk, const Ray& ray, const Flight& at) {
    tracker.event(walk, ray, at);
  };
}

template <template <class> class E, class Value>
void hold(const std::shared_ptr<const Medium>& medium) {
  constexpr int kDraws = 24;
  // A telescoping march of the rarest level has 2^36 steps.
  constexpr Real kMostLookups = 1e5;
  E<Value> tracker;
  if constexpr (requires { tracker.check(Extrema()); }) try {
      tracker.check(medium->extrema(medium->bounds()));
    } catch (const ParameterError&) {
      return;
    }
  const auto walk_all = [&](const HandWalked<E, Value>& walked, const std::string& with) {
    for (int at = 0; at < kDraws; ++at) {
      bool reached = false;
      for (const Real forced : {Real{0}, kLargestUniform})
        for (std::uint64_t sample = 0; sample < 3; ++sample) {
          ForcedRng rng(sample, at, forced);
          const auto outcome = walked.walk(rng, kMostLookups);
          reached = reached || rng.reached();
          if (outcome.lookups == kMostLookups) continue;
          const std::string where =
              fmt::format("{} channels, {}, u = {} at draw {} of sample {}", walked.ray.channels, with, forced, at, sample);
          using Walked = HandWalked<E, Value>;
          constexpr bool kTells = tells_events<E<Value>, typename Walked::MediumRay>();
          constexpr SampleRange kRange = E<Value>::kRange;
          constexpr bool kAtMostOne = kRange == SampleRange::binary || kRange == SampleRange::unit;
          for (int c = 0; c < walked.ray.channels; ++c) {
            const Real result = channel(outcome.result, c);
            ASSERT_TRUE(std::isfinite(result)) << where;
            ASSERT_GE(result, kRange == SampleRange::any_sign ? -kInfinity : 0) << where;
            ASSERT_LE(result, kAtMostOne ? 1 + 1e-12 : kInfinity) << where;
            ASSERT_TRUE(!kTells || std::isfinite(channel(outcome.event.weight, c))) << where;
          }
          if (kTells) {
            ASSERT_GE(outcome.event.distance, walked.ray.begin) << where;
            ASSERT_LE(outcome.event.distance, walked.ray.end) << where;
          }
        }
      if (!reached) return;
    }
  };
  for (const Real looseness : {1., 4.})
    for (const int pieces : {1, 4})
      walk_all(HandWalked<E, Value>(tracker, medium, 1, looseness, pieces),
               fmt::format("looseness {}, {} pieces", looseness, pieces));
}

/// In float, one lane: the state before a call is set so that its first draw is 0 or the largest below 1.
template <template <class> class E>
void hold_in_float(const std::shared_ptr<const Medium>& medium) {
  using Pack = Lanes<float, 1>;
  using Streams = LaneRng<float, 1>;
  const E<Pack> tracker;
  constexpr bool kKeeps = requires { typename E<Pack>::Kept; };
  constexpr int kCalls = 24;
  for (const Real looseness : {1., 4.}) {
    const HandWalked<E> walked({}, medium, 1, looseness, 4);
    for (int at = 0; at < kCalls; ++at)
      for (const std::uint32_t end : {std::uint32_t{0}, ~std::uint32_t{0}}) {
        auto state = Streams::seeded({20261122, 0, 0});
        Streams rng(state, true);
        typename LaneFlight<float, 1>::Rates rates;
        typename LaneFlight<float, 1>::Place place;
        std::uint32_t lookups = 0;
        const auto in_flight = [&] { return LaneFlight<float, 1>(rates, place, lookups); };
        LaneFlight<float, 1> flight = in_flight();
        typename E<Pack>::Walk walk;
        typename E<Real>::Walk kept;
        flight.start(walked.ray.majorant);
        tracker.init(walk, walked.ray, flight, rng);
        if constexpr (kKeeps) {
          Rng unused;
          tracker.init(kept, walked.ray, flight, unused);
        }
        int calls = 0;
        const auto force = [&] {
          if (calls++ != at) return;
          const typename LaneIndex<float, 1>::Tag integers;
          const hn::RebindToUnsigned<decltype(integers)> words;
          state[0] = hn::Zero(words);
          state[3] = hn::Set(words, end);
        };
        const auto goes_on = [&] {
          force();
          LaneFlight<float, 1> there = in_flight();
          return !none(LaneMask<float, 1>(tracker.propose(walk, walked.ray, there, rng)));
        };
        while (goes_on()) {
          float t;
          flight.position().store(&t);
          ++lookups;
          ASSERT_TRUE(t >= 0 && t <= 1) << E<Real>::kName << " " << t;
          force();
          tracker.consume(walk, walked.ray, in_flight(), Pack(static_cast<float>(walked.extinction(t))), rng);
          if constexpr (kKeeps)
            tracker.keep(
                walk, walked.ray, in_flight(), LaneMask<float, 1>(true), [&](std::size_t) -> auto& { return kept; });
        }
        float result;
        if constexpr (kKeeps) {
          tracker.finish(kept, walked.ray);
          result = static_cast<float>(tracker.result(kept, walked.ray));
        } else {
          Pack(tracker.result(walk, walked.ray)).store(&result);
        }
        ASSERT_TRUE(std::isfinite(result)) << E<Real>::kName << " call " << at << " of " << calls;
        if (calls <= at) at = kCalls;
      }
  }
}

template <template <class> class E>
void hold_all() {
  SCOPED_TRACE(E<Real>::kName);
  for (const auto& medium : media()) {
    SCOPED_TRACE(fmt::format("extinction at most {}", medium->extrema(medium->bounds()).maximum[0]));
    if constexpr (!requires { E<Real>::kNeedsShares; })
      hold<E, Spectrum>(std::make_shared<Spectral>(medium, std::vector<Real>{1, 0, 0.01}));
    hold<E, Real>(medium);
    if constexpr (runs_in_lanes<E>()) hold_in_float<E>(medium);
  }
}

TEST(ForcedDraws, NoTrackerIsUndefinedAtTheEndsOfTheRange) {
#define NULLMARK_HOLD(Estimator) hold_all<Estimator>();
  NULLMARK_EVERY_ESTIMATOR(NULLMARK_HOLD)
#undef NULLMARK_HOLD
}

/// What the forced states draw: the ends of the range, of a flight as well.
TEST(ForcedDraws, AreTheEndsOfTheRange) {
  EXPECT_EQ(negative_logarithm(1 - Real{0}), 0);
  EXPECT_NEAR(negative_logarithm(1 - kLargestUniform), 53 * std::log(2.), 1e-13);
  using Streams = LaneRng<float, 1>;
  const hn::RebindToUnsigned<typename LaneIndex<float, 1>::Tag> words;
  for (const std::uint32_t end : {std::uint32_t{0}, ~std::uint32_t{0}}) {
    auto state = Streams::seeded({1, 2, 3});
    state[0] = hn::Zero(words);
    state[3] = hn::Set(words, end);
    float u, e;
    auto same = state;
    Streams(state, true).uniform().store(&u);
    Streams(same, true).exponential().store(&e);
    EXPECT_EQ(u, end == 0 ? 0.f : 1 - 0x1p-24f);
    EXPECT_NEAR(e, end == 0 ? 0 : 24 * std::log(2.), 1e-5);
  }
}

}  // namespace
}  // namespace nullmark
