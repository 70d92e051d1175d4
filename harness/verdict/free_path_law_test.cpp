// Quantities with several numbers a sample: free paths against their exact law, profiles, and what a configuration says of light.

#include <ImfFrameBuffer.h>
#include <ImfInputFile.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "harness/config/config.h"
#include "harness/io/results_json.h"
#include "harness/io/transport_json.h"
#include "harness/run/image.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

std::vector<CellRecord> run_flights(const std::string& experiment) {
  const std::string text =
      R"({"nullmark":"config/2","name":"test","timing":{"enabled":false},"experiments":[{"name":"cells",)" + experiment + "}]}";
  const Plan plan = read_config(text, "test.json");
  return run_untimed(plan);
}

const LawRecord* law(const CellRecord& record, const std::string& name) {
  for (const LawRecord& one : record.verdict->laws)
    if (one.name == name) return &one;
  return nullptr;
}

/// mu = 2 + cos(2 pi x) at mub = 3, mu_c = 1.
constexpr const char* kWavy =
    R"({"type":"sum","media":[{"type":"homogeneous","extinction":1},{"type":"cosine","frequency":6.283185307179586,"phase":0}]})";

TEST(FreePath, HonestSamplersKeepTheLaw) {
  const auto records = run_flights(fmt::format(
      R"("quantity":"free_path","rays":"single","samples_per_ray":65536,"verdict":{{"epsilon":0.02,"max_samples_per_ray":4000000}},
         "matrix":{{"estimator":["delta","analog_decomposition","weighted_decomposition","weighted_delta"],"medium":[{}],
                   "majorant":["global",{{"type":"grid","resolution":4}}]}})",
      kWavy));
  ASSERT_EQ(records.size(), 8u);
  for (const CellRecord& record : records) {
    SCOPED_TRACE(record.cell.name);
    ASSERT_TRUE(record.verdict) << record.reason;
    EXPECT_EQ(record.verdict->unbiased, Outcome::pass) << record.verdict->reason;
    EXPECT_EQ(record.outputs.size(), record.channel.size());
    for (const char* name : {"kolmogorov_smirnov", "chi_square"}) {
      ASSERT_TRUE(law(record, name)) << name;
      EXPECT_EQ(law(record, name)->outcome, Outcome::pass) << name;
    }
  }
}

/// Every bin has its share, and the density within it is wrong; the sampler states no theory.
TEST(FreePath, TheDistributionIsTestedWithoutATheory) {
  const auto records = run_flights(
      R"("quantity":"free_path","rays":"single","samples_per_ray":65536,"verdict":{"epsilon":0.02,"max_samples_per_ray":4000000},
         "matrix":{"estimator":["planted_bin_shape"],"medium":[{"type":"homogeneous","extinction":1}]})");
  ASSERT_TRUE(records.at(0).verdict) << records[0].reason;
  EXPECT_NE(records[0].verdict->unbiased, Outcome::fail) << records[0].verdict->reason;
  EXPECT_TRUE(records[0].verdict->untested.empty());
  for (const char* name : {"kolmogorov_smirnov", "chi_square"}) {
    ASSERT_TRUE(law(records[0], name)) << name;
    EXPECT_EQ(law(records[0], name)->outcome, Outcome::fail) << name;
  }
}

/// Where weights are not 1, and on chromatic media, the verdict says that the distribution was not tested.
TEST(FreePath, SaysWhereTheDistributionIsNotTested) {
  const auto records = run_flights(
      R"("quantity":"free_path","rays":"single","samples_per_ray":1000,
         "matrix":{"estimator":["null_collision"],"medium":[{"type":"linear","albedo":0.5},{"type":"linear","spectrum":[1,0.5]}],
                   "majorant":[{"type":"global","looseness":0.5},"global"]})");
  ASSERT_EQ(records.size(), 4u);
  for (const CellRecord& record : records) {
    SCOPED_TRACE(record.cell.name);
    ASSERT_TRUE(record.verdict) << record.reason;
    if (record.verdict->unbiased == Outcome::violated) continue;
    const bool tested = law(record, "chi_square");
    EXPECT_EQ(record.verdict->untested.size(), tested ? 0u : 1u);
    if (!tested) {
      EXPECT_EQ(record.verdict->untested.at(0), record.channels > 1 ? "distribution of free paths: the medium is chromatic"
                                                                    : "distribution of free paths: weights are not 1");
    }
  }
}

/// The published listing of analog decomposition forgets the residual's path at each null collision.
TEST(FreePath, TheListingThatForgetsItsPathIsFoundOut) {
  const auto records = run_flights(fmt::format(
      R"("quantity":"free_path","rays":"single","samples_per_ray":65536,"matrix":{{"estimator":["planted_decomposition_reset"],"medium":[{}]}})",
      kWavy));
  ASSERT_EQ(records.size(), 1u);
  ASSERT_TRUE(records[0].verdict) << records[0].reason;
  EXPECT_EQ(records[0].verdict->unbiased, Outcome::fail);
}

/// A flight's scores are all there is: bins, escape and weight add up, and the scattered share is the albedo.
TEST(FreePath, ScoresAddUp) {
  const auto records = run_flights(
      R"("quantity":"free_path","rays":"single","samples_per_ray":100000,
         "matrix":{"estimator":["delta"],"medium":[{"type":"linear","optical_depth":2,"albedo":0.3}]})");
  const CellRecord& record = records.at(0);
  ASSERT_EQ(record.outputs.size(), 11u);
  Real bins = 0;
  for (std::size_t i = 0; i < 8; ++i) bins += *record.channel[i].mean;
  EXPECT_NEAR(bins + *record.channel[9].mean, 1, 1e-12);
  EXPECT_EQ(*record.channel[10].mean, 1);
  EXPECT_NEAR(*record.channel[8].mean / bins, 0.3, 5.5 * std::sqrt(0.21 / (100000 * 0.86)));
  EXPECT_NEAR(*record.channel[9].reference, std::exp(-2.), 1e-12);
}

TEST(FreePath, AProfileIsTheTransmittanceUpToEachMark) {
  const auto records = run_flights(
      R"("quantity":"transmittance_profile","rays":"single","samples_per_ray":200000,
         "matrix":{"estimator":["delta","ratio",{"type":"residual_ratio","control":["minimum","average"]},"residual_delta"],
                   "medium":[{"type":"linear","begin":0.5,"end":2},{"type":"cosine","optical_depth":3,"spectrum":[1,0.5]}],
                   "majorant":["global",{"type":"grid","resolution":3}]})");
  for (const CellRecord& record : records) {
    SCOPED_TRACE(record.cell.name);
    ASSERT_EQ(record.status, Status::ok) << record.reason;
    ASSERT_EQ(record.channel.size(), 8u * static_cast<std::size_t>(record.channels));
    for (const ChannelRecord& mark : record.channel)
      EXPECT_LT(std::abs(*mark.bias), 6 * std::sqrt(*mark.variance / 200000) + 1e-12);
  }
}

TEST(FreePath, SurfacesEndFlights) {
  const auto records = run_flights(
      R"("quantity":"free_path","rays":{"type":"single","from":[0,0.5,0.5],"to":[1,0.5,0.5]},"samples_per_ray":100000,
         "transport":{"surfaces":[{"type":"sphere","center":[0.7,0.5,0.5],"radius":0.2}]},
         "matrix":{"estimator":["delta"],"medium":[{"type":"homogeneous","extinction":2}]})");
  const CellRecord& record = records.at(0);
  EXPECT_NEAR(*record.channel[8].reference, std::exp(-1.), 1e-12);
  EXPECT_LT(std::abs(*record.channel[8].bias), 5.5 * std::sqrt(0.25 / 100000));
}

/// Where no walk is taken nothing is said of the tracker; where nothing emits there is nothing to estimate; and a mean that is
/// known here cannot be given another value.
TEST(Radiance, IsJudgedOnlyWhereTheTrackerTakesPart) {
  const auto cell = [](const std::string& transport, const std::string& rest) {
    return run_flights(R"("quantity":"radiance","rays":"single","samples_per_ray":1000,"transport":)" + transport + "," + rest +
                       R"("matrix":{"estimator":["delta"],"medium":[{"type":"homogeneous","extinction":0.5}]})")
        .at(0);
  };
  const CellRecord closed = cell(R"({"environment":1})", "");
  EXPECT_EQ(closed.status, Status::ok);
  EXPECT_FALSE(closed.verdict);
  EXPECT_NE(closed.reason.find("takes no part"), std::string::npos) << closed.reason;
  EXPECT_NEAR(*closed.channel[0].mean, std::exp(-0.5), 1e-15);
  const CellRecord walked = cell(R"({"environment":1,"kernel":"general"})", R"("verdict":{"max_samples_per_ray":4000000},)");
  ASSERT_TRUE(walked.verdict);
  EXPECT_EQ(walked.verdict->unbiased, Outcome::pass) << walked.verdict->reason;
  EXPECT_EQ(cell("{}", "").status, Status::skipped);
  EXPECT_THROW(cell(R"({"environment":1})", R"("reference":{"value":0.3,"error":1e-6,"source":"elsewhere"},)"), ParameterError);
}

/// Results with matter, surroundings and many outputs are read back as they were written.
TEST(FreePath, ResultsAreReadBack) {
  const auto records = run_flights(
      R"("quantity":"free_path","rays":"single","samples_per_ray":1000,
         "transport":{"environment":[0.5],"surfaces":[{"type":"box","low":[2,2,2],"high":[3,3,3],"radiance":1},{"type":"plane","point":[0,0,9],"normal":[0,0,1]}],
                      "next_event":"uniform","roulette_from":null,"most_scatterings":2,"kernel":"general"},
         "matrix":{"estimator":["spectral"],"medium":[{"type":"linear","spectrum":[1,2],"albedo":[0.1,0.9],"anisotropy":-0.4,
                   "emission":{"radiance":[1,2],"field":"gaussian_bump"}}]})");
  RunRecord written;
  written.config_text = "{}";
  written.cells = records;
  const Json json = cell_json(records.at(0));
  const Json again = cell_json(read_results(results_text(written), "r.json").cells.at(0));
  EXPECT_EQ(json.dump(), again.dump());
  EXPECT_EQ(json["outputs"].size(), 22u);
}

TEST(Image, LayersAreReadBack) {
  const std::string path = (std::filesystem::path(testing::TempDir()) / "layers.exr").string();
  std::vector<Layer> layers = {{"mean.0", {}}, {"lookups", {}}};
  for (int i = 0; i < 6; ++i) {
    layers[0].values.push_back(0.1 * i);
    layers[1].values.push_back(1e6 + i);
  }
  write_exr(path, 3, 2, layers);
  Imf::InputFile file(path.c_str());
  for (const Layer& layer : layers) {
    std::vector<float> pixels(6);
    Imf::FrameBuffer frame;
    frame.insert(layer.name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(pixels.data()), sizeof(float), 3 * sizeof(float)));
    file.setFrameBuffer(frame);
    file.readPixels(0, 1);
    for (std::size_t y = 0; y < 2; ++y)
      for (std::size_t x = 0; x < 3; ++x)
        EXPECT_EQ(pixels[y * 3 + x], static_cast<float>(layer.values[(1 - y) * 3 + x])) << layer.name;
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace nullmark
