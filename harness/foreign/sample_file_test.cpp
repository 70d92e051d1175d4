// Samples in files, from the problem to the verdict: right ones pass, a slip of 1 % fails, and files that lie are refused.

#include "harness/foreign/sample_file.h"

#include <algorithm>
#include <cstring>

#include "harness/foreign/drawn_samples_test.h"
#include "harness/io/npy.h"
#include "harness/testing/program.h"

namespace nullmark {
namespace {

class SampleFiles : public ProgramTest {
 protected:
  void pose(const std::string& medium, const std::string& rays = R"({"type":"orthographic","width":8,"height":8})",
            const std::string& quantity = "transmittance") {
    write("c.json",
          fmt::format(R"({{"nullmark":"config/2","name":"c","experiments":[{{"name":"e","samples_per_ray":1,"quantity":"{}",
        "matrix":{{"estimator":["ratio","delta"],"rays":{},"medium":{}}}}}]}})",
                      quantity, rays, medium));
    ASSERT_EQ(run("problem c.json -o p --resolution 16 --with-answers"), 0) << read("err");
  }

  Plan scene(const std::string& id = "") const { return ProblemScene::read((folder_ / "p").string(), id).plan(); }

  void write_npy(const std::string& name, const std::vector<std::uint64_t>& shape, const std::vector<Real>& values) const {
    std::ofstream(folder_ / name, std::ios::binary) << npy_text(shape, values);
  }

  std::vector<Real> read_numbers(const std::string& name) const {
    const std::string path = (folder_ / name).string();
    std::vector<Real> all;
    read_npy(path, read_npy_header(path),
             [&](std::uint64_t, std::span<const Real> some) { all.insert(all.end(), some.begin(), some.end()); });
    return all;
  }

  /// Exit 2 and one line with these words.
  void expect_refused(const std::string& arguments, const std::string& words) const {
    EXPECT_EQ(run("judge " + arguments), 2) << arguments << read("out");
    const std::string err = read("err");
    EXPECT_NE(err.find(words), std::string::npos) << err;
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
  }
};

TEST_F(SampleFiles, ThePilotsSamplesAreHeldToTheRangeToo) {
  pose(R"({"type":"cosine","optical_depth":0.7})");
  const std::uint64_t rays = scene().cells.empty() ? 0 : 64;
  std::vector<Real> values(1024 * rays, 0.5);
  values[3] = std::numeric_limits<Real>::quiet_NaN();
  write_npy("nan.npy", {1024, rays}, values);
  expect_refused("p nan.npy --range unit", "sample 0 of ray 3 is nan; expected a number");
  values[3] = 1.5;
  write_npy("over.npy", {1024, rays}, values);
  expect_refused("p over.npy --range unit", "sample 0 of ray 3 is 1.5; expected the stated range, unit");
}

TEST_F(SampleFiles, RightSamplesPassAndASlipFails) {
  pose(R"({"type":"cosine","optical_depth":0.7})");
  const Plan plan = scene();
  const PreparedCell cell = drawn_samples::prepared(plan);
  constexpr std::size_t kSamples = 1 << 14;
  std::vector<Real> values = drawn_samples::drawn(cell, kSamples);
  const std::uint64_t rays = cell.scene->rays->world.size();
  write_npy("right.npy", {kSamples, rays}, values);
  EXPECT_EQ(run("judge p right.npy --range unit -o right.json"), 0) << read("out") << read("err");
  EXPECT_EQ(read("out").find("PASS"), 0u) << read("out");
  EXPECT_NE(read("out").find(": |bias| < "), std::string::npos) << read("out");
  EXPECT_EQ(read("err"), "");
  // Theory states no variance here: without a range a pilot's is trusted.
  EXPECT_EQ(run("judge p right.npy"), 0) << read("out") << read("err");
  EXPECT_EQ(run("check right.json"), 0) << read("out");
  const CellRecord record = results("right.json").cells.at(0);
  EXPECT_EQ(record.tracker.name, "right.npy");
  EXPECT_TRUE(record.tracker.lookups_told && record.tracker.unrepeatable);
  EXPECT_EQ(record.lookups, 0u);
  EXPECT_EQ(record.samples, split_samples(kSamples).judged * rays);
  EXPECT_EQ(record.verdict->samples_per_ray, split_samples(kSamples).judged);
  for (Real& value : values) value *= 0.99;
  write_npy("slip.npy", {kSamples, rays, 1}, values);
  EXPECT_EQ(run("judge p slip.npy --range unit"), 3) << read("out") << read("err");
  EXPECT_EQ(read("out").find("FAIL: "), 0u) << read("out");
  // A tenth of the samples decides nothing, and the program says what would.
  values.resize(64 * rays);
  write_npy("few.npy", {64, rays}, values);
  EXPECT_EQ(run("judge p few.npy"), 77) << read("out") << read("err");
  EXPECT_NE(read("out").find("undecided: hand in more samples; state their --range"), std::string::npos) << read("out");
  EXPECT_EQ(read("out").find("max_samples_per_ray"), std::string::npos) << read("out");
  values.back() = 1.5;
  write_npy("beyond.npy", {64, rays}, values);
  expect_refused("p beyond.npy --range unit", "is 1.5; expected the stated range, unit");
  values.back() = kInfinity;
  write_npy("infinite.npy", {64, rays}, values);
  expect_refused("p infinite.npy --range unit", "is inf; expected a number");
}

TEST_F(SampleFiles, SpectraAndSinglesAreJudged) {
  pose(R"([{"type":"linear","spectrum":[0.5,1,2]},{"type":"linear","end":2}])", R"("single")");
  EXPECT_EQ(run("judge p none.npy"), 2);
  EXPECT_NE(read("err").find("has 2 scenes; give --scene with one of 0, 1"), std::string::npos) << read("err");
  const Plan plan = scene("0");
  const PreparedCell cell = drawn_samples::prepared(plan);
  constexpr std::size_t kSamples = 1 << 20;
  const std::vector<Real> values = drawn_samples::drawn(cell, kSamples);
  std::string text = npy_text({kSamples, 1, 3}, values);
  // As numpy.float32 would be: the same header, but for the type.
  text.replace(text.find("<f8"), 3, "<f4");
  text.resize(text.size() - values.size() * sizeof(Real));
  const std::vector<float> singles(values.begin(), values.end());
  text.append(reinterpret_cast<const char*>(singles.data()), singles.size() * sizeof(float));
  std::ofstream(folder_ / "s.npy", std::ios::binary) << text;
  EXPECT_EQ(run("judge p s.npy --scene 0 --range unit"), 0) << read("out") << read("err");
  expect_refused("p s.npy --scene 1", "found 3 channels; the medium has 1");
  expect_refused("p s.npy --scene 7", "has no scene \"7\"; it has 0, 1");
}

/// A number between two words; nothing where they are not there.
std::optional<Real> number_after(const std::string& text, const std::string& before) {
  const std::size_t at = text.find(before);
  return at == std::string::npos ? std::optional<Real>() : std::stod(text.substr(at + before.size()));
}

TEST_F(SampleFiles, WhatAVerdictTakesIsTheTotal) {
  pose(R"("linear")");
  const Plan plan = scene();
  const PreparedCell cell = drawn_samples::prepared(plan);
  constexpr std::size_t kFew = 400;
  write_npy("few.npy", {kFew, 64}, drawn_samples::drawn(cell, kFew));
  ASSERT_EQ(run("judge p few.npy --range unit"), 77) << read("out") << read("err");
  const std::string out = read("out");
  const SampleSplit split = split_samples(kFew);
  EXPECT_NE(
      out.find(fmt::format("not decidable at {} samples a ray, {} of them the pilot's; a PASS at epsilon ", kFew, split.pilot)),
      std::string::npos)
      << out;
  // The widest margin is that of a group of rays.
  const auto total = number_after(out, " of the mean of a group of rays needs ");
  EXPECT_NE(out.find(" in all (relative variance "), std::string::npos) << out;
  ASSERT_TRUE(total) << out;
  // As many are enough.
  const auto enough = static_cast<std::size_t>(1.1 * *total);
  write_npy("enough.npy", {enough, 64}, drawn_samples::drawn(cell, enough));
  EXPECT_EQ(run("judge p enough.npy --range unit"), 0) << read("out") << read("err");
}

TEST_F(SampleFiles, AnswersAreWhatSamplesEstimate) {
  pose(R"(["linear",{"type":"gaussian_bump"}])", R"([{"type":"chords","count":50},{"type":"orthographic","width":3,"height":2}])",
       "optical_depth");
  const Json problem = Json::parse(read("p/problem.json"));
  EXPECT_EQ(problem["nullmark"], "problem/1");
  ASSERT_EQ(problem["scenes"].size(), 4u);
  for (const Json& one : problem["scenes"]) {
    const std::string id = one["id"];
    const Plan plan = scene(id);
    const PreparedCell cell = drawn_samples::prepared(plan);
    EXPECT_EQ(read_numbers(fmt::format("p/answers/{}.npy", id)), cell.scene->reference->depth);
    const std::vector<Real> rays = read_numbers(fmt::format("p/rays/{}.npy", id));
    ASSERT_EQ(rays.size(), 8 * one["rays"]["count"].get<std::size_t>());
    // By hand: the raw file, its map, and a midpoint rule along a ray.
    const std::string raw = read(one["volume"]["raw"].get<std::string>().insert(0, "p/"));
    const std::vector<int> dims = one["volume"]["dims"];
    ASSERT_EQ(raw.size(), sizeof(float) * static_cast<std::size_t>(dims[0] * dims[1] * dims[2]));
    Affine map = Affine::Identity();
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 4; ++column) map(row, column) = one["volume"]["index_to_world"][row][column];
    const Affine to_index = map.inverse();
    const auto voxel = [&](int i, int j, int k) {
      if (i < 0 || j < 0 || k < 0 || i >= dims[0] || j >= dims[1] || k >= dims[2]) return 0.f;
      float value = 0;
      std::memcpy(&value, &raw[sizeof value * static_cast<std::size_t>((k * dims[1] + j) * dims[0] + i)], sizeof value);
      return value;
    };
    const std::size_t ray = 1;
    const Real* r = &rays[8 * ray];
    constexpr int kSteps = 20'000;
    Real depth = 0;
    for (int step = 0; step < kSteps; ++step) {
      const Real t = r[6] + (r[7] - r[6]) * (step + 0.5) / kSteps;
      const Vec3 p = to_index * Vec3(r[0] + t * r[3], r[1] + t * r[4], r[2] + t * r[5]);
      const Vec3 low = p.array().floor(), f = p - low;
      for (int corner = 0; corner < 8; ++corner) {
        const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
        const Real w = (a ? f[0] : 1 - f[0]) * (b ? f[1] : 1 - f[1]) * (c ? f[2] : 1 - f[2]);
        depth += w * voxel(static_cast<int>(low[0]) + a, static_cast<int>(low[1]) + b, static_cast<int>(low[2]) + c) *
                 (r[7] - r[6]) / kSteps;
      }
    }
    EXPECT_NEAR(depth, cell.scene->reference->depth[ray], 1e-5) << id;
    EXPECT_GT(depth, 0) << id;
  }
}

TEST_F(SampleFiles, FilesThatLieAreRefused) {
  pose(R"("linear")");
  const std::vector<Real> values(16 * 64, 0.5);
  write_npy("short.npy", {16, 64}, values);
  std::filesystem::resize_file(folder_ / "short.npy", std::filesystem::file_size(folder_ / "short.npy") - 3);
  expect_refused("p short.npy", "cut short");
  write_npy("rays.npy", {32, 32}, values);
  expect_refused("p rays.npy", "found samples of 32 rays; scene 0 has 64");
  expect_refused("p rays.npy --correlated", "found samples of 32 rays; scene 0 has 64");
  write_npy("flat.npy", {16 * 64}, values);
  expect_refused("p flat.npy", "found 1 dimensions");
  write_npy("channels.npy", {8, 64, 2}, values);
  expect_refused("p channels.npy", "found 2 channels; the medium has 1");
  expect_refused("p channels.npy --correlated", "found 2 channels; the scene has 1");
  write_npy("none.npy", {0, 64}, {});
  expect_refused("p none.npy", "holds no samples");
  write_npy("three.npy", {3, 64}, std::vector<Real>(3 * 64));
  expect_refused("p three.npy", "found 3 samples of each ray; expected at least 4");
  write("no.npy", "PK\x03\x04 is how archives begin");
  expect_refused("p no.npy", "is no .npy file");
  expect_refused("p absent.npy", "absent.npy: no such file");
  expect_refused("absent short.npy", "absent: no such folder");
  expect_refused("p rays.npy --range any", "unknown range \"any\"");
  write("p/problem.json", R"({"nullmark":"config/2"})");
  expect_refused("p rays.npy", "expected \"nullmark\": \"problem/1\"");
  write("p/problem.json", R"({"nullmark":"problem/1","config":{"nullmark":"config/2","experiments":[{"name":"0","rays":"single",
      "samples_per_ray":1,"quantity":"free_path","matrix":{"estimator":"delta","medium":"linear"}}]}})");
  expect_refused("p rays.npy", "found quantity \"free_path\"");
  write("p/problem.json", R"({"nullmark":"problem/1","config":{"nullmark":"config/2","experiments":[]}})");
  EXPECT_EQ(run("judge p rays.npy"), 2) << read("err");
}

TEST_F(SampleFiles, MissingFilesHaveRemedies) {
  pose(R"("linear")");
  write_npy("p/s.npy", {16, 64}, std::vector<Real>(16 * 64, 0.5));
  write_npy("t.npy", {16, 64}, std::vector<Real>(16 * 64, 0.5));
  expect_refused("p s.npy", "s.npy: no such file; p/s.npy is there");
  expect_refused("p x/t.npy", "x/t.npy: no such file; t.npy is there");
  expect_refused("p file:t.npy", "file:t.npy: no such file; leave out \"file:\"");
  expect_refused("p none.npy", "none.npy: no such file; expected an .npy file, or a folder of .exr images");
  expect_refused("none t.npy", "none: no such folder; `nullmark problem CONFIG -o none` writes it");
  std::filesystem::create_directory(folder_ / "empty");
  expect_refused("empty t.npy", "empty/problem.json: no such file; expected a folder that `nullmark problem` wrote");
  expect_refused("t.npy p", "t.npy: is no folder; expected one that `nullmark problem` wrote");
}

TEST_F(SampleFiles, ProblemsThatCannotBeWrittenAreRefused) {
  pose(R"("linear")");
  EXPECT_EQ(run("problem c.json -o p"), 2);
  EXPECT_NE(read("err").find("p: is not empty; --force writes into it"), std::string::npos) << read("err");
  EXPECT_EQ(run("problem c.json -o p --force --resolution 8"), 0) << read("err");
  write("channels.json", R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,
      "matrix":{"estimator":"ratio","medium":{"type":"channels","media":["homogeneous","linear"]}}}]})");
  EXPECT_EQ(run("problem channels.json -o q"), 2);
  EXPECT_NE(read("err").find("channels.json: /experiments/0/matrix/medium: found a medium of 2 fields"), std::string::npos)
      << read("err");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "q"));
  write("paths.json", R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,
      "quantity":"free_path","matrix":{"estimator":"delta","medium":"linear"}}]})");
  EXPECT_EQ(run("problem paths.json -o q"), 2);
  EXPECT_NE(read("err").find("nothing to write"), std::string::npos) << read("err");
}

/// The configuration that was given is to blame, and what was written before the mistake is gone.
TEST_F(SampleFiles, ProblemsThatFailLeaveNothing) {
  const auto volume = [](const char* more) {
    return fmt::format(R"({{"nullmark":"config/2","experiments":[{{"name":"e","rays":"single","samples_per_ray":1,
        "matrix":{{"estimator":"ratio","medium":["linear",{{"type":"vdb","file":"nowhere.vdb"{}}}]}}}}]}})",
                       more);
  };
  write("c.json", volume(""));
  EXPECT_EQ(run("problem c.json -o q --resolution 8"), 2);
  EXPECT_EQ(read("err"),
            "nullmark: c.json: /experiments/0/matrix/medium/1/file: nowhere.vdb: no such file in the current folder (grid "
            "\"density\"); `nullmark make-volume nowhere.vdb` writes a procedural one; say \"optional\": true to leave it out\n");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "q"));
  write("c.json", volume(R"(,"optional":true)"));
  EXPECT_EQ(run("problem c.json -o q --resolution 8"), 0);
  EXPECT_NE(read("err").find("left out: nowhere.vdb: no such file"), std::string::npos) << read("err");
  EXPECT_EQ(Json::parse(read("q/problem.json"))["scenes"].size(), 1u);
  // A disk that is full shows only while it is written.
  std::filesystem::create_directories(folder_ / "empty");
  for (const char* folder : {"new", "empty"}) {
    const std::string limited = fmt::format("cd '{}' && ulimit -f 1 && '{}' problem c.json -o {} --resolution 64 >out 2>err",
                                            folder_.string(), NULLMARK_PROGRAM, folder);
    EXPECT_NE(WEXITSTATUS(std::system(limited.c_str())), 0);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "new"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "empty"));
}

TEST_F(SampleFiles, VolumesAreNamedAsTheyAre) {
  ASSERT_EQ(run("make-volume smoke.vdb --resolution 16"), 0) << read("err");
  pose(R"({"type":"vdb","file":"smoke.vdb","extinction_per_value":3})", R"({"type":"orthographic","width":4,"height":4})");
  const Json volume = Json::parse(read("p/problem.json"))["scenes"][0]["volume"];
  EXPECT_EQ(volume["vdb"], (std::filesystem::canonical(folder_) / "smoke.vdb").string());
  EXPECT_EQ(volume["extinction_per_value"], 3);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "p/volumes/0.vdb"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "p/volumes/0.raw"));
  const Plan plan = scene();
  const PreparedCell cell = drawn_samples::prepared(plan);
  constexpr std::size_t kSamples = 1 << 16;
  write_npy("right.npy", {kSamples, 16}, drawn_samples::drawn(cell, kSamples));
  EXPECT_EQ(run("judge p right.npy --range unit"), 0) << read("out") << read("err");
}

TEST(SampleSplits, UseEachSampleOnce) {
  for (const std::uint64_t n : {1, 2, 3, 4, 100, 128, 129, 256, 300, 1000, 1024, 4096, 100'000}) {
    const SampleSplit split = split_samples(n);
    EXPECT_EQ(split.pilot + split.judged, n);
    EXPECT_GT(split.judged, 0u);
    EXPECT_TRUE(split.judged < 64 || split.judged % 64 == 0) << n;
  }
  const auto samples = std::make_shared<GivenSamples>(2, 1, 10, false);
  const auto kernel = make_given_samples_kernel(samples);
  const auto workspace = kernel->workspace();
  MediumSpec spec;
  spec.field.type = "homogeneous";
  const BuiltMedium medium = build_medium(spec);
  PreparedRay context;
  SampleBlock block;
  Counters counters;
  const auto draw = [&](std::uint64_t first, std::size_t count) {
    kernel->sample(*workspace, *medium.medium, context, 0, first, count, Quantity::transmittance, block, counters);
  };
  draw(0, 5);
  draw(first_sample::kPilot, 5);
  EXPECT_THROW(draw(0, 6), std::runtime_error);
  EXPECT_THROW(draw(5, 1), std::runtime_error);
  EXPECT_THROW(draw(first_sample::kPilot + 3, 3), std::runtime_error);
  EXPECT_THROW(draw(first_sample::kLaws, 1), std::runtime_error);
}

}  // namespace
}  // namespace nullmark
