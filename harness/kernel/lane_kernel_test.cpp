#include "harness/kernel/lane_kernel.h"

#include <gtest/gtest.h>

#include "estimators/delta.h"
#include "estimators/majorant_guided_ratio.h"
#include "estimators/mis_unidirectional.h"
#include "estimators/next_flight_delta.h"
#include "estimators/next_flight_ratio.h"
#include "estimators/published_next_flight_ratio.h"
#include "estimators/ratio.h"
#include "estimators/ray_marching.h"
#include "estimators/residual_delta.h"
#include "estimators/residual_ratio.h"
#include "estimators/weighted_delta.h"
#include "harness/kernel/estimator_template.h"
#include "harness/testing/built_media.h"
#include "media/cosine.h"
#include "media/exponential_cube.h"
#include "media/gaussian_bump.h"
#include "media/gaussian_hole.h"
#include "media/layers.h"
#include "media/majorants/global.h"
#include "media/majorants/grid.h"
#include "media/volumes/volume.h"

namespace nullmark {
namespace {

constexpr std::uint64_t kKey = 0x5eed, kFirst = (std::uint64_t{1} << 33) - 1000;

struct Sampled {
  std::vector<Real> values;
  std::vector<std::uint32_t> lookups;
  Counters counters;
};

struct Case {
  std::string name;
  std::shared_ptr<const Medium> medium;
  std::shared_ptr<const MajorantStructure> majorant;
  Ray world;
};

/// Voxels 0 to 31 on each axis, a smooth blob with a vacuum around it.
std::shared_ptr<const Medium> volume() {
  auto data = std::make_shared<VolumeData>();
  data->active = {Index3::Constant(2), Index3::Constant(29)};
  const auto value = [](int i, int j, int k) {
    const Real x = i - 15.3, y = j - 14.8, z = k - 16.1;
    const Real r = (x * x + y * y + 2 * z * z) / 100;
    return r < 1 ? static_cast<float>(0.8 * (1 - r) + 0.1 * std::cos(i * 1.7 + j)) : 0.f;
  };
  data->values = BrickGrid::build(
      {Index3::Constant(0), Index3::Constant(31)}, 0.f,
      [](const Index3&, const auto& shape, const auto& visit) { visit(0, shape[0] * shape[1] * shape[2], nullptr); },
      [&](const Index3& at, float* out) {
        for (int i = 0; i <= 8; ++i)
          for (int j = 0; j <= 8; ++j)
            for (int k = 0; k <= 8; ++k) *out++ = std::max(0.f, value(at[0] + i, at[1] + j, at[2] + k));
      },
      [](std::size_t n, const auto& body) {
        for (std::size_t i = 0; i < n; ++i) body(i);
      });
  data->index_to_world = Affine(Eigen::Scaling(Vec3::Constant(Real{1} / 32)));
  return std::make_shared<FilteredVolume<TrilinearFilter>>(std::move(data), Real{40});
}

std::vector<Case> cases() {
  GaussianBump bump;
  bump.profile.amplitude = 9;
  GaussianHole hole;
  hole.profile.level = 6;
  Cosine cosine;
  cosine.target_depth = 4;
  ExponentialCube cube;
  const Ray slanted{{0.02, 0.1, 0.3}, Vec3(1, 0.5, 0.25).normalized(), 0, kInfinity};
  std::vector<Case> all;
  const auto add = [&](const std::string& name, std::shared_ptr<const Medium> medium, const Ray& world) {
    const auto with = [&](const std::string& majorant, std::shared_ptr<const MajorantStructure> structure) {
      all.push_back({name + "/" + majorant, medium, std::move(structure), world});
    };
    with("global", std::make_shared<GlobalMajorant>(*medium, 1.5));
    with("violated", std::make_shared<GlobalMajorant>(*medium, 0.7));
    with("grid", std::make_shared<GridMajorant>(*medium, std::array{7, 3, 5}, 1));
    with("rewind", std::make_shared<GridMajorant>(*medium, std::array{7, 3, 5}, 1.2, Crossing::rewind));
  };
  cube.profile.x0 = 0.01;
  add("constant", constant(3), slanted);
  add("bump", built(bump), slanted);
  add("hole", built(hole), slanted);
  add("cosine", built(cosine), slanted);
  add("cube", built(cube), slanted);
  add("volume", volume(), slanted);
  // Along an axis two coordinates of a walk's points stay as they are.
  add("volume along x", volume(), {{-1, 0.4, 0.6}, {1, 0, 0}, 0, kInfinity});
  add("volume along -y", volume(), {{0.4, 2, 0.6}, {0, -1, 0}, 0, kInfinity});
  add("volume along z", volume(), {{0.6, 0.4, -1}, {0, 0, 1}, 0, kInfinity});
  return all;
}

Sampled sampled(const Kernel& kernel, const Case& with, std::size_t count, Quantity quantity = Quantity::transmittance) {
  const auto workspace = kernel.workspace();
  const Extrema extrema = with.medium->extrema(with.medium->bounds());
  PreparedRay context;
  context.index = 5;
  context.local = clipped(transformed(with.world, with.medium->world_to_local()), with.medium->bounds());
  context.world = with.world;
  context.world.begin = context.local.begin;
  context.world.end = context.local.end;
  context.bounds.start(*with.majorant, context.world, context.local);
  if (kernel.needs_optical_depth()) context.exact_depth = Spectrum::Constant(1, 1.25);
  kernel.begin_ray(*workspace, *with.medium, extrema, context);
  Sampled out;
  SampleBlock block;
  kernel.sample(*workspace, *with.medium, context, kKey, kFirst, count, quantity, block, out.counters);
  out.values = block.values;
  out.lookups = block.lookups;
  return out;
}

void expect_same(const Sampled& a, const Sampled& b, const std::string& where) {
  EXPECT_EQ(a.values, b.values) << where;
  EXPECT_EQ(a.lookups, b.lookups) << where;
  EXPECT_EQ(a.counters.lookups, b.counters.lookups) << where;
  EXPECT_EQ(a.counters.draws, b.counters.draws) << where;
  EXPECT_EQ(a.counters.null_collisions, b.counters.null_collisions) << where;
  EXPECT_EQ(a.counters.violations, b.counters.violations) << where;
  EXPECT_EQ(a.counters.largest_violation, b.counters.largest_violation) << where;
}

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
