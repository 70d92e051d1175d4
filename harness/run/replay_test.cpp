// Recorded walks against products written out anew in extended precision: no statistics, so no depth is too great.

#include <gtest/gtest.h>

#include <cmath>

#include "harness/config/config.h"
#include "harness/registry/components.h"
#include "harness/sampling/scene.h"

namespace nullmark {
namespace {

constexpr std::uint64_t kKey = 12345;
constexpr std::size_t kSamples = 300;

/// Walks of one tracker through a box along x, written down.
struct Replay {
  Recording recording;
  SampleBlock block;
  std::vector<Segment> segments;

  Replay(const std::string& estimator, const MediumSpec& spec, const std::string& majorant, const ParameterValues& values) {
    const BuiltMedium medium = build_medium(spec);
    Component structure;
    structure.type = majorant;
    structure.values = values;
    Component rays;
    rays.type = "single";
    const BuiltRays built = build_rays(rays, medium);
    Component tracker;
    tracker.type = estimator;
    const auto kernel = make_estimator(tracker)->kernel(1);
    PreparedRay context;
    context.world = built.world.at(0);
    context.local = built.local.at(0);
    const auto bounds = make_majorant(structure)->build(medium.medium);
    context.bounds.start(*bounds, context.world, context.local);
    segments = context.bounds.segments();
    const auto workspace = kernel->workspace();
    kernel->begin_ray(*workspace, *medium.medium, medium.extrema, context);
    Counters counters;
    workspace->recording = &recording;
    kernel->sample(*workspace, *medium.medium, context, kKey, 0, kSamples, Quantity::transmittance, block, counters);
  }
};

MediumSpec medium(const std::string& type, Real depth) {
  MediumSpec spec;
  spec.field.type = type;
  spec.field.values["optical_depth"] = depth;
  return spec;
}

const std::vector<MediumSpec>& media() {
  static const std::vector<MediumSpec> kMedia = {medium("linear", 1), medium("linear", 20), medium("cosine", 100),
                                                 medium("exponential", 600), medium("layers", 0.01)};
  return kMedia;
}

/// Same to 1e-12, or both lost below the smallest double.
void expect_same(Real computed, long double exact) {
  if (std::abs(exact) < 1e-290L) {
    EXPECT_LT(std::abs(computed), 1e-280);
    return;
  }
  EXPECT_LT(std::abs(static_cast<long double>(computed) / exact - 1), 1e-12L) << computed;
}

template <class Check>
void for_all(const std::string& estimator, Check check) {
  for (const MediumSpec& spec : media())
    for (const auto& [structure, values] :
         {std::pair<std::string, ParameterValues>{"global", {{"looseness", 1.5}}}, {"grid", {{"resolution", 7}}}}) {
      const Replay replay(estimator, spec, structure, values);
      ASSERT_EQ(replay.recording.walks.size(), kSamples);
      for (std::size_t i = 0; i < kSamples; ++i) {
        const Recording::Walk& walk = replay.recording.walks[i];
        EXPECT_EQ(walk.steps.size(), replay.block.lookups[i]);
        check(walk, replay.block.values[i], i);
      }
    }
}

TEST(Replay, RatioTrackingIsTheProductOfNullProbabilities) {
  for_all("ratio", [](const Recording::Walk& walk, Real value, std::size_t) {
    long double weight = 1;
    for (std::size_t k = 0; k < walk.steps.size(); ++k)
      weight *= 1 - static_cast<long double>(walk.extinction[k]) / static_cast<long double>(walk.steps[k].rate);
    // Factors near zero lose digits to the subtraction in double.
    if (std::abs(weight) > 1e-12L) expect_same(value, weight);
  });
}

TEST(Replay, NextFlightRatioTrackingIsTheSumOfWeightedEscapes) {
  for_all("next_flight_ratio", [](const Recording::Walk& walk, Real value, std::size_t) {
    const long double total = walk.total_depth;
    long double weight = 1, sum = std::exp(-total);
    for (std::size_t k = 0; k < walk.steps.size(); ++k) {
      weight *= 1 - static_cast<long double>(walk.extinction[k]) / static_cast<long double>(walk.steps[k].rate);
      sum += weight * std::exp(static_cast<long double>(walk.steps[k].depth) - total);
    }
    if (sum > 1e-12L) expect_same(value, sum);
  });
}

TEST(Replay, DeltaTrackingDiesWhereItsOwnRandomNumberSaysSo) {
  for_all("delta", [](const Recording::Walk& walk, Real value, std::size_t sample) {
    Rng rng(SampleAddress{kKey, 0, sample});
    bool alive = true;
    for (std::size_t k = 0; k < walk.steps.size(); ++k) {
      ASSERT_TRUE(alive) << "lookups after death";
      rng.exponential();
      alive = !(rng.uniform() * walk.steps[k].rate < walk.extinction[k]);
    }
    EXPECT_EQ(value, alive ? 1 : 0);
    EXPECT_EQ(walk.draws, 2 * walk.steps.size() + (alive ? 1 : 0));
  });
}

/// Flights are sums of exponentials of the stream, in the order drawn.
TEST(Replay, CollisionsLieWhereTheStreamPutsThem) {
  for_all("ratio", [](const Recording::Walk& walk, Real, std::size_t sample) {
    Rng rng(SampleAddress{kKey, 0, sample});
    long double depth = 0;
    for (const Recording::Step& step : walk.steps) {
      depth -= std::log1p(-static_cast<long double>(rng.uniform()));
      EXPECT_NEAR(step.depth, static_cast<Real>(depth), 1e-12 * (1 + step.depth));
    }
    EXPECT_EQ(walk.draws, walk.steps.size() + 1);
  });
}

/// T(a,c) = E[T(a,b) T(b,c)] with streams of their own for both parts: products of samples of the halves against the whole.
TEST(Replay, TransmittanceMultiplies) {
  const BuiltMedium built = build_medium(medium("cosine", 2));
  Component single, bound, tracker;
  single.type = "single";
  bound.type = "global";
  bound.values["looseness"] = 1.5;
  const BuiltRays rays = build_rays(single, built);
  const auto structure = make_majorant(bound)->build(built.medium);
  for (const char* name : {"ratio", "delta", "next_flight_ratio", "next_flight_delta", "residual_ratio", "residual_delta"}) {
    tracker.type = name;
    const auto kernel = make_estimator(tracker)->kernel(1);
    constexpr std::size_t kCount = 200000;
    std::vector<Real> product(kCount, 1);
    for (std::uint32_t part = 0; part < 2; ++part) {
      PreparedRay context;
      context.index = part;
      context.world = rays.world[0];
      context.local = rays.local[0];
      const Real cut = context.world.begin + 0.37 * context.world.length();
      for (Ray* ray : {&context.world, &context.local}) (part == 0 ? ray->end : ray->begin) = cut;
      context.bounds.start(*structure, context.world, context.local);
      const auto workspace = kernel->workspace();
      kernel->begin_ray(*workspace, *built.medium, built.extrema, context);
      SampleBlock block;
      Counters counters;
      kernel->sample(*workspace, *built.medium, context, kKey, 0, kCount, Quantity::transmittance, block, counters);
      for (std::size_t i = 0; i < kCount; ++i) product[i] *= block.values[i];
    }
    Real mean = 0, squares = 0;
    for (const Real x : product) {
      mean += x / kCount;
      squares += x * x / kCount;
    }
    // 4e-8 a test, two-sided; relative variances here are below 30.
    EXPECT_NEAR(mean, std::exp(-2.), 5.5 * std::sqrt((squares - mean * mean) / kCount)) << name;
  }
}

/// The number of draws is part of a tracker's contract: one more, and every result changes.
TEST(Replay, DrawsArePinned) {
  for (const char* name : {"ratio", "next_flight_ratio", "residual_ratio"}) {
    const Replay replay(name, medium("linear", 3), "global", {{"looseness", 2.0}});
    for (const Recording::Walk& walk : replay.recording.walks) EXPECT_EQ(walk.draws, walk.steps.size() + 1) << name;
  }
  for (const char* name : {"delta", "next_flight_delta", "residual_delta"}) {
    const Replay replay(name, medium("linear", 3), "global", {{"looseness", 2.0}});
    for (std::size_t i = 0; i < kSamples; ++i) {
      const Recording::Walk& walk = replay.recording.walks[i];
      const bool died = walk.depth < walk.total_depth;
      EXPECT_EQ(walk.draws, 2 * walk.steps.size() + (died ? 0 : 1)) << name;
    }
  }
}

}  // namespace
}  // namespace nullmark
