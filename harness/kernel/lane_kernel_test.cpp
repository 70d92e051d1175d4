#include "harness/kernel/lane_kernel.h"

#include <gtest/gtest.h>

#include "estimators/analog_decomposition.h"
#include "estimators/delta.h"
#include "estimators/hero_wavelength.h"
#include "estimators/jackknife.h"
#include "estimators/majorant_guided_ratio.h"
#include "estimators/marching_inversion.h"
#include "estimators/mis_bidirectional.h"
#include "estimators/mis_unidirectional.h"
#include "estimators/next_flight_delta.h"
#include "estimators/next_flight_ratio.h"
#include "estimators/null_collision.h"
#include "estimators/p_series_cmf.h"
#include "estimators/p_series_cumulative.h"
#include "estimators/p_series_next_flight.h"
#include "estimators/p_series_ratio.h"
#include "estimators/published_next_flight_ratio.h"
#include "estimators/ratio.h"
#include "estimators/ratio_roulette.h"
#include "estimators/ray_marching.h"
#include "estimators/residual_delta.h"
#include "estimators/residual_ratio.h"
#include "estimators/spectral.h"
#include "estimators/telescoping.h"
#include "estimators/telescoping_difference.h"
#include "estimators/unbiased_ray_marching.h"
#include "estimators/weighted_decomposition.h"
#include "estimators/weighted_delta.h"
#include "harness/kernel/estimator_template.h"
#include "harness/kernel/lane_kernel_test.h"
#include "harness/registry/components.h"

namespace nullmark {
namespace {

template <template <class> class Estimator, class T, std::size_t N>
LaneKernel<Estimator, T, N> lanes(const Estimator<Real>& estimator, const auto& configure) {
  Estimator<Lanes<T, N>> same;
  configure(same);
  return {estimator, same};
}

/// One walk at a time, one lane and a register's lanes: the same samples, in double bit for bit those of the plain loop.
template <template <class> class Estimator>
void compare_widths(const auto& configure, Quantity quantity = Quantity::transmittance) {
  Estimator<Real> estimator;
  configure(estimator);
  const BlockKernel<Estimator, Real> plain(estimator, 1);
  for (const Case& with : cases()) {
    const std::string where = std::string(Estimator<Real>::kName) + " " + with.name;
    // 700 is no multiple of any block or register.
    const Sampled scalar = sampled(plain, with, 700, quantity);
    expect_same(scalar, sampled(lanes<Estimator, double, kNativeLanes<double>>(estimator, configure), with, 700, quantity),
                where + ", lanes against plain");
    expect_same(scalar, sampled(lanes<Estimator, double, 1>(estimator, configure), with, 700, quantity),
                where + ", one lane against plain");
    expect_same(sampled(lanes<Estimator, float, kNativeLanes<float>>(estimator, configure), with, 700, quantity),
                sampled(lanes<Estimator, float, 1>(estimator, configure), with, 700, quantity), where + ", float");
  }
}

constexpr auto kAsItIs = [](auto&) {};

TEST(Lanes, RatioTrackingIsTheSameAtEveryWidth) { compare_widths<RatioTracking>(kAsItIs); }
TEST(Lanes, DeltaTrackingIsTheSameAtEveryWidth) { compare_widths<DeltaTracking>(kAsItIs); }
TEST(Lanes, WeightedDeltaTrackingIsTheSameAtEveryWidth) { compare_widths<WeightedDeltaTracking>(kAsItIs); }
TEST(Lanes, NextFlightRatioTrackingIsTheSameAtEveryWidth) { compare_widths<NextFlightRatioTracking>(kAsItIs); }
TEST(Lanes, UnidirectionalMisIsTheSameAtEveryWidth) { compare_widths<UnidirectionalMis>(kAsItIs); }
TEST(Lanes, BidirectionalMisIsTheSameAtEveryWidth) { compare_widths<BidirectionalMis>(kAsItIs); }
TEST(Lanes, NextFlightDeltaTrackingIsTheSameAtEveryWidth) {
  compare_widths<NextFlightDeltaTracking>(kAsItIs);
  compare_widths<NextFlightDeltaTracking>([](auto& estimator) { estimator.variant = "b"; });
}
TEST(Lanes, MajorantGuidedRatioTrackingIsTheSameAtEveryWidth) {
  for (const char* start : {"majorant", "lookup"})
    compare_widths<MajorantGuidedRatio>([&](auto& estimator) { estimator.start = start; });
}
TEST(Lanes, ResidualDeltaTrackingIsTheSameAtEveryWidth) { compare_widths<ResidualDeltaTracking>(kAsItIs); }
TEST(Lanes, ResidualRatioTrackingIsTheSameAtEveryWidth) {
  for (const char* control : {"minimum", "average", "gamma", "linear", "exponential", "ray_average"})
    for (const char* component : {"product", "control", "residual"})
      compare_widths<ResidualRatioTracking>([&](auto& estimator) {
        estimator.choice.kind = control;
        estimator.choice.value = 0.5;
        estimator.choice.value_end = 2;
        estimator.component = component;
      });
  // Deep enough for roots of weights, in float and in double.
  compare_widths<ResidualRatioTracking>([](auto& estimator) {
    estimator.choice.kind = "given";
    estimator.choice.value = 2000;
  });
}
TEST(Lanes, RouletteIsTheSameAtEveryWidth) {
  for (const Real threshold : {0.05, 0.25})
    compare_widths<RatioRoulette>([&](auto& estimator) { estimator.threshold = threshold; });
}
TEST(Lanes, DecompositionTrackingIsTheSameAtEveryWidth) {
  for (const bool of_albedo : {false, true}) {
    compare_widths<AnalogDecompositionTracking>([&](auto& estimator) {
      estimator.factor = 0.8;
      if (of_albedo) estimator.control_albedo = {0.4};
    });
    for (const char* control : {"minimum", "average", "maximum"})
      compare_widths<WeightedDecompositionTracking>([&](auto& estimator) {
        estimator.control = control;
        if (of_albedo) estimator.control_albedo = {0.4};
      });
  }
}
TEST(Lanes, TrackersThatChooseAmongEventsAreTheSameAtEveryWidth) {
  compare_widths<HeroWavelengthTracking>(kAsItIs);
  for (const auto scheme : {SpectralScheme::maximum, SpectralScheme::history_aware_average})
    compare_widths<SpectralTracking>([&](auto& estimator) { estimator.scheme = scheme; });
  for (const char* roulette : {"one", "three"})
    for (const char* probabilities : {"proportional", "fixed"})
      compare_widths<NullCollisionTracking>([&](auto& estimator) {
        estimator.roulette = roulette;
        estimator.probabilities = probabilities;
      });
}
TEST(Lanes, UnbiasedRayMarchingIsTheSameAtEveryWidth) {
  for (const bool ends : {false, true})
    for (const char* control : {"majorant", "majorant_minorant"})
      compare_widths<UnbiasedRayMarching>([&](auto& estimator) {
        estimator.endpoint_matching = ends;
        estimator.control = control;
      });
}
TEST(Lanes, RayMarchingIsTheSameAtEveryWidth) {
  for (const char* offset : {"left", "midpoint", "right", "uniform", "stratified"})
    for (const Quantity quantity : {Quantity::transmittance, Quantity::optical_depth})
      compare_widths<RayMarching>(
          [&](auto& estimator) {
            estimator.steps = 13;
            estimator.offset = offset;
          },
          quantity);
}

TEST(Lanes, PowerSeriesAreTheSameAtEveryWidth) {
  compare_widths<PowerSeriesRatio>(kAsItIs);
  compare_widths<PowerSeriesNextFlight>(kAsItIs);
  compare_widths<PowerSeriesCmf>(kAsItIs);
  compare_widths<PowerSeriesCumulative>(kAsItIs);
}
TEST(Lanes, JackknifeMarchesAreTheSameAtEveryWidth) {
  for (const int m : {2, 3, 4})
    for (const char* jitter : {"stratified", "uniform"})
      for (const char* mean : {"jackknife", "naive"})
        compare_widths<Jackknife>([&](auto& estimator) {
          estimator.m = m;
          estimator.steps = 3;
          estimator.jitter = jitter;
          estimator.mean = mean;
        });
}
TEST(Lanes, InvertedMarchesAreTheSameAtEveryWidth) {
  for (const Quantity quantity : {Quantity::transmittance, Quantity::optical_depth})
    compare_widths<MarchingInversion>(kAsItIs, quantity);
}
TEST(Lanes, TelescopingMarchesAreTheSameAtEveryWidth) {
  compare_widths<Telescoping>(kAsItIs);
  for (const char* marches : {"correlated", "independent"})
    compare_widths<TelescopingDifference>([&](auto& estimator) {
      estimator.level = 2;
      estimator.marches = marches;
    });
}

/// e^{-M} underflows and W overflows, in float even more: the powers of 2 that are set aside are each walk's own.
TEST(Lanes, DeepSeriesAreTheSameAtEveryWidth) {
  Case deep = cases()[0];
  for (const Real bound : {20., 60., 200., 1000.}) {
    deep.majorant = std::make_shared<GlobalMajorant>(*deep.medium, bound);
    const auto expect = [&](const auto& series) {
      const auto source = make_estimator({series, {}, {}, {}});
      const Sampled plain = sampled(*source->kernel(1, Precision::float64, false), deep, 100);
      expect_same(plain, sampled(*source->kernel(1), deep, 100), series);
      const Sampled single = sampled(*source->kernel(1, Precision::float32), deep, 100);
      Real mean = 0, in_double = 0;
      for (std::size_t i = 0; i < 100; ++i) {
        mean += single.values[i] / 100;
        in_double += plain.values[i] / 100;
        EXPECT_TRUE(std::isfinite(single.values[i])) << series << " " << bound;
      }
      EXPECT_NEAR(mean, in_double, 0.5 * in_double) << series << " " << bound;
    };
    expect("p_series_cmf");
    expect("p_series_cumulative");
  }
}

/// Constant extinction leaves no variance, and in float no rounding that grows with the lookups: a verdict that expects none
/// would FAIL the longest walks.
TEST(Lanes, LongMarchesInFloatKeepTheirDigits) {
  constexpr std::size_t kSamples = 1 << 16;
  const Case constant = cases()[0];
  const EstimatorTemplate<Telescoping> telescoping;
  const Real exact = sampled(*telescoping.kernel(1), constant, 2).values[0];
  const Sampled single = sampled(*telescoping.kernel(1, Precision::float32), constant, kSamples);
  for (const Real value : single.values) ASSERT_NEAR(value, exact, 4 * 0x1p-24 * exact);
  EXPECT_GT(*std::max_element(single.lookups.begin(), single.lookups.end()), 500u);
}

/// A constant medium that counts the points it is asked for.
class Counting final : public Medium {
 public:
  using Medium::extinction;
  Box bounds() const override { return {Vec3::Zero(), Vec3::Ones()}; }
  void extinction(const Points& points, Real* out) const override {
    asked += points.size;
    std::fill_n(out, points.size, 1.);
  }
  Extrema extrema(const Box&) const override { return Extrema::grey(1, 1, 1); }

  mutable std::size_t asked = 0;
};

/// Where lookups are expensive, those of idle lanes would take most of the time.
TEST(Lanes, IdleLanesOfAHalfEmptyRegisterLookNothingUp) {
  for (const Precision precision : {Precision::float64, Precision::float32}) {
    const auto medium = std::make_shared<const Counting>();
    const Case few{"counting", medium, std::make_shared<GlobalMajorant>(*medium, 1), cases()[0].world};
    const Sampled marched = sampled(*EstimatorTemplate<RayMarching>().kernel(1, precision), few, 2);
    EXPECT_EQ(marched.counters.lookups, 2 * 32u);
    EXPECT_EQ(medium->asked, 2 * 32u);
  }
}

/// A ray that misses the medium has nothing to look up.
TEST(Lanes, AnEmptyRayIsPassed) {
  Case with = cases()[0];
  with.world = {{0.5, 0.5, 3}, {1, 0, 0}, 0, kInfinity};
  const Sampled missed = sampled(*EstimatorTemplate<RatioTracking>().kernel(1, Precision::float32), with, 100);
  EXPECT_EQ(missed.values, std::vector<Real>(100, 1));
  EXPECT_EQ(missed.counters.lookups, 0u);
}

/// Samples of lanes are addressed: any cut of a run gives the same.
TEST(Lanes, SamplesDoNotDependOnTheirNeighbours) {
  const Case with = cases()[4];
  for (const Precision precision : {Precision::float64, Precision::float32}) {
    const auto kernel = EstimatorTemplate<NextFlightRatioTracking>().kernel(1, precision);
    const Sampled all = sampled(*kernel, with, 600);
    for (const std::size_t count : {1, 2, 37}) {
      const Sampled some = sampled(*kernel, with, count);
      EXPECT_TRUE(std::equal(some.values.begin(), some.values.end(), all.values.begin())) << count;
      EXPECT_TRUE(std::equal(some.lookups.begin(), some.lookups.end(), all.lookups.begin())) << count;
    }
  }
}

/// Float's own means: against double's on the same ray, within six standard errors of both and what 24 bits leave.
TEST(Lanes, SinglePrecisionKeepsTheMean) {
  constexpr std::size_t kSamples = 1 << 17;
  for (const Case& with : cases()) {
    if (with.name.find("violated") != std::string::npos) continue;
    const EstimatorTemplate<RatioTracking> ratio;
    const auto moments = [&](Precision precision) {
      const Sampled run = sampled(*ratio.kernel(1, precision), with, kSamples);
      Real sum = 0, square = 0;
      for (const Real x : run.values) {
        sum += x;
        square += x * x;
      }
      const Real mean = sum / kSamples;
      return std::pair{mean, (square / kSamples - mean * mean) / kSamples};
    };
    const auto [in_double, error_double] = moments(Precision::float64);
    const auto [in_single, error_single] = moments(Precision::float32);
    EXPECT_NEAR(in_single, in_double, 6 * std::sqrt(error_double + error_single) + 1e-5) << with.name;
  }
}

/// Trackers derived from one that runs in lanes, with steps of their own, keep to the plain loop; nothing else has a float form.
TEST(Lanes, OnlyTrackersWrittenForThemRunInLanes) {
  EXPECT_TRUE(runs_in_lanes<RatioTracking>());
  EXPECT_FALSE(runs_in_lanes<PublishedNextFlightRatioTracking>());
  EXPECT_EQ(EstimatorTemplate<PublishedNextFlightRatioTracking>().kernel(1, Precision::float32), nullptr);
  EXPECT_EQ(EstimatorTemplate<RatioTracking>().kernel(3, Precision::float32), nullptr);
  const auto kernel = EstimatorTemplate<RatioTracking>().kernel(1, Precision::float32);
  EXPECT_FALSE(kernel->answers(Quantity::transmittance_profile));
  EXPECT_FALSE(kernel->flies());
}

/// Steps with denormal numbers take a CPU hundreds of cycles.
TEST(Lanes, ExponentialsInFloatAreNormalOrZero) {
  using Pack = Lanes<float, kNativeLanes<float>>;
  const auto of = [](float x) {
    float result[kNativeLanes<float>];
    exponential(Pack(x)).store(result);
    return result[0];
  };
  for (int i = -11000; i <= 500; ++i) {
    const float x = static_cast<float>(i) / 100, result = of(x);
    const double exact = std::exp(static_cast<double>(x));
    if (exact < static_cast<double>(std::numeric_limits<float>::min()))
      EXPECT_EQ(result, 0) << x;
    else
      EXPECT_NEAR(result, exact, 1.2e-7 * exact) << x;
  }
  EXPECT_EQ(of(-std::numeric_limits<float>::infinity()), 0);
}

/// Streams of a register are those of its samples' addresses.
TEST(Lanes, StreamsAreThoseOfTheAddresses) {
  constexpr std::size_t kWidth = kNativeLanes<double>;
  const SampleAddress first{0x123456789abcdef, 77, (std::uint64_t{1} << 32) - 3};
  auto state = LaneRng<double, kWidth>::seeded(first);
  LaneRng<double, kWidth> streams(state, true);
  std::vector<Rng> plain;
  for (std::size_t k = 0; k < kWidth; ++k) plain.emplace_back(SampleAddress{first.key, first.ray, first.sample + k});
  for (int draw = 0; draw < 50; ++draw) {
    double together[kWidth];
    (draw % 2 ? streams.uniform() : streams.exponential()).store(together);
    for (std::size_t k = 0; k < kWidth; ++k)
      EXPECT_EQ(together[k], draw % 2 ? plain[k].uniform() : plain[k].exponential()) << draw << " " << k;
  }
  EXPECT_EQ(streams.draws(), 50 * kWidth);
}

}  // namespace
}  // namespace nullmark
