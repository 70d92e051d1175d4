// Samples on their way to statistics and evidence, from a kernel whose samples are known.

#include "harness/sampling/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "estimators/walk/rng.h"
#include "harness/registry/components.h"

namespace nullmark {
namespace {

/// Gives the samples that a function of ray and address names, and ray + 1 lookups each.
class GivenSamples final : public Kernel {
 public:
  explicit GivenSamples(std::function<Real(std::uint32_t ray, std::uint64_t sample)> value) : value_(std::move(value)) {}

  bool needs_optical_depth() const override { return false; }
  bool needs_knots() const override { return false; }
  bool states_theory() const override { return false; }
  bool answers(Quantity) const override { return true; }
  std::unique_ptr<Workspace> workspace() const override { return std::make_unique<Workspace>(); }
  std::size_t outputs(Quantity, const PreparedRay&) const override { return 1; }
  void begin_ray(Workspace&, const Medium&, const Extrema&, const PreparedRay&) const override {}
  void sample(Workspace&, const Medium&, const PreparedRay& ray, std::uint64_t, std::uint64_t first, std::size_t count, Quantity,
              SampleBlock& out, Counters& counters) const override {
    out.values.resize(count);
    out.lookups.assign(count, ray.index + 1);
    counters.samples += count;
    counters.lookups += count * (ray.index + 1);
    for (std::size_t i = 0; i < count; ++i) out.values[i] = value_(ray.index, first + i);
  }
  Spectrum expected(const Workspace&, const Spectrum& depth, Quantity) const override { return (-depth).exp(); }
  std::vector<Theory> theory(const Workspace&, const RayProfile&, Quantity) const override { return {}; }
  bool flies() const override { return false; }
  bool states_count_law() const override { return false; }
  std::vector<CountLaw> count_law(const Workspace&, const RayProfile&) const override { return {}; }

 private:
  std::function<Real(std::uint32_t, std::uint64_t)> value_;
};

constexpr Real kTarget = 0.5, kRate = 0.01;
constexpr std::size_t kRays = 48;
constexpr std::size_t kGroups = 3;

/// Enough rays for several in a chunk, in three groups one after the other.
struct JsonNode {
  Cell cell;
  Scene scene;
  Targets targets;
  TestPlan test_plan;

  JsonNode() {
    MediumSpec homogeneous;
    homogeneous.field = {"homogeneous", {}, "homogeneous", {}};
    scene.medium = std::make_shared<BuiltMedium>(build_medium(homogeneous));
    scene.majorant = std::make_shared<BuiltMajorant>(build_majorant({"global", {}, "global", {}}, *scene.medium));
    auto rays = std::make_shared<BuiltRays>();
    rays->world.assign(kRays, {{0.1, 0.1, 0.1}, {1, 0, 0}, 0, 0.5});
    rays->local = rays->world;
    scene.rays = rays;
    targets.mean.assign(kRays, kTarget);
    targets.error.assign(kRays, 0);
    test_plan.shift.assign(kRays, 0);
    test_plan.low = 0;
    test_plan.high = 1;
    for (std::size_t ray = 0; ray < kRays; ++ray) {
      test_plan.group_of.push_back(static_cast<int>(ray * kGroups / kRays));
      test_plan.lookups.push_back(static_cast<Real>(ray) + 0.75);  // a quarter less than there are
    }
    add_test(0, MeanTest::kAllRays, 4);
    add_test(0, 0, 1);
    add_test(0, 1, 4);
    add_test(0, 2, 2);
    add_test(MeanTest::kLookups, MeanTest::kAllRays, 2);
  }

  void add_test(int channel, int group, int errors_per_sum) {
    MeanTest test;
    test.channel = channel;
    test.group = group;
    std::vector<std::pair<Role, Bet>> bets;
    for (const int side : {1, -1})
      bets.push_back({side > 0 ? Role::high : Role::low, {Bet::Kind::betting, side, 0, 0, {kRate}, errors_per_sum}});
    // Longer sums are made of the shorter ones.
    bets.push_back({Role::fail, {Bet::Kind::betting, 1, 0, 0, {kRate}, 4 * errors_per_sum}});
    test.place(std::move(bets));
    test_plan.tests.push_back(std::move(test));
  }

  /// Whether a ray's errors enter a test.
  bool takes(const MeanTest& test, std::size_t ray) const {
    return test.group == MeanTest::kAllRays || test_plan.group_of[ray] == test.group;
  }

  Sampled sample(const GivenSamples& kernel, SampleSpan span) const {
    return *sample_cell(
        cell, scene, kernel, targets, span, &test_plan, [] { return false; }, [](double) {});
  }
};

/// So many samples of a ray that several rays share a chunk, that one fills it, and that a ray takes several.
constexpr std::uint64_t kSpans[] = {16, 1024, 16384, 65536};

/// Where all samples of a ray are alike, it makes no difference which of them share a sum.
TEST(SampleCell, EveryTestGetsSumsOfAsManyErrorsAsItAsksFor) {
  const JsonNode place;
  const auto error = [](std::size_t ray) { return (static_cast<Real>(ray % 7) - 2.5) / 10; };
  const GivenSamples kernel([&](std::uint32_t ray, std::uint64_t) { return kTarget + error(ray); });
  for (const std::uint64_t samples : kSpans) {
    const Sampled sampled = place.sample(kernel, {.per_ray = samples});
    ASSERT_EQ(sampled.evidence.size(), place.test_plan.tests.size());
    for (std::size_t i = 0; i < sampled.evidence.size(); ++i) {
      const MeanTest& test = place.test_plan.tests[i];
      std::uint64_t errors = 0;
      std::vector<long double> logs(test.bets.size());
      long double total = 0;
      for (std::size_t ray = 0; ray < kRays; ++ray) {
        if (!place.takes(test, ray)) continue;
        errors += samples;
        const long double each = test.channel == MeanTest::kLookups ? 0.25L : static_cast<long double>(error(ray));
        total += static_cast<long double>(samples) * each;
        for (std::size_t b = 0; b < test.bets.size(); ++b) {
          const Bet& bet = test.bets[b].second;
          logs[b] += static_cast<long double>(samples) / bet.errors_per_sum *
                     std::log1p(bet.side * static_cast<long double>(kRate) * bet.errors_per_sum * each);
        }
      }
      EXPECT_EQ(sampled.evidence[i].errors, errors) << "test " << i << ", " << samples;
      EXPECT_NEAR(sampled.evidence[i].total_error, static_cast<Real>(total), 1e-12 * static_cast<Real>(errors));
      ASSERT_EQ(sampled.evidence[i].logs.size(), logs.size());
      for (std::size_t b = 0; b < logs.size(); ++b)
        EXPECT_NEAR(sampled.evidence[i].logs[b], static_cast<Real>(logs[b]),
                    1e-14 * static_cast<Real>(errors) + 1e-12 * static_cast<Real>(std::abs(logs[b])))
            << "test " << i << ", bet " << b << ", " << samples;
    }
  }
}

/// At small rates a bet's logarithm is the sum of all errors: none is left out and none counted twice.
TEST(SampleCell, EveryErrorIsInOneSum) {
  constexpr Real kSmall = 1e-7, kRounding = 0x1p-52;
  JsonNode place;
  for (MeanTest& test : place.test_plan.tests)
    for (auto& [role, bet] : test.bets) bet.rates = {kSmall};
  const auto error = [](std::uint64_t ray, std::uint64_t sample) {
    return Rng(SampleAddress{7, static_cast<std::uint32_t>(ray), sample}).uniform() - 0.4;
  };
  const GivenSamples kernel([&](std::uint32_t ray, std::uint64_t sample) { return kTarget + error(ray, sample); });
  for (const std::uint64_t samples : {16u, 1024u, 32768u}) {
    const Sampled sampled = place.sample(kernel, {.first = 5, .per_ray = samples});
    for (std::size_t i = 0; i < 4; ++i) {
      const MeanTest& test = place.test_plan.tests[i];
      Real sum = 0, squares = 0, errors = 0;
      for (std::size_t ray = 0; ray < kRays; ++ray)
        for (std::uint64_t k = 0; k < samples && place.takes(test, ray); ++k) {
          sum += error(ray, 5 + k);
          squares += error(ray, 5 + k) * error(ray, 5 + k);
          ++errors;
        }
      // What lies beyond the first order, and two roundings of a factor.
      for (std::size_t b = 0; b < test.bets.size(); ++b) {
        const Bet& bet = test.bets[b].second;
        const Real off = 0.51 * kSmall * bet.errors_per_sum * squares + kRounding / kSmall * errors;
        ASSERT_LT(off, 0.001 * sum);
        EXPECT_NEAR(sampled.evidence[i].logs[b] / kSmall, bet.side * sum, off) << "test " << i << ", " << samples;
      }
    }
  }
}

/// What is not asked for costs nothing of what is: verdicts do not depend on it.
TEST(SampleCell, EvidenceAloneIsTheSameEvidence) {
  const JsonNode place;
  const GivenSamples kernel([](std::uint32_t ray, std::uint64_t sample) {
    if (ray == 11 && sample % 5 == 3) return std::numeric_limits<Real>::quiet_NaN();
    if (ray == 30 && sample % 64 == 1) return 1.5;
    return Rng(SampleAddress{3, ray, sample}).uniform();
  });
  for (const std::uint64_t samples : kSpans) {
    const Sampled all = place.sample(kernel, {.per_ray = samples});
    const Sampled only = place.sample(kernel, {.per_ray = samples, .only_evidence = true});
    std::uint64_t nonfinite = 0, out_of_range = 0;
    for (std::uint64_t sample = 0; sample < samples; ++sample) {
      nonfinite += sample % 5 == 3;
      out_of_range += sample % 64 == 1;
    }
    for (const Sampled* sampled : {&all, &only}) {
      EXPECT_EQ(sampled->nonfinite, nonfinite);
      EXPECT_EQ(sampled->out_of_range, out_of_range);
      EXPECT_EQ(sampled->largest, 1.5);
      EXPECT_EQ(sampled->counters.samples, kRays * samples);
      EXPECT_EQ(sampled->lookups.back(), kRays * samples);
    }
    EXPECT_EQ(all.moments[11].count, samples - nonfinite);
    EXPECT_EQ(only.moments[11].count, 0u);
    for (std::size_t i = 0; i < place.test_plan.tests.size(); ++i) {
      EXPECT_EQ(all.evidence[i].logs, only.evidence[i].logs) << i;
      EXPECT_EQ(all.evidence[i].errors, only.evidence[i].errors) << i;
    }
  }
}

}  // namespace
}  // namespace nullmark
