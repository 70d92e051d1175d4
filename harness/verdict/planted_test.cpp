// The planted bugs themselves: hidden, runnable, and as wrong as they say.  That the checks catch them is tested with the checks.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "estimators/planted/scenes.h"
#include "harness/config/config.h"
#include "harness/config/schema.h"
#include "harness/io/json_input.h"
#include "harness/registry/components.h"
#include "harness/sampling/scene.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

constexpr Real kSamplesPerRay = 300000;

std::vector<std::string> planted() {
  std::vector<std::string> names;
  for (const EstimatorEntry& entry : Registry<EstimatorEntry>::instance().entries())
    if (entry.planted) names.push_back(entry.name);
  return names;
}

std::vector<CellRecord> run(const std::string& samples, const std::string& matrix) {
  const Plan plan = read_config(fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[
      {{"name":"planted","samples_per_ray":{},"matrix":{{{}}}}}]}})",
                                            samples, matrix),
                                "planted.json");
  return run_untimed(plan);
}

CellRecord run(const PlantedScene& scene) {
  return run(fmt::format("{}", kSamplesPerRay),
             fmt::format(R"("quantity":["{}"],"estimator":[{}],"medium":[{}],"majorant":[{}],"rays":[{}])", scene.quantity,
                         scene.estimator, scene.medium, scene.majorant, scene.rays))
      .at(0);
}

const PlantedScene& scene_of(std::string_view name) {
  return *std::find_if(std::begin(kPlantedScenes), std::end(kPlantedScenes),
                       [&](const PlantedScene& scene) { return scene.name == name; });
}

TEST(Planted, EachHasAScene) {
  const std::vector<std::string> names = planted();
  std::vector<std::string> shown;
  for (const PlantedScene& scene : kPlantedScenes) shown.emplace_back(scene.name);
  std::sort(shown.begin(), shown.end());
  EXPECT_EQ(shown, names);
}

TEST(Planted, EachNamesTheCheckThatMustCatchIt) {
  const std::set<std::string> checks = {"mean",         "count_law", "replay",    "lookups", "variance",
                                        "independence", "audit",     "nonfinite", "groups",  "position_law",
                                        "chi_square",   "reliance",  "open"};
  for (const std::string& name : planted())
    EXPECT_TRUE(checks.contains(Registry<EstimatorEntry>::instance().find(name)->caught_by)) << name;
}

TEST(Planted, NoListShowsThem) {
  for (const ComponentInfo& entry : registered(ComponentKind::estimator)) EXPECT_FALSE(is_planted(entry.name)) << entry.name;
  EXPECT_FALSE(is_planted("ratio"));
  EXPECT_FALSE(is_planted("rato"));
  EXPECT_EQ(config_schema().dump().find("planted_"), std::string::npos);
  EXPECT_EQ(results_schema().dump().find("planted_"), std::string::npos);
  for (const std::string& name : planted()) {
    EXPECT_TRUE(is_planted(name));
    try {
      run("1", fmt::format(R"("estimator":["{}x"],"medium":["linear"],"rays":["single"])", name));
      ADD_FAILURE() << name << "x is no estimator";
    } catch (const InputError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(fmt::format("unknown estimator \"{}x\";", name)), std::string::npos) << message;
      EXPECT_EQ(message.find("planted_", message.find(';')), std::string::npos) << message;
    }
  }
}

TEST(Planted, EachRunsOnGreyAndChromaticMediaAndOnEmptyRays) {
  std::string list;
  for (const std::string& name : planted()) list += fmt::format("{}\"{}\"", list.empty() ? "" : ",", name);
  const auto records = run("1000", fmt::format(R"("estimator":[{}],"medium":["cosine",{{"type":"linear","spectrum":[1,0.5,2]}}],
      "majorant":["global",{{"type":"grid","resolution":4}}],
      "rays":[{{"type":"orthographic","width":2,"height":2,"axis":"x"}},{{"type":"single","from":[-1,5,0],"to":[1,5,0]}}])",
                                               list));
  EXPECT_EQ(records.size(), planted().size() * 8);
  for (const CellRecord& record : records) {
    EXPECT_EQ(record.status, Status::ok) << record.cell.name << ": " << record.reason;
    EXPECT_EQ(record.claims, record.cell.estimator->type == "planted_exact" ? "exact" : "unbiased") << record.cell.name;
  }
}

/// Stated biases are met within 5.5 standard errors (4e-8 a test) plus half a unit of the last digit given, and each is beyond 6.
TEST(Planted, MeansAreAsWrongAsStated) {
  for (const PlantedScene& scene : kPlantedScenes) {
    SCOPED_TRACE(scene.name);
    const CellRecord record = run(scene);
    const bool has_mean = std::string_view(scene.name) != "planted_nan";
    EXPECT_EQ(record.status, has_mean ? Status::ok : Status::error) << record.reason;
    if (!has_mean) continue;
    const ChannelRecord& channel = record.channel.at(0);
    const Real noise = std::sqrt(*channel.variance / (static_cast<Real>(record.samples) * scene.fresh));
    const Real stated = scene.relative_bias * *channel.reference;
    EXPECT_NEAR(*channel.bias, stated, 5.5 * noise + 1e-6 * *channel.reference);
    if (scene.relative_bias != 0) {
      EXPECT_GT(std::abs(*channel.bias), 6 * noise);
    }
  }
}

/// Where the mean is right something else is not.
TEST(Planted, WhatTheMeanDoesNotShow) {
  const CellRecord reference = run(scene_of("planted_reference"));
  EXPECT_EQ(reference.lookups, 0u);
  EXPECT_EQ(*reference.lookups_theory, 5);
  EXPECT_EQ(*reference.channel[0].variance, 0);
  EXPECT_GT(*reference.channel[0].variance_theory, 0.01);

  const CellRecord twice = run(scene_of("planted_second_lookup"));
  EXPECT_NEAR(*twice.lookups_per_sample / *twice.lookups_theory, 2, 0.02);

  const CellRecord coin = run(scene_of("planted_coin"));
  EXPECT_GT(*coin.channel[0].variance / *coin.channel[0].variance_theory, 5);

  EXPECT_NEAR(static_cast<Real>(run(scene_of("planted_nan")).nonfinite), 1e-4 * kSamplesPerRay, 30);

  EXPECT_GT(run(scene_of("planted_capped_extinction")).majorant_violations, 0u);

  // Pixels, not their mean.
  const CellRecord neighbour = run(scene_of("planted_neighbour"));
  EXPECT_GT(*neighbour.channel[0].rmse, 20 * *neighbour.channel[0].rmse_theory);

  // The variance of means of 2 is that of single samples; theory halves it.
  const CellRecord paired = run(scene_of("planted_paired_streams"));
  EXPECT_NEAR(*paired.convergence[1].channel[0].variance / *paired.convergence[0].channel[0].variance, 1, 0.02);
}

/// A sample of an honest tracker depends on its address alone; the batch streams' depends on the call it came in.
TEST(Planted, BatchStreamsRepeatThemselves) {
  MediumSpec spec;
  spec.field.type = "homogeneous";
  const BuiltMedium medium = build_medium(spec);
  const auto extrema = medium.extrema;
  PreparedRay context;
  context.world = context.local = Ray{Vec3(0, 0.5, 0.5), Vec3::UnitX(), 0, 1};
  context.bounds.start({{0, 1, 5 * extrema.maximum[0], extrema}});
  const auto draw = [&](const char* estimator, std::uint64_t first) {
    const auto kernel = make_estimator({estimator, {}, estimator, ""})->kernel(1);
    const auto workspace = kernel->workspace();
    kernel->begin_ray(*workspace, *medium.medium, extrema, context);
    SampleBlock block;
    Counters counters;
    kernel->sample(*workspace, *medium.medium, context, 1, first, 100, Quantity::transmittance, block, counters);
    return block.values;
  };
  EXPECT_NE(draw("ratio", 0), draw("ratio", 100));
  EXPECT_EQ(draw("planted_batch_streams", 0), draw("planted_batch_streams", 100));
  EXPECT_EQ(draw("planted_batch_streams", 0), draw("ratio", 0));
}

/// The program that users get does not have them at all.
TEST(Planted, OnlyTheTestsProgramRunsThem) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "nullmark_planted";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "c.json") << R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":10,"matrix":{"estimator":["planted_zero"],"medium":["linear"]}}]})";
  const auto exit_code = [&](const std::string& program) {
    const int status = std::system(("cd '" + folder.string() + "' && '" + program + "' run c.json >out 2>err").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  EXPECT_EQ(exit_code(NULLMARK_PROGRAM), 2);
  EXPECT_EQ(exit_code(NULLMARK_PLANTED_PROGRAM), 0);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace nullmark
