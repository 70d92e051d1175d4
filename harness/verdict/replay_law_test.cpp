// Samples that are kept and drawn again: which ones, and what a second drawing finds.

#include "harness/verdict/replay_law.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "harness/config/config.h"
#include "harness/testing/run_untimed.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

Real value(std::size_t ray, std::uint64_t sample, std::size_t output) {
  return static_cast<Real>(ray) * 1e9 + static_cast<Real>(sample) * 8 + static_cast<Real>(output);
}

/// Whatever pieces samples come in, the kept ones are those of their address, and each ray that takes part has its first and
/// last.
TEST(Replays, KeepsSamplesByTheirAddress) {
  struct Shape {
    std::size_t rays;
    std::uint64_t first, per_ray, piece;
    std::size_t outputs;
  };
  for (const Shape& shape : {Shape{1, 0, 16, 5, 1},
                             {1, 0, 70000, 16384, 2},
                             {16, 100, 256, 256, 1},
                             {5000, 0, 3, 2, 3},
                             {100000, 7, 1, 1, 1},
                             {3, 0, 4'000'000, 16384, 1}}) {
    SCOPED_TRACE(fmt::format("{} rays, {} samples", shape.rays, shape.per_ray));
    KeptSamples kept(shape.rays, shape.first, shape.per_ray, shape.outputs);
    std::vector<Real> values;
    for (std::size_t ray = 0; ray < shape.rays; ++ray)
      for (std::uint64_t done = 0; done < shape.per_ray; done += shape.piece) {
        const std::uint64_t count = std::min(shape.piece, shape.per_ray - done);
        values.clear();
        for (std::uint64_t i = 0; i < count; ++i)
          for (std::size_t o = 0; o < shape.outputs; ++o) values.push_back(value(ray, shape.first + done + i, o));
        kept.keep(ray, shape.first + done, count, values);
      }
    std::map<std::size_t, std::set<std::uint64_t>> of_ray;
    for (std::size_t i = 0; i < kept.count(); ++i) {
      const KeptSamples::Sample sample = kept.at(i);
      ASSERT_EQ(sample.values.size(), shape.outputs);
      for (std::size_t o = 0; o < shape.outputs; ++o) ASSERT_EQ(sample.values[o], value(sample.ray, sample.number, o));
      of_ray[sample.ray].insert(sample.number);
    }
    for (const auto& [ray, numbers] : of_ray) {
      EXPECT_EQ(*numbers.begin(), shape.first);
      EXPECT_EQ(*numbers.rbegin(), shape.first + shape.per_ray - 1);
    }
    const std::uint64_t all = shape.rays * shape.per_ray;
    EXPECT_GE(kept.count(), std::min<std::uint64_t>(all, 32));
    EXPECT_LE(kept.count(), std::max<std::uint64_t>(64, all / 128 + 16));
    EXPECT_LE(kept.count(), 4096u + 16u);
  }
}

std::vector<CellRecord> run_experiments(const std::string& experiments) {
  return run_untimed(read_config(
      fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{}]}})", experiments), "test.json"));
}

const LawRecord* replay(const CellRecord& record) {
  if (!record.verdict) return nullptr;
  for (const LawRecord& law : record.verdict->laws)
    if (law.name == "replay") return &law;
  return nullptr;
}

/// Every judged cell has the law, whatever its quantity and precision, with a number of replays that grows with its samples.
TEST(Replays, HonestTrackersAreWhatTheyWere) {
  const auto records = run_experiments(R"(
      {"name":"lanes","precision":"float","rays":{"type":"orthographic","width":4,"height":4},"samples_per_ray":1000,
       "matrix":{"estimator":["ratio","delta"],"medium":["cosine"],"majorant":[{"type":"grid","resolution":4}]}},
      {"name":"double","rays":{"type":"orthographic","width":4,"height":4},"samples_per_ray":1000,"verdict":{"laws":"never"},
       "matrix":{"estimator":["ratio","delta","weighted_delta","p_series_cmf","telescoping","regular"],
                 "medium":[{"type":"linear","spectrum":[1,0.5,2]},"layers"],"majorant":["global"]}},
      {"name":"profile","quantity":"transmittance_profile","rays":"single","samples_per_ray":1000,
       "matrix":{"estimator":["ratio","delta"],"medium":["linear",{"type":"linear","spectrum":[1,2]}]}},
      {"name":"flights","quantity":"free_path","rays":"single","samples_per_ray":1000,
       "matrix":{"estimator":["delta","null_collision","regular_inversion"],"medium":[{"type":"linear","albedo":0.5}]}},
      {"name":"light","quantity":"radiance","transport":{"environment":1,"next_event":"uniform"},"rays":"single","samples_per_ray":1000,
       "matrix":{"estimator":["delta","weighted_delta"],"medium":[{"type":"linear","optical_depth":2,"albedo":1}]}})");
  std::set<std::string> judged;
  for (const CellRecord& record : records) {
    SCOPED_TRACE(record.cell.name);
    if (record.status == Status::skipped) continue;
    ASSERT_EQ(record.status, Status::ok) << record.reason;
    ASSERT_TRUE(replay(record));
    EXPECT_EQ(replay(record)->outcome, Outcome::pass);
    EXPECT_GE(replay(record)->samples, 48u);
    judged.insert(record.cell.experiment);
  }
  EXPECT_EQ(judged.size(), 5u);
  const auto more = run_experiments(R"({"name":"more","rays":"single",
      "matrix":{"samples_per_ray":[1000,100000,1000000],"estimator":["ratio"],"medium":["linear"]}})");
  ASSERT_EQ(more.size(), 3u);
  EXPECT_EQ(replay(more[0])->samples, 48u);
  EXPECT_NEAR(static_cast<Real>(replay(more[1])->samples), 100000 / 128 + 16, 2);
  EXPECT_EQ(replay(more[2])->samples, 4096u + 16u);
  EXPECT_FALSE(tests_walks(*more[2].verdict));
}

/// What was learned before the run ended was learned from samples that are then others.
TEST(Replays, WhoLearnsFromSamplesIsFoundOutOnOneRay) {
  for (const char* rays : {R"("single")", R"({"type":"orthographic","axis":"x","width":8,"height":8})"})
    for (const int samples : {64, 65536}) {
      SCOPED_TRACE(fmt::format("{}, {} samples", rays, samples));
      const auto records =
          run_experiments(fmt::format(R"({{"name":"learns","rays":{},"samples_per_ray":{},"verdict":{{"laws":"never"}},
          "matrix":{{"estimator":["planted_learned_bound"],"medium":[{{"type":"linear","begin":0.5,"end":1.5}}]}}}})",
                                      rays, samples));
      ASSERT_TRUE(replay(records.at(0)));
      EXPECT_EQ(replay(records[0])->outcome, Outcome::fail);
      EXPECT_EQ(records[0].verdict->lawful, Outcome::fail);
    }
}

}  // namespace
}  // namespace nullmark
