// Walks of several channels in registers.

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "harness/kernel/lane_kernel_test.h"
#include "harness/registry/components.h"
#include "media/base/colour_lanes.h"

namespace nullmark {
namespace {

/// The same samples as in the plain loop, bit for bit.
void expect_plain_samples(const Component& component, const std::vector<Real>& spectrum) {
  const auto source = make_estimator(component);
  const int channels = static_cast<int>(spectrum.size());
  const auto plain = source->kernel(channels, Precision::float64, false), lanes = source->kernel(channels);
  for (const Quantity quantity : {Quantity::transmittance, Quantity::optical_depth}) {
    if (!plain->answers(quantity)) continue;
    ASSERT_TRUE(lanes->in_lanes(quantity)) << component.type;
    for (const Case& with : cases(spectrum))
      expect_same(sampled(*plain, with, 700, quantity), sampled(*lanes, with, 700, quantity), component.type + " " + with.name);
  }
}

const std::vector<Real> kThree = {0.3, 1, 0.6}, kFour = {1, 0.8, 0.6, 0.4};

TEST(LaneColours, EveryTrackerInLanesHasTheSamplesOfThePlainLoop) {
  std::set<std::string> tried;
  for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries()) {
    if (!entry.in_lanes || entry.planted || entry.foreign || !make_estimator({entry.name, {}, {}, {}})->kernel(3)) continue;
    tried.insert(entry.name);
    expect_plain_samples({entry.name, {}, {}, {}}, kThree);
    expect_plain_samples({entry.name, {}, {}, {}}, kFour);
  }
  // None of ours fell back to the plain loop; a user's own may be there as well.
  for (const char* name : {"delta",
                           "hero_wavelength",
                           "jackknife",
                           "majorant_guided_ratio",
                           "marching_inversion",
                           "mis_bidirectional",
                           "mis_unidirectional",
                           "next_flight_delta",
                           "next_flight_ratio",
                           "null_collision",
                           "p_series_cmf",
                           "p_series_cumulative",
                           "p_series_next_flight",
                           "p_series_ratio",
                           "ratio",
                           "ratio_roulette",
                           "ray_marching",
                           "residual_delta",
                           "residual_ratio",
                           "spectral",
                           "telescoping",
                           "unbiased_ray_marching",
                           "weighted_delta"})
    EXPECT_TRUE(tried.contains(name)) << name;
}

TEST(LaneColours, ParametersChangeNothingOfThat) {
  expect_plain_samples({"next_flight_delta", {{"variant", "b"}}, {}, {}}, kFour);
  expect_plain_samples({"majorant_guided_ratio", {{"start", "lookup"}}, {}, {}}, kFour);
  for (const char* offset : {"left", "uniform", "stratified"})
    expect_plain_samples({"ray_marching", {{"steps", 13}, {"offset", offset}}, {}, {}}, kFour);
  for (const int m : {3, 4}) expect_plain_samples({"jackknife", {{"m", m}, {"steps", 3}}, {}, {}}, kFour);
  expect_plain_samples({"jackknife", {{"mean", "naive"}, {"jitter", "uniform"}}, {}, {}}, kThree);
  for (const char* control : {"average", "gamma", "ray_average"}) {
    expect_plain_samples({"residual_ratio", {{"control", control}}, {}, {}}, kFour);
    expect_plain_samples({"residual_delta", {{"control", control}}, {}, {}}, kThree);
  }
  expect_plain_samples({"unbiased_ray_marching", {{"endpoint_matching", true}}, {}, {}}, kThree);
  for (const char* scheme : {"maximum", "average", "history_aware_maximum"})
    expect_plain_samples({"spectral", {{"scheme", scheme}}, {}, {}}, kFour);
  expect_plain_samples({"null_collision", {{"probabilities", "fixed"}, {"roulette", "three"}}, {}, {}}, kThree);
  for (const char* control : {"linear", "exponential"})
    expect_plain_samples({"residual_ratio", {{"control", control}, {"value", .5}, {"value_end", 2.}}, {}, {}}, kFour);
}

/// Channels that walk apart, other numbers of channels and single precision have no lanes.
TEST(LaneColours, TheOthersTakeThePlainLoop) {
  const auto in_lanes = [](const Component& component, int channels) {
    return make_estimator(component)->kernel(channels)->in_lanes(Quantity::transmittance);
  };
  EXPECT_TRUE(in_lanes({"delta", {}, {}, {}}, 4));
  EXPECT_FALSE(in_lanes({"delta", {{"walks", "separate"}}, {}, {}}, 4));
  for (const int channels : {1, 4}) EXPECT_FALSE(in_lanes({"spectral", {{"control", "minimum"}}, {}, {}}, channels));
  EXPECT_FALSE(in_lanes({"ratio", {}, {}, {}}, 2));
  EXPECT_FALSE(in_lanes({"ratio", {}, {}, {}}, 16));
  EXPECT_EQ(make_estimator({"ratio", {}, {}, {}})->kernel(4, Precision::float32), nullptr);
}

TEST(LaneColours, SamplesAreReadTogetherAndChannelsApart) {
  constexpr std::size_t kWidth = kNativeLanes<Real>;
  const auto expect = [](auto colours) {
    constexpr std::size_t kChannels = decltype(colours)::kChannels;
    Real numbers[kWidth * kChannels], lanes[kWidth];
    for (std::size_t i = 0; i < kWidth * kChannels; ++i) numbers[i] = static_cast<Real>(i) + 0.5;
    colours = decltype(colours)::load(numbers);
    for (std::size_t c = 0; c < kChannels; ++c) {
      colours[c].store(lanes);
      for (std::size_t k = 0; k < kWidth; ++k) EXPECT_EQ(lanes[k], numbers[k * kChannels + c]);
    }
  };
  expect(LaneColours<Real, kWidth, 3>());
  expect(LaneColours<Real, kWidth, 4>());
}

}  // namespace
}  // namespace nullmark
