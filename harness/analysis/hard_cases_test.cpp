// Where numbers run out: each mitigation with a test that fails without it, and the references of configs/hard_cases.json against
// long double.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "estimators/ratio.h"
#include "estimators/residual_ratio.h"
#include "harness/analysis/check.h"
#include "harness/analysis/hard_case_table.h"
#include "harness/config/config.h"
#include "harness/io/file_io.h"
#include "harness/kernel/estimator_template.h"
#include "harness/testing/built_media.h"
#include "harness/testing/hand_walked.h"
#include "harness/testing/run_untimed.h"
#include "harness/verdict/cell_word.h"
#include "media/gaussian_bump.h"

namespace nullmark {
namespace {

RunRecord run_of(
    const Plan& plan, const std::function<bool(const Cell&)>& wanted = [](const Cell&) { return true; }) {
  RunRecord run;
  run.cells = run_untimed(plan, wanted);
  return run;
}

CellRecord record_of(const std::string& experiment) {
  return run_of(read_config(fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[
                                            {{"name":"e","rays":"single",{}}}]}})",
                                        experiment),
                            "test.json"))
      .cells.at(0);
}

/// T_c = e^-3000 and T_r = e^2800: neither is a number, their product is.
TEST(HardCases, ResidualWeightsMayOutgrowNumbersWhereTheirProductDoesNot) {
  ResidualRatioTracking<Real> tracker;
  tracker.choice.kind = "given";
  tracker.choice.value = 3000;
  tracker.choice.rate_scale = 10;
  const HandWalked<ResidualRatioTracking> walked(tracker, constant(0.5), 1);
  ASSERT_GT(walked.ray.roots, 0);
  const long double rate = walked.ray.residual.rate(0), factor = (rate - (0.5L - 3000)) / rate;
  for (std::uint64_t sample = 0; sample < 20; ++sample) {
    const auto outcome = walked.walk(sample);
    const long double exact = std::exp(-3000 + static_cast<long double>(outcome.lookups) * std::log(factor));
    EXPECT_NEAR(static_cast<Real>(outcome.result / exact), 1, 1e-9) << sample;
  }
  // Where every number holds, nothing is rooted and nothing is paid.
  tracker.choice.value = 300;
  EXPECT_EQ(HandWalked<ResidualRatioTracking>(tracker, constant(0.5), 1).ray.roots, 0);
  EXPECT_GT(HandWalked<ResidualRatioTracking>(tracker, constant(0.5), 1).ray.roots_in_float, 0);
}

TEST(HardCases, VariancesOfProductsDoNotLeaveTheRangeOfNumbersByHalves) {
  EXPECT_NEAR(product_variance(-400, 700) / std::exp(-100.), 1, 1e-12);
  EXPECT_NEAR(product_variance(-1, 1e-12) / (std::exp(-2.) * 1e-12), 1, 1e-11);
  EXPECT_EQ(product_variance(-1e6, 1e6), 0);
  EXPECT_EQ(product_variance(-1, 0), 0);
}

/// In float neither the scale nor the bell of a bump whose tail alone is in the box is a number; where its tail leaves the range
/// of float within the box, random numbers of 24 bits still collide with it at times.
TEST(HardCases, TailsBeyondFloatAreNoBias) {
  RunRecord run =
      run_of(read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[{"name":"e","precision":"float",
      "rays":{"type":"orthographic","width":4,"height":4},"samples_per_ray":1024,
      "matrix":{"estimator":["ratio","delta"],"majorant":["global",{"type":"grid","resolution":8}],
      "medium":[{"type":"gaussian_bump","optical_depth":2,"center":[-0.64,-0.7,-1.5]},
                {"type":"exponential","rate":[-200,200],"optical_depth":2},
                {"type":"exponential","amplitude":1e-38,"rate":90},{"type":"exponential","amplitude":1e-300,"rate":700},
                {"type":"gaussian_bump","amplitude":1e45,"center":-0.35,"sigma":0.025}]},
      "include":[{"estimator":"delta","samples_per_ray":65536,
                  "medium":{"type":"gaussian_bump","optical_depth":2,"sigma":0.01,"center":0.5}}]}]})",
                         "test.json"));
  summarise(run);
  int passed = 0;
  for (const CellRecord& record : run.cells) {
    EXPECT_EQ(record.status, Status::ok) << record.cell.name << ": " << record.reason;
    EXPECT_NE(kind_of(record), Kind::fail) << record.cell.name << ": " << (record.verdict ? record.verdict->reason : "");
    passed += kind_of(record) == Kind::pass;
  }
  EXPECT_GE(passed, 12) << "of " << run.cells.size();
  // In double such a tail loses its digits in the end.
  GaussianBump bump;
  bump.profile.bell.center = -1.9;
  bump.target_depth = 2;
  EXPECT_THROW(bump.prepare(), ParameterError);
}

/// Nothing is a share of T = 0: what underflows must do so in every sample.
TEST(HardCases, MeansThatUnderflowAreJudged) {
  for (const char* tracker : {"closed_form", "delta", "ratio"}) {
    const CellRecord record = record_of(fmt::format(
        R"("samples_per_ray":64,"matrix":{{"estimator":"{}","medium":{{"type":"linear","optical_depth":1000}}}})", tracker));
    ASSERT_TRUE(record.verdict) << tracker;
    EXPECT_EQ(record.verdict->unbiased, Outcome::pass) << tracker << ": " << record.verdict->reason;
    EXPECT_EQ(*record.channel[0].reference, 0);
  }
}

/// A bound on lookups that fires is counted, in either kernel, and never leaves a sample that looks finished.
TEST(HardCases, WalksThatDoNotEndAreCounted) {
  EstimatorTemplate<RatioTracking> source;
  const auto medium = constant(1000);
  PreparedRay context;
  context.local = context.world = Ray{{0, 0.5, 0.5}, Vec3::UnitX(), 0, 1};
  context.bounds.start({{0, 1, 1000, medium->extrema(medium->bounds())}});
  const Extrema extrema = medium->extrema(medium->bounds());
  for (const auto precision : {Precision::float64, Precision::float32}) {
    const auto kernel = source.kernel(1, precision);
    const BlockKernel<RatioTracking, Real> plain(RatioTracking<Real>(), 1);
    for (const Kernel* one : {kernel.get(), static_cast<const Kernel*>(&plain)})
      for (const std::uint32_t most : {100u, 1u << 30}) {
        const auto workspace = one->workspace();
        workspace->most_lookups = most;
        one->begin_ray(*workspace, *medium, extrema, context);
        SampleBlock block;
        Counters counters;
        one->sample(*workspace, *medium, context, 1, 0, 16, Quantity::transmittance, block, counters);
        EXPECT_EQ(counters.overruns > 0, most == 100);
      }
  }
}

/// Samples so small that their fourth moments are no numbers show no variance that a verdict could rest on.
TEST(HardCases, PilotsWhoseMomentsUnderflowAreNotTrusted) {
  const CellRecord record = record_of(
      R"("samples_per_ray":64,"verdict":{"max_samples_per_ray":100000,"laws":"never"},"matrix":{"estimator":"p_series_cumulative",
         "medium":{"type":"layers","values":[1,0,3,0.5],"optical_depth":100}})");
  ASSERT_TRUE(record.verdict);
  EXPECT_EQ(record.verdict->unbiased, Outcome::inconclusive) << record.verdict->reason;
}

/// Lookups whose spread no theory states are judged by a pilot's, which says nothing where it has hardly seen one.
TEST(HardCases, PilotsThatSawNoLookupProveNothingOfTheirNumber) {
  const CellRecord record = record_of(
      R"("quantity":"free_path","samples_per_ray":64,"matrix":{"estimator":"hero_wavelength",
         "medium":{"type":"linear","optical_depth":1e-4,"spectrum":[1,2]}})");
  ASSERT_TRUE(record.verdict);
  EXPECT_TRUE(record.lookups_theory);
  EXPECT_NE(record.verdict->lookups, Outcome::fail);
}

/// Beyond the panels of a profile nothing is stated of lookups, and what they may cost is reckoned by the majorant's depth.
TEST(HardCases, LookupsThatAreNotStatedAreBudgeted) {
  const CellRecord record = record_of(
      R"("samples_per_ray":4,"verdict":{"max_samples_per_ray":2000,"max_lookups_per_ray":1e6,"laws":"never"},"matrix":{"estimator":"delta",
         "medium":{"type":"homogeneous","extinction":1},"majorant":{"type":"global","looseness":1e5}})");
  ASSERT_TRUE(record.verdict);
  EXPECT_FALSE(record.lookups_theory);
  EXPECT_LE(record.verdict->samples_per_ray, 16u);
  EXPECT_EQ(record.verdict->unbiased, Outcome::inconclusive);
}

/// The same volume ten thousand times smaller and a million times larger, from real files.  Voxels of 1e-6 OpenVDB itself
/// refuses.
TEST(HardCases, VoxelsOfAnySizeGiveTheSameTransmittance) {
  openvdb::initialize();
  const auto records = [](double voxel) {
    const auto grid = openvdb::FloatGrid::create(0);
    grid->setName("density");
    grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    for (int i = 0; i < 20; ++i)
      for (int j = 0; j < 20; ++j)
        for (int k = 0; k < 20; ++k) grid->tree().setValue({i - 7, j, k}, static_cast<float>((i * 7 % 5 + j % 3 + k % 2) / 64.));
    const std::string file = fmt::format("{}nullmark_voxels_{}_{}.vdb", ::testing::TempDir(), ::getpid(), voxel);
    openvdb::io::File(file).write({grid});
    const RunRecord run =
        run_of(read_config(fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e",
            "rays":{{"type":"orthographic","width":4,"height":4,"axis":"y"}},"samples_per_ray":4096,"verdict":{{"epsilon":0.05,"max_samples_per_ray":1000000}},
            "matrix":{{"estimator":["regular","ratio","delta"],"majorant":["global",{{"type":"grid","resolution":4}}],
                       "medium":{{"type":"vdb","file":"{}","extinction_per_value":{}}}}}}}]}})",
                                       file, 1 / voxel),
                           "test.json"));
    std::filesystem::remove(file);
    return run.cells;
  };
  const std::vector<CellRecord> unit = records(1);
  EXPECT_LT(*unit[0].channel[0].mean, 0.9);
  EXPECT_THROW(openvdb::math::Transform::createLinearTransform(1e-6), openvdb::ArithmeticError);
  for (const double voxel : {1e-4, 1e6}) {
    const std::vector<CellRecord> scaled = records(voxel);
    for (std::size_t i = 0; i < unit.size(); ++i) {
      ASSERT_EQ(scaled[i].status, Status::ok) << scaled[i].reason;
      EXPECT_NEAR(*scaled[i].channel[0].reference, *unit[i].channel[0].reference, 1e-12) << voxel;
      ASSERT_TRUE(scaled[i].verdict);
      EXPECT_EQ(scaled[i].verdict->unbiased, Outcome::pass) << scaled[i].cell.name << ": " << scaled[i].verdict->reason;
      EXPECT_NEAR(*scaled[i].lookups_theory, *unit[i].lookups_theory, 1e-9 * *unit[i].lookups_theory) << voxel;
    }
  }
}

/// A volume that readers and walks meet at their limits, and rays through it.
struct HardVolume {
  const char* name;
  double extinction_per_value;
  std::function<void(openvdb::FloatGrid&)> fill;
  std::vector<std::pair<openvdb::Vec3d, openvdb::Vec3d>> rays;
};

std::vector<HardVolume> hard_volumes() {
  using openvdb::Coord;
  // Through voxels, along their centres, along their faces and edges, and through their corners.
  const auto around = [](double at, double size) {
    const auto ray = [&](openvdb::Vec3d from, openvdb::Vec3d to) {
      return std::pair(from + openvdb::Vec3d(at), to + openvdb::Vec3d(at));
    };
    return std::vector{ray({-2, 0.3, 0.6}, {size, 0.7, 0.2}), ray({-2, 0, 0}, {size, 0, 0}), ray({0, 0.5, size}, {0, 0.5, -2}),
                       ray({0.5, size, 0.5}, {0.5, -2, 0.5}), ray({-1, -1, -1}, {size, size, size})};
  };
  const auto one = [](Coord at, float value) { return [=](openvdb::FloatGrid& grid) { grid.tree().setValue(at, value); }; };
  const int far = 10'000'000;
  return {
      {"one voxel", 2, one({0, 0, 0}, 1), around(0, 3)},
      {"voxels that touch in an edge and in a corner", 1,
       [](openvdb::FloatGrid& grid) {
         for (const Coord& at : {Coord(0, 0, 0), Coord(1, 1, 0), Coord(2, 2, 1)}) grid.tree().setValue(at, 1);
       },
       around(0, 4)},
      {"indices of 1e7", 1,
       [](openvdb::FloatGrid& grid) {
         for (int i = 0; i < 4; ++i) grid.tree().setValue({far + i, far, far + i % 2}, 1 + static_cast<float>(i));
       },
       around(far, 5)},
      {"denormal values", 1e40,
       [](openvdb::FloatGrid& grid) {
         for (int i = 0; i < 3; ++i) grid.tree().setValue({i, 0, 0}, 1e-40f);
       },
       around(0, 4)},
      {"active zeros around one value", 1,
       [](openvdb::FloatGrid& grid) {
         grid.fill(openvdb::CoordBBox({-8, -8, -8}, {15, 15, 15}), 0.f, true);
         grid.tree().setValue({1, 0, 0}, 2);
       },
       around(0, 12)},
      {"tiles of both levels beside a voxel", 0.01,
       [](openvdb::FloatGrid& grid) {
         grid.fill(openvdb::CoordBBox({0, 0, 0}, {127, 127, 127}), 1.f, true);
         grid.fill(openvdb::CoordBBox({128, 0, 0}, {135, 7, 7}), 3.f, true);
         grid.tree().setValue({136, 0, 0}, 50);
       },
       around(0, 140)},
      {"contrast of 1e60", 1e-30,
       [](openvdb::FloatGrid& grid) {
         for (int i = 0; i < 6; ++i) grid.tree().setValue({i, 0, 0}, i % 2 ? 1e30f : 1e-30f);
       },
       around(0, 7)},
  };
}

/// exp of the optical depth by the midpoint rule over OpenVDB's own sampler.
double sampled_transmittance(const openvdb::FloatGrid& grid, const HardVolume& volume, const openvdb::Vec3d& from,
                             const openvdb::Vec3d& to) {
  const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler> sampler(grid);
  constexpr int kPoints = 100'000;
  long double sum = 0;
  for (int i = 0; i < kPoints; ++i) sum += sampler.isSample(from + (to - from) * ((i + 0.5) / kPoints));
  return std::exp(-static_cast<double>(sum) / kPoints * (to - from).length() * volume.extinction_per_value);
}

/// Five trackers under five structures of bounds, through real files.
TEST(HardCases, VolumesAtTheirLimits) {
  openvdb::initialize();
  const std::string file = fmt::format("{}nullmark_limits_{}.vdb", ::testing::TempDir(), ::getpid());
  const auto point = [](const openvdb::Vec3d& p) { return fmt::format("[{},{},{}]", p[0], p[1], p[2]); };
  for (const HardVolume& volume : hard_volumes()) {
    const auto grid = openvdb::FloatGrid::create(0);
    grid->setName("density");
    volume.fill(*grid);
    openvdb::io::File(file).write({grid});
    int passed = 0, crossed = 0;
    for (const auto& [from, to] : volume.rays) {
      const RunRecord run =
          run_of(read_config(fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[{{"name":"e",
              "rays":{{"type":"single","from":{},"to":{}}},"samples_per_ray":1024,"verdict":{{"epsilon":0.05,"max_samples_per_ray":200000,"laws":"never"}},
              "matrix":{{"estimator":["regular","ratio","delta","next_flight_ratio",{{"type":"residual_ratio","control":"minimum"}}],
                         "majorant":["global",{{"type":"grid","resolution":[3,16]}},"kd_tree","octree","vdb_nodes"],
                         "medium":{{"type":"vdb","file":"{}","extinction_per_value":{}}}}}}}]}})",
                                         point(from), point(to), file, volume.extinction_per_value),
                             "test.json"));
      const double expected = sampled_transmittance(*grid, volume, from, to);
      crossed += expected < 1;
      for (const CellRecord& record : run.cells) {
        const std::string where = fmt::format("{}, from {} to {}: {}", volume.name, point(from), point(to), record.cell.name);
        ASSERT_EQ(record.status, Status::ok) << where << ": " << record.reason;
        EXPECT_EQ(record.nonfinite, 0u) << where;
        EXPECT_NEAR(*record.channel[0].reference, expected, 1e-6) << where;
        if (!record.verdict) continue;
        EXPECT_NE(record.verdict->unbiased, Outcome::fail) << where << ": " << record.verdict->reason;
        EXPECT_NE(record.verdict->unbiased, Outcome::violated) << where;
        passed += record.verdict->unbiased == Outcome::pass;
      }
    }
    EXPECT_GE(crossed, 3) << volume.name;
    EXPECT_GT(passed, 20 * crossed) << volume.name;
  }
  std::filesystem::remove(file);
}

/// The means that hard cases are held to, against arithmetic in long double.
TEST(HardCases, ReferencesAgreeWithLongDouble) {
  const Plan plan = read_config(read_file(NULLMARK_SOURCE_DIR "/configs/hard_cases.json"), "hard_cases.json");
  const RunRecord run =
      run_of(plan, [](const Cell& cell) { return cell.estimator->type == "closed_form" || cell.estimator->type == "regular"; });
  const auto depth_of = [](const CellRecord& record) -> std::optional<long double> {
    const Component& field = record.medium->field;
    if (record.cell.experiment == "rays" || record.cell.experiment == "negative_zero") return std::nullopt;
    if (field.type == "homogeneous") return std::get<Real>(field.values.at("extinction"));
    if (const auto depth = field.values.find("optical_depth"); depth != field.values.end() && record.medium->spectrum.empty())
      if (const Real value = std::get<Real>(depth->second); value > 0) return value;
    if (record.cell.experiment != "slab") return std::nullopt;
    const auto values = std::get<std::vector<Real>>(field.values.at("values")),
               edges = std::get<std::vector<Real>>(field.values.at("edges"));
    const long double inside = static_cast<long double>(edges[1]) - edges[0];
    return values[0] * (1 - inside) + values[1] * inside;
  };
  std::map<std::string, int> held;
  for (const CellRecord& record : run.cells) {
    if (record.status != Status::ok) continue;
    const auto depth = depth_of(record);
    if (!depth) continue;
    const auto exact = static_cast<Real>(std::exp(-*depth));
    // A slab's edges are told to 2^-53 of the ray, and so is what is scaled to a depth.
    const Real allowed = (record.cell.experiment == "slab" ? 1e-9 : 1e-13 * static_cast<Real>(1 + *depth)) * exact + 1e-300;
    EXPECT_NEAR(*record.channel[0].reference, exact, allowed) << record.cell.name;
    EXPECT_NEAR(*record.channel[0].mean, exact, allowed) << record.cell.name;
    ++held[record.cell.experiment];
  }
  for (const char* experiment : {"depth", "depth_in_cells", "depth_million", "looseness", "looseness_million", "violated",
                                 "denormal", "slab", "far", "size"})
    EXPECT_GT(held[experiment], 0) << experiment;
}

/// The table's numbers are those of its cells.
TEST(HardCases, TheTableTellsTheWorstOfEachTracker) {
  const Plan plan = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"one","rays":"single","samples_per_ray":64,"verdict":{"laws":"never"},
       "matrix":{"estimator":["closed_form","ratio","delta"],"medium":[{"type":"homogeneous","extinction":1},{"type":"homogeneous","extinction":2}],
                 "majorant":{"type":"global","looseness":0.9}}}]})",
                                "test.json");
  RunRecord run = run_of(plan);
  run.cells[3].nonfinite = 7;
  run.cells[3].largest_sample = 3e5;
  run.cells[0].status = Status::error;
  run.cells[0].reason = "a reason";
  const std::string text = stability_text(run), markdown = stability_markdown(run);
  const auto line_of = [&](const std::string& tracker) {
    const std::size_t at = text.find(fmt::format("one   {}", tracker));
    return at == std::string::npos ? "" : text.substr(at, text.find('\n', at) - at);
  };
  EXPECT_NE(line_of("closed_form").find("1 ERROR, 1 PASS"), std::string::npos) << text;
  EXPECT_NE(line_of("closed_form").find("1 a reason"), std::string::npos) << text;
  EXPECT_NE(line_of("ratio").find(" 7 "), std::string::npos) << text;
  EXPECT_NE(line_of("ratio").find("3e+05"), std::string::npos) << text;
  EXPECT_NE(line_of("delta").find("2 VIOLATED"), std::string::npos) << text;
  EXPECT_NE(line_of("delta").find("2 with violations of the bound counted"), std::string::npos) << text;
  EXPECT_NE(markdown.find("| one | ratio | 2 | 7 |"), std::string::npos) << markdown;
}

}  // namespace
}  // namespace nullmark
