// What every registered estimator must keep, whatever its name: adding one to the registry puts it under these tests.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "harness/config/config.h"
#include "harness/registry/estimator_entry.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

/// All estimators that claim to be exact or unbiased for transmittance by default and take media of so many channels, as a JSON
/// list; planted bugs do not count.
std::string honest_estimators(int channels = 1) {
  const Extrema medium = {Spectrum::Zero(channels), Spectrum::Ones(channels), Spectrum::Ones(channels)};
  std::string list;
  for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries()) {
    if (entry.planted || entry.foreign) continue;
    try {
      entry.make()->check(medium);
    } catch (const ParameterError&) {
      continue;
    }
    const Guarantee claim = entry.make()->claim(Quantity::transmittance);
    if (claim == Guarantee::exact || claim == Guarantee::unbiased)
      list += fmt::format("{}\"{}\"", list.empty() ? "" : ",", entry.name);
  }
  return list;
}

std::vector<CellRecord> run_cells(const std::string& experiment, int threads = 0) {
  const std::string text =
      R"({"nullmark":"config/2","name":"test","seed":1,"timing":{"enabled":false},"experiments":[{"name":"cells",)" + experiment +
      "}]}";
  const Plan plan = read_config(text, "test.json");
  return run_untimed(plan, {}, threads);
}

/// Boxes of many lengths and begins: a tracker that forgets a length, or where its ray begins, is right in a unit box at 0.
constexpr const char* kMedia = R"(
  {"type":"homogeneous","extinction":0.4,"hi":[1.75,1,1]}, {"type":"linear","optical_depth":0.7,"lo":[0.2,0,0],"hi":[0.8,1,1]},
  {"type":"linear","begin":1,"end":0,"optical_depth":2,"lo":[-0.2,0,0],"hi":[1.4,1,1]},
  {"type":"polynomial","coefficients":[[0.2,1,0.5],[1,-1,0.5,0.2]],"hi":[1.3,1,1]},
  {"type":"exponential","optical_depth":1,"lo":[0.4,0,0],"hi":[0.9,1,1]}, {"type":"cosine","optical_depth":0.7,"hi":[1.6,1,1]},
  {"type":"gaussian_bump","optical_depth":0.7,"lo":[0.1,0,0],"hi":[1.8,1,1]},
  {"type":"gaussian_hole","optical_depth":0.7,"lo":[-0.1,0,0],"hi":[0.4,1,1]},
  {"type":"layers","values":[[0.2,3,0,1]],"lo":[0.1,0,0],"hi":[1.2,1,1]}, {"type":"checkerboard","hi":[1.5,1,1]},
  {"type":"fractal_noise","peak":6,"octaves":3,"lo":[-0.2,0,0],"hi":[1.1,1,1]})";

/// Through all of them, from outside: it begins in none.
constexpr const char* kThroughAll = R"({"type":"single","from":[-0.4,0.1,0.3],"to":[2,0.9,0.6]})";

/// The rules for cells of relative variance below 100: mean within 5.5 analytic standard errors (4e-8 a test, two-sided normal),
/// lookups within 1 %, variance within 5 %, at the planned samples.  Where tails are too heavy for that, as the estimator tells,
/// tests of its own hold its laws.
void expect_agreement(const CellRecord& record) {
  SCOPED_TRACE(record.cell.name);
  ASSERT_EQ(record.status, Status::ok) << record.reason;
  EXPECT_EQ(record.majorant_violations, 0u);
  const auto samples = static_cast<Real>(record.samples);
  const EstimatorEntry& tracker = *Registry<EstimatorEntry>::instance().find(record.cell.estimator->type);
  for (const ChannelRecord& channel : record.channel) {
    ASSERT_TRUE(channel.bias && channel.mean && channel.reference);
    const Real rounding = 1e-13 + *channel.reference_error;
    if (!channel.variance_theory) continue;
    EXPECT_LT(std::abs(*channel.bias), 5.5 * std::sqrt(*channel.variance_theory / samples) + rounding);
    if (*channel.relative_variance < 100 && *channel.relative_variance > 1e-12 && !tracker.heavy_samples) {
      EXPECT_NEAR(*channel.variance / *channel.variance_theory, 1, 0.05);
    }
  }
  if (record.lookups_theory && *record.lookups_theory > 0 && !tracker.heavy_lookups) {
    EXPECT_NEAR(*record.lookups_per_sample / *record.lookups_theory, 1, 0.01);
  }
}

int agreeing(const std::vector<CellRecord>& records) {
  int ran = 0;
  for (const CellRecord& record : records) {
    if (record.status == Status::skipped) continue;
    expect_agreement(record);
    ++ran;
  }
  return ran;
}

/// For every edit: smooth, with jumps, and known only by lookups.
TEST(Contract, EveryHonestEstimatorMeetsThemOnThreeMedia) {
  const auto records = run_cells(fmt::format(
      R"("rays":{},"samples_per_ray":300000,
          "matrix":{{"estimator":[{}],
                    "medium":[{{"type":"linear","begin":1,"end":0,"optical_depth":2,"lo":[-0.2,0,0],"hi":[1.4,1,1]}},
                              {{"type":"layers","values":[[0.2,3,0,1]],"lo":[0.1,0,0],"hi":[1.2,1,1]}},
                              {{"type":"fractal_noise","peak":6,"octaves":3,"lo":[-0.2,0,0],"hi":[1.1,1,1]}}],
                    "majorant":[{{"type":"grid","resolution":5}}]}})",
      kThroughAll, honest_estimators()));
  EXPECT_GT(agreeing(records), 18);
}

TEST(Contract, EveryHonestEstimatorMeetsMeanVarianceAndLookupsOnEveryMedium) {
  const auto records = run_cells(fmt::format(
      R"("rays":{},"samples_per_ray":300000,
          "matrix":{{"estimator":[{}],"medium":[{}],"majorant":["global",{{"type":"global","looseness":3}},{{"type":"grid","resolution":5}},
                                {{"type":"kd_tree","resolution":16,"forced_depth":4,"crossing":"rewind"}}]}})",
      kThroughAll, honest_estimators(), kMedia));
  EXPECT_GT(agreeing(records), 270);
}

TEST(Contract, ChromaticMediaAreMetChannelByChannel) {
  const auto records = run_cells(fmt::format(
      R"("rays":{{"type":"single","from":[-1,0.5,0.5],"to":[2,0.4,0.6]}},"samples_per_ray":300000,
          "matrix":{{"estimator":[{},{{"type":"delta","walks":"separate"}}],
                    "medium":[{{"type":"linear","optical_depth":0.5,"spectrum":[1,3,0.2],"hi":[1.6,1,1]}},
                              {{"type":"channels","media":[{{"type":"linear","optical_depth":1}},{{"type":"cosine","optical_depth":0.5}},
                                                           {{"type":"gaussian_bump","optical_depth":0.4}},{{"type":"homogeneous","extinction":0.3}}]}},
                              {{"type":"homogeneous","extinction":0.4,"spectrum":[0,1,2,3,1,1,1,1,1,1,1,1,1,1,0.5,2]}}],
                    "majorant":["global",{{"type":"grid","resolution":4}}]}})",
      honest_estimators(3)));
  EXPECT_GT(agreeing(records), 40);
  for (const CellRecord& record : records)
    if (record.status == Status::ok) {
      EXPECT_EQ(record.channel.size(), static_cast<std::size_t>(record.channels));
      // Who has a law for neither cost nor variance may have none here as well.
      EXPECT_TRUE(record.lookups_theory || !record.channel[0].variance_theory) << record.cell.name;
    }
}

TEST(Contract, ControlsOfResidualTrackingMeetTheory) {
  const auto records = run_cells(
      R"("rays":{"type":"single","from":[-1,0.5,0.5],"to":[2,0.5,0.5]},"samples_per_ray":300000,
          "matrix":{"estimator":[{"type":"residual_ratio","control":["minimum","average","middle","maximum","medium_average","ray_average","gamma"],
                                  "component":["product","residual"]},
                                 {"type":"residual_ratio","control":["linear","exponential","given"],"value":0.3,"value_end":1.2},
                                 {"type":"residual_ratio","control":["minimum","average"],"rate_scale":0.7},
                                 {"type":"residual_ratio","control":"average","rate":"majorant"},
                                 {"type":"residual_delta","control":"given","value":0.05}],
                    "medium":[{"type":"linear","begin":0.1,"end":1,"optical_depth":0.6931471805599453,"lo":[-0.4,0,0],"hi":[1.2,1,1]},
                              {"type":"gaussian_hole","optical_depth":1,"spectrum":[1,2]}],
                    "majorant":["global",{"type":"grid","resolution":4}]})");
  EXPECT_GT(agreeing(records), 60);
}

TEST(Contract, MarchesMeetTheirOwnPredictedMeanAndAreUnbiasedForDepthWhereJittered) {
  for (const char* quantity : {"transmittance", "optical_depth"}) {
    const auto records = run_cells(fmt::format(
        R"("quantity":"{}","rays":{},"samples_per_ray":100000,
            "matrix":{{"estimator":[{{"type":"ray_marching","steps":[3,16],"offset":["left","midpoint","right","uniform","stratified"]}}],
                      "medium":[{}]}})",
        quantity, kThroughAll, kMedia));
    for (const CellRecord& record : records) {
      SCOPED_TRACE(record.cell.name);
      ASSERT_EQ(record.status, Status::ok) << record.reason;
      const ChannelRecord& channel = record.channel[0];
      ASSERT_TRUE(channel.rmse_theory && channel.variance_theory);
      if (*channel.relative_variance > 1e-12) {
        EXPECT_NEAR(*channel.variance / *channel.variance_theory, 1, 0.05);
      }
      // One ray, so |bias| is the rmse; the predicted bias is what rmse_theory holds beyond the variance.
      const Real noise = std::sqrt(*channel.variance_theory / static_cast<Real>(record.samples));
      const Real predicted = std::sqrt(std::max<Real>(0, *channel.rmse_theory * *channel.rmse_theory - noise * noise));
      EXPECT_NEAR(std::abs(*channel.bias), predicted, 5.5 * noise + 1e-12);
      if (record.claims == "unbiased") {
        EXPECT_LT(predicted, 1e-10 * *channel.reference + 1e-12);
      }
      EXPECT_EQ(*record.lookups_per_sample, *record.lookups_theory);
    }
  }
}

/// theory: reference values on [0,1], T = 1/2 (closed forms of Novak 2014, STAR 2018, Georgiev 2019 families).
TEST(Contract, TheoryColumnsAreThePublishedClosedForms) {
  struct Expected {
    const char *estimator, *medium;
    Real looseness, variance, lookups;
  };
  const char* constant = R"({"type":"homogeneous","extinction":0.6931471805599453})";
  const char* linear = R"({"type":"linear","optical_depth":0.6931471805599453})";
  const char *delta = R"("delta")", *ratio = R"("ratio")", *a = R"("next_flight_delta")",
             *b = R"({"type":"next_flight_delta","variant":"b"})", *flight = R"("next_flight_ratio")";
  for (const Expected& expected : std::initializer_list<Expected>{
           {delta, constant, 1, .25, .5},
           {delta, constant, 2, .25, 1},
           {delta, linear, 1, .25, 1.122934},
           {delta, linear, 2, .25, 2.245867},
           {ratio, constant, 1, .25, .693147},
           {ratio, constant, 2, .103553, 1.386294},
           {ratio, linear, 1, .146850, 1.386294},
           {ratio, linear, 2, .064980, 2.772589},
           {a, constant, 1, 0, .5},
           {a, constant, 2, .052083, 1},
           {a, linear, 1, .047240, 1.122934},
           {a, linear, 2, .099598, 2.245867},
           {b, constant, 2, .166667, 1},
           {b, linear, 1, .116395, 1.122934},
           {b, linear, 2, .228527, 2.245867},
           {flight, constant, 1, 0, .693147},
           {flight, constant, 2, .031658, 1.386294},
           {flight, linear, 1, .041453, 1.386294},
           {flight, linear, 2, .048632, 2.772589},
           {R"({"type":"residual_ratio","control":"minimum"})", linear, 1, .146850, 1.386294},
           {R"({"type":"residual_ratio","control":"average"})", linear, 1, .064980, .693147},
           {R"({"type":"residual_ratio","control":"minimum","rate_scale":0.7})", linear, 1, .23377, 0.970406},
           {R"({"type":"residual_ratio","control":"average","rate_scale":0.7})", linear, 1, .09777, 0.485203}}) {
    const auto records =
        run_cells(fmt::format(R"("rays":{{"type":"single"}},"samples_per_ray":2,"matrix":{{"estimator":[{}],"medium":[{}],
        "majorant":[{{"type":"global","looseness":{}}}]}})",
                              expected.estimator, expected.medium, expected.looseness));
    SCOPED_TRACE(records.at(0).cell.name);
    EXPECT_NEAR(*records[0].channel[0].variance_theory, expected.variance, 1e-5);
    EXPECT_NEAR(*records[0].lookups_theory, expected.lookups, 2e-6);
  }
}

TEST(Contract, ViolatedMajorantsAreCounted) {
  const auto records = run_cells(fmt::format(
      R"("rays":{{"type":"single"}},"samples_per_ray":2000,"matrix":{{"estimator":[{}],"medium":[{{"type":"linear","optical_depth":1}}],
          "majorant":[{{"type":"global","looseness":0.9}}]}})",
      honest_estimators()));
  int audited = 0;
  for (const CellRecord& record : records) {
    if (Registry<EstimatorEntry>::instance().find(record.cell.estimator->type)->ignores_majorant) continue;
    EXPECT_GT(record.majorant_violations, 0u) << record.cell.name;
    EXPECT_NEAR(*record.largest_violation, 1 / 0.9, 1e-2) << record.cell.name;
    ++audited;
  }
  EXPECT_GE(audited, 6);
}

/// Delta trackers under a violated majorant are biased, by exactly what their theory says.
TEST(Contract, TheoryHoldsWhereTheMajorantIsViolated) {
  const auto records = run_cells(
      R"("rays":{"type":"single","from":[0,0.5,0.5],"to":[1,0.5,0.5]},"samples_per_ray":400000,
          "matrix":{"estimator":["delta",{"type":"next_flight_delta","variant":["a","b"]},"residual_delta","ratio","hero_wavelength"],
                    "medium":[{"type":"linear","begin":0.5,"end":1},{"type":"homogeneous","extinction":1.5}],
                    "majorant":[{"type":"global","looseness":0.6}]})");
  for (const CellRecord& record : records) {
    SCOPED_TRACE(record.cell.name);
    const ChannelRecord& channel = record.channel[0];
    if (*record.lookups_theory == 0) continue;  // the control of residual delta tracking already exceeds the majorant
    EXPECT_GT(record.majorant_violations, 0u);
    EXPECT_NEAR(*record.lookups_per_sample / *record.lookups_theory, 1, 0.01);
    if (*channel.relative_variance > 1e-12) {
      EXPECT_NEAR(*channel.variance / *channel.variance_theory, 1, 0.05);
    }
    const Real noise = std::sqrt(*channel.variance_theory / static_cast<Real>(record.samples));
    const Real predicted = std::sqrt(std::max<Real>(0, *channel.rmse_theory * *channel.rmse_theory - noise * noise));
    EXPECT_NEAR(std::abs(*channel.bias), predicted, 5.5 * noise + 1e-6);
  }
}

TEST(Contract, RaysThatMissOrAreEmptyHaveTransmittanceOneWithoutLookups) {
  for (const char* ray : {R"("from":[-1,5,0],"to":[1,5,0])", R"("from":[-1,0.5,0.5],"to":[-0.5,0.5,0.5])"}) {
    const auto records = run_cells(fmt::format(
        R"("rays":{{"type":"single",{}}},"samples_per_ray":10,"matrix":{{"estimator":[{},"ray_marching"],"medium":[{}],
            "majorant":["global",{{"type":"grid","resolution":4}}]}})",
        ray, honest_estimators(), kMedia));
    for (const CellRecord& record : records) {
      if (record.status == Status::skipped) continue;
      EXPECT_EQ(*record.channel[0].mean, 1) << record.cell.name;
      EXPECT_EQ(*record.lookups_per_sample, 0) << record.cell.name;
    }
  }
}

/// Rays of one image hit and miss; a profile is asked for on all of them.
TEST(Contract, ProfilesBearRaysThatMiss) {
  const auto records = run_cells(fmt::format(
      R"("rays":{{"type":"perspective","width":4,"height":4,"view":[-1,-0.4,-0.3],"up":[0,0,1],"distance":2,"field_of_view":60}},
          "quantity":"transmittance_profile","samples_per_ray":64,
          "matrix":{{"estimator":[{}],"medium":[{{"type":"linear","optical_depth":1}}],"majorant":[{{"type":"grid","resolution":4}}]}})",
      honest_estimators()));
  for (const CellRecord& record : records) {
    if (record.status == Status::skipped) continue;
    ASSERT_EQ(record.status, Status::ok) << record.cell.name << record.reason;
    EXPECT_NEAR(*record.channel[0].mean, *record.channel[0].reference, 0.1) << record.cell.name;
  }
}

TEST(Contract, StatisticsDoNotDependOnThreads) {
  const std::string experiment =
      R"("rays":{"type":"orthographic","width":7,"height":5},
          "matrix":{"samples_per_ray":[3,40000],"estimator":["ratio","delta",{"type":"ray_marching","offset":"stratified"}],
                    "medium":[{"type":"fractal_noise","spectrum":[1,0.5]}],"majorant":[{"type":"grid","resolution":4}]})";
  const auto one = run_cells(experiment, 1), two = run_cells(experiment, 2);
  ASSERT_EQ(one.size(), two.size());
  ASSERT_EQ(one.size(), 6u);
  for (std::size_t i = 0; i < one.size(); ++i)
    for (std::size_t c = 0; c < one[i].channel.size(); ++c) {
      EXPECT_EQ(*one[i].channel[c].mean, *two[i].channel[c].mean);
      EXPECT_EQ(*one[i].channel[c].rmse, *two[i].channel[c].rmse);
      EXPECT_EQ(*one[i].channel[c].variance, *two[i].channel[c].variance);
      EXPECT_EQ(*one[i].channel[c].kurtosis, *two[i].channel[c].kurtosis);
      EXPECT_EQ(one[i].lookups, two[i].lookups);
      EXPECT_EQ(one[i].draws, two[i].draws);
      ASSERT_EQ(one[i].convergence.size(), two[i].convergence.size());
      for (std::size_t k = 0; k < one[i].convergence.size(); ++k)
        EXPECT_EQ(*one[i].convergence[k].channel[c].rmse, *two[i].convergence[k].channel[c].rmse);
    }
}

}  // namespace
}  // namespace nullmark
