// One sample drawn again alone against the run that it is of.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "harness/config/config.h"
#include "harness/model/exit_code.h"
#include "harness/run/replay.h"
#include "harness/testing/program.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

RunRecord run(const std::string& experiment) {
  const Plan plan = read_config(
      fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e",{}}}]}})", experiment),
      "c.json");
  RunRecord run;
  run.config_text = plan.config_text;
  run.cells = run_untimed(plan);
  return run;
}

Replay replay(const RunRecord& run, const CellRecord& record, const SampleChoice& choice) {
  return replay_sample(run, "c.results.json", record.cell.name, choice);
}

constexpr std::uint64_t kSamplesPerRay = 5;

/// Means, lookups and draws of a run are those of its samples, one by one.
void expect_sums(const std::string& matrix) {
  const RunRecord results =
      run(fmt::format(R"("samples_per_ray":{},"verdict":{{"enabled":false}},"matrix":{{{}}})", kSamplesPerRay, matrix));
  for (const CellRecord& record : results.cells) {
    SCOPED_TRACE(record.cell.name);
    ASSERT_EQ(record.status, Status::ok) << record.reason;
    std::vector<Real> sums(record.channel.size());
    std::uint64_t lookups = 0, draws = 0;
    for (std::uint64_t ray = 0; ray < record.rays; ++ray)
      for (std::uint64_t i = 0; i < kSamplesPerRay; ++i) {
        const Replay sample = replay(results, record, {ray, i});
        ASSERT_EQ(sample.values.size(), sums.size());
        for (std::size_t o = 0; o < sums.size(); ++o) sums[o] += sample.values[o];
        lookups += sample.lookups;
        draws += sample.draws.size();
        if (record.cell.precision == Precision::float64 && record.cell.quantity != Quantity::radiance) {
          EXPECT_EQ(sample.walk.steps.size(), sample.lookups);
        }
      }
    for (std::size_t o = 0; o < sums.size(); ++o) {
      const Real mean = sums[o] / static_cast<Real>(kSamplesPerRay * record.rays);
      EXPECT_NEAR(mean, *record.channel[o].mean, 1e-12 * (1 + std::abs(mean))) << o;
    }
    EXPECT_EQ(lookups, record.lookups);
    EXPECT_EQ(draws, record.draws);
  }
}

TEST(ReplaySample, TransmittancesAreThoseOfTheRun) {
  expect_sums(R"("estimator":["ratio","delta","residual_ratio","null_collision","next_flight_ratio","p_series_cmf",
    "mis_bidirectional","unbiased_ray_marching","spectral"],"medium":["cosine",{"type":"linear","spectrum":[1,0.5]}],
    "majorant":["global",{"type":"grid","resolution":4}],"rays":[{"type":"orthographic","width":2,"height":2,"axis":"x"}])");
}

TEST(ReplaySample, EveryQuantityAndPrecision) {
  expect_sums(R"("estimator":"regular","medium":"linear","quantity":"optical_depth","rays":"single")");
  expect_sums(
      R"("estimator":{"type":"ray_marching","offset":"uniform"},"medium":"cosine","quantity":"optical_depth","rays":"single")");
  expect_sums(R"("estimator":["ratio","delta"],"medium":"cosine","quantity":"transmittance_profile","rays":"single")");
  expect_sums(R"("estimator":"delta","medium":{"type":"cosine","albedo":0.5},"quantity":"free_path","rays":"single")");
  expect_sums(
      R"("estimator":"delta","medium":{"type":"cosine","albedo":0.5},"quantity":"radiance","transport":{"environment":1},"rays":"single")");
  expect_sums(R"("estimator":"ratio","medium":"cosine","quantity":"radiance","transport":{"environment":1},"rays":"single")");
  expect_sums(R"("estimator":["ratio","delta"],"medium":"cosine","precision":"float","rays":"single")");
}

/// Random numbers, depths and weights of a walk hang together as the listing says [Novak et al. 2014, Alg. 1].
TEST(ReplaySample, StepsFollowFromTheirRandomNumbers) {
  const RunRecord results = run(R"("samples_per_ray":40,"matrix":{"estimator":["ratio","delta"],
      "medium":{"type":"cosine","optical_depth":3},"majorant":{"type":"global","looseness":2},"rays":"single"})");
  for (const CellRecord& record : results.cells)
    for (std::uint64_t i = 0; i < 40; ++i) {
      const Replay sample = replay(results, record, {0, i});
      const bool delta = record.cell.estimator->type == "delta";
      long double depth = 0, weight = 1;
      std::size_t drawn = 0;
      for (std::size_t s = 0; s < sample.walk.steps.size(); ++s) {
        const Recording::Step& step = sample.walk.steps[s];
        depth -= std::log1p(-static_cast<long double>(sample.draws.at(drawn++)));
        const long double real = static_cast<long double>(sample.walk.extinction[s]) / step.rate;
        weight *= delta ? !(sample.draws.at(drawn++) < real) : 1 - real;
        EXPECT_NEAR(step.depth, static_cast<Real>(depth), 1e-12);
        EXPECT_NEAR(sample.transmittance.at(s), static_cast<Real>(weight), 1e-12);
        EXPECT_EQ(step.draws, drawn);
      }
      EXPECT_NEAR(sample.values[0], static_cast<Real>(weight), 1e-12);
    }
}

/// In float streams are others; what a delta tracker does with their numbers is told from them alone.
TEST(ReplaySample, NumbersInFloatDecideTheWalk) {
  const RunRecord results = run(R"("samples_per_ray":40,"precision":"float","matrix":{"estimator":"delta",
      "medium":{"type":"homogeneous","extinction":1},"majorant":{"type":"global","looseness":4},"rays":"single"})");
  for (std::uint64_t i = 0; i < 40; ++i) {
    const Replay sample = replay(results, results.cells[0], {0, i});
    std::size_t drawn = 0;
    Real value = 1;
    std::uint32_t lookups = 0;
    for (Real depth = 0; value > 0; ++lookups) {
      depth -= std::log1p(-sample.draws.at(drawn++));
      if (depth >= 4) break;
      value = sample.draws.at(drawn++) < 0.25 ? 0 : 1;
    }
    EXPECT_EQ(sample.values[0], value) << i;
    EXPECT_EQ(sample.lookups, lookups) << i;
    EXPECT_EQ(sample.draws.size(), drawn) << i;
  }
}

TEST(ReplaySample, LeftOutItIsTheFarthestFromItsTarget) {
  const RunRecord results =
      run(R"("samples_per_ray":10,"verdict":{"epsilon":0.5,"max_samples_per_ray":1000},"matrix":{"estimator":"residual_ratio",
      "medium":{"type":"fractal_noise","spectrum":[0.5,1]},"rays":{"type":"orthographic","width":3,"height":3}})");
  const CellRecord& record = results.cells[0];
  const auto distance = [](const Replay& sample) {
    return std::max(std::abs(sample.values[0] - *sample.targets[0]), std::abs(sample.values[1] - *sample.targets[1]));
  };
  const std::uint64_t samples = record.verdict->samples_per_ray;
  ASSERT_GT(samples, 10u);
  std::vector<Real> most(record.rays);
  for (std::uint64_t ray = 0; ray < record.rays; ++ray)
    for (std::uint64_t i = 0; i < samples; ++i) most[ray] = std::max(most[ray], distance(replay(results, record, {ray, i})));
  EXPECT_EQ(distance(replay(results, record, {})), *std::max_element(most.begin(), most.end()));
  EXPECT_GT(distance(replay(results, record, {})), 0);
  for (std::uint64_t ray = 0; ray < record.rays; ++ray) {
    const Replay worst = replay(results, record, {ray, {}});
    EXPECT_EQ(worst.ray, ray);
    EXPECT_EQ(distance(worst), most[ray]);
  }
}

TEST(ReplaySample, WhatIsNotFiniteIsFarthest) {
  const RunRecord results = run(R"("samples_per_ray":20000,"verdict":{"enabled":false},"matrix":{
      "estimator":{"type":"planted_nan","chance":1e-3},"medium":"homogeneous","rays":"single"})");
  EXPECT_GT(results.cells[0].nonfinite, 1u);
  const Replay found = replay(results, results.cells[0], {});
  EXPECT_FALSE(std::isfinite(found.values[0]));
  EXPECT_EQ(replay_json(found)["values"][0]["value"], "nan");
  for (std::uint64_t i = 0; i < found.sample; ++i)
    EXPECT_TRUE(std::isfinite(replay(results, results.cells[0], {0, i}).values[0]));
}

TEST(ReplaySample, RefusesWhatIsNotThere) {
  RunRecord results = run(R"("samples_per_ray":4,"matrix":{"estimator":"ratio","medium":"cosine","rays":"single"})");
  CellRecord& record = results.cells[0];
  const auto message = [&](const std::string& name, const SampleChoice& choice) -> std::string {
    try {
      replay_sample(results, "c.results.json", name, choice);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::string name = record.cell.name;
  EXPECT_EQ(message(name, {0, 3}), "");
  EXPECT_EQ(message("rato" + name.substr(5), {}),
            "c.results.json: no cell \"rato" + name.substr(5) + "\"; did you mean \"" + name + "\"?");
  EXPECT_EQ(message(name, {1, 0}), "--ray: found 1; the rays of \"" + name + "\" are 0 to 0");
  std::string hash = "0000000000000000";
  std::swap(record.medium_hash, hash);
  EXPECT_EQ(message(name, {}), "c.results.json: \"" + name +
                                   "\": the medium's data have changed since (hash 0000000000000000, now " + hash +
                                   "); run it again");
  std::swap(record.medium_hash, hash);
  record.cell.id = "0";
  EXPECT_NE(message(name, {}).find("run it again"), std::string::npos);
  results.config_text.clear();
  EXPECT_NE(message(name, {}).find("holds no configuration"), std::string::npos);
}

class ReplayCli : public ProgramTest {};

TEST_F(ReplayCli, SearchesNoCellWithoutEnd) {
  write("c.json",
        R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","samples_per_ray":1000000000000000,
                      "matrix":{"estimator":"ratio","medium":"linear","rays":"single"}}]})");
  run("run c.json -o r.json --time-budget 0.1");
  EXPECT_EQ(run("replay r.json ratio/linear/global"), static_cast<int>(ExitCode::input_error));
  EXPECT_NE(read("err").find("too many to search; --sample chooses one"), std::string::npos) << read("err");
}

TEST_F(ReplayCli, ShowsASampleOfAFile) {
  write("c.json", R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","samples_per_ray":50,
      "matrix":{"estimator":"ratio","medium":"cosine","rays":"single"}}]})");
  ASSERT_EQ(ProgramTest::run("run c.json"), 0) << read("err");
  const std::string cell = ProgramTest::results("c.results.json").cells[0].cell.name;
  const std::string before = read("c.results.json");
  ASSERT_EQ(ProgramTest::run("replay c.results.json " + cell + " --ray 0 --sample 7"), 0) << read("err");
  EXPECT_EQ(read("out").rfind("transmittance ", 0), 0u) << "the result comes first: " << read("out");
  EXPECT_NE(read("out").find("\n" + cell + ", ray 0, sample 7\n"), std::string::npos) << read("out");
  ASSERT_EQ(ProgramTest::run("replay c.results.json " + cell + " --json"), 0) << read("err");
  const Json sample = Json::parse(read("out"));
  EXPECT_EQ(sample["lookups"], sample["steps"].size());
  ASSERT_EQ(ProgramTest::run("replay c.results.json " + cell + " --ray 0 --sample 49"), 0);
  EXPECT_EQ(read("err"), "");
  ASSERT_EQ(ProgramTest::run("replay c.results.json " + cell + " --ray 0 --sample 50"), 0);
  EXPECT_EQ(read("err"),
            "nullmark: warning: --sample: found 50; the results hold samples 0 to 49 of each ray, and not this one\n");
  EXPECT_NE(read("out").find(", ray 0, sample 50\n"), std::string::npos) << read("out");
  for (const char* wrong : {"--sample 3", "--ray -1 --sample 0", "--ray 0 --sample 1e3", "--ray x", "--sampel 2"}) {
    EXPECT_EQ(ProgramTest::run("replay c.results.json " + cell + " " + wrong), static_cast<int>(ExitCode::input_error)) << wrong;
    const std::string error = read("err");
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << error;
  }
  EXPECT_EQ(read("c.results.json"), before);
}

}  // namespace
}  // namespace nullmark
