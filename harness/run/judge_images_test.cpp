// Pictures whose pixels share random numbers: a right renderer is never told to be biased, a biased one is.

#include "harness/run/judge_images.h"

#include <cmath>
#include <random>

#include "harness/config/config.h"
#include "harness/foreign/drawn_samples_test.h"
#include "harness/foreign/sample_file.h"
#include "harness/io/npy.h"
#include "harness/run/image.h"
#include "harness/testing/program.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

constexpr int kSide = 16;
constexpr std::size_t kPictures = 1000;

/// A renderer that draws one random number for each picture: pixel = T (1 + bias) (1 + spread (u - 1/2)), right
/// without a bias.
class SharedNumbers {
 public:
  SharedNumbers(const PreparedCell& cell, int seed, Real bias, Real spread = 0.1)
      : depth_(cell.scene->reference->depth), random_(static_cast<unsigned>(seed)), bias_(bias), spread_(spread) {}

  std::vector<Real> picture() {
    const Real u = std::uniform_real_distribution<Real>()(random_);
    std::vector<Real> pixels;
    for (const Real depth : depth_) pixels.push_back(std::exp(-depth) * (1 + bias_) * (1 + spread_ * (u - 0.5)));
    return pixels;
  }

 private:
  std::vector<Real> depth_;
  std::mt19937 random_;
  Real bias_, spread_;
};

class Pictures : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    write("c.json", fmt::format(R"({{"nullmark":"config/2","name":"c","experiments":[{{"name":"e","samples_per_ray":1,
        "rays":{{"type":"orthographic","width":{},"height":{}}},"matrix":{{"estimator":"ratio","medium":{{"type":"linear","end":2}}}}}}]}})",
                                kSide, kSide));
    ASSERT_EQ(run("problem c.json -o p --resolution 16"), 0) << read("err");
  }

  ProblemScene scene() const { return ProblemScene::read((folder_ / "p").string(), ""); }

  /// What becomes of pictures of a seed.
  CellRecord judged(const PreparedCell& whole, int seed, Real bias, SampleRange range) const {
    SharedNumbers renderer(whole, seed, bias);
    PixelGroups pictures(*whole.scene->rays, 1);
    for (std::size_t i = 0; i < kPictures; ++i) pictures.add(renderer.picture());
    const Plan plan = scene().plan(R"({"type":"samples","file":"renders"})", split_samples(kPictures).judged, "renders");
    return *judge_pictures(plan, whole, pictures, {"renders", 1, range}, [] { return false; });
  }

  void write_images(const std::string& folder, const PreparedCell& whole, std::size_t count, Real bias, int side = kSide) const {
    std::filesystem::create_directories(folder_ / folder);
    SharedNumbers renderer(whole, 5, bias);
    for (std::size_t i = 0; i < count; ++i) {
      std::vector<Real> pixels = renderer.picture();
      pixels.resize(static_cast<std::size_t>(side * side));
      write_exr((folder_ / folder / fmt::format("{:04}.exr", i)).string(), side, side, {{"Y", pixels}});
    }
  }
};

TEST_F(Pictures, RightOnesNeverFailAndBiasedOnesDo) {
  const Plan plan = scene().plan();
  const PreparedCell whole = drawn_samples::prepared(plan);
  for (const SampleRange range : {SampleRange::unit, SampleRange::any_sign})
    for (int seed = 1; seed <= 20; ++seed) {
      const CellRecord right = judged(whole, seed, 0, range), wrong = judged(whole, seed, 0.05, range);
      EXPECT_NE(kind_of(right), Kind::fail) << seed << reason_of(right);
      EXPECT_EQ(kind_of(wrong), Kind::fail) << seed << reason_of(wrong);
      ASSERT_EQ(right.verdict->tests.size(), 17u);
      EXPECT_EQ(right.verdict->family, 34u);
      EXPECT_EQ(right.rays, static_cast<std::size_t>(kSide * kSide));
      EXPECT_EQ(right.samples, split_samples(kPictures).judged);
    }
}

/// The proof that groups are needed: as independent rays the same right pictures are told to be biased.
TEST_F(Pictures, AsIndependentRaysRightOnesWouldFail) {
  const Plan plan = scene().plan();
  const PreparedCell whole = drawn_samples::prepared(plan);
  int failed = 0;
  for (int seed = 1; seed <= 5; ++seed) {
    SharedNumbers renderer(whole, seed, 0, 1);
    std::vector<Real> rows;
    for (std::size_t i = 0; i < kPictures; ++i) {
      const std::vector<Real> picture = renderer.picture();
      rows.insert(rows.end(), picture.begin(), picture.end());
    }
    std::ofstream(folder_ / "rows.npy", std::ios::binary) << npy_text({kPictures, kSide * kSide}, rows);
    failed += run("judge p rows.npy") == 3 && read("out").find("proven (log E") != std::string::npos;
    EXPECT_NE(read("err").find("give --correlated if rays share random numbers"), std::string::npos) << read("err");
    const int as_pictures = run("judge p rows.npy --correlated");
    EXPECT_TRUE(as_pictures == 0 || as_pictures == 77) << read("out") << read("err");
  }
  // At a level of 1e-4 one of five is too many.
  EXPECT_GT(failed, 0);
}

TEST_F(Pictures, FoldersOfImagesAreJudged) {
  const Plan plan = scene().plan();
  const PreparedCell whole = drawn_samples::prepared(plan);
  write_images("right", whole, kPictures, 0);
  write_images("wrong", whole, kPictures, 0.05);
  EXPECT_EQ(run("judge p right -o right.json"), 0) << read("out") << read("err");
  EXPECT_EQ(run("check right.json"), 0) << read("out") << read("err");
  EXPECT_EQ(run("report right.json -o right.html"), 0) << read("err");
  EXPECT_EQ(run("judge p wrong --range unit"), 3) << read("out") << read("err");
  write_images("few", whole, 40, 0);
  EXPECT_EQ(run("judge p few/"), 77) << read("out") << read("err");
  EXPECT_NE(read("out").find("undecided: hand in more images; state their --range"), std::string::npos) << read("out");
  EXPECT_EQ(run("judge p few --range unit"), 77) << read("out") << read("err");
  EXPECT_NE(read("out").find("a PASS at epsilon"), std::string::npos) << read("out");
}

TEST_F(Pictures, SpectraAreJudgedChannelByChannel) {
  write("c.json", R"({"nullmark":"config/2","name":"c","experiments":[{"name":"e","samples_per_ray":1,
      "rays":{"type":"orthographic","width":8,"height":8},
      "matrix":{"estimator":"ratio","medium":{"type":"linear","spectrum":[0.5,1,2]}}}]})");
  ASSERT_EQ(run("problem c.json -o s --resolution 8"), 0) << read("err");
  const Plan plan = ProblemScene::read((folder_ / "s").string(), "").plan();
  const PreparedCell whole = drawn_samples::prepared(plan);
  std::mt19937 random(3);
  for (const char* folder : {"right", "blue"}) std::filesystem::create_directories(folder_ / folder);
  for (std::size_t i = 0; i < kPictures; ++i) {
    const Real noise = 0.95 + 0.1 * std::uniform_real_distribution<Real>()(random);
    std::vector<Layer> layers = {{"R", {}}, {"G", {}}, {"B", {}}};
    for (std::size_t at = 0; at < whole.scene->reference->depth.size(); ++at)
      layers[at % 3].values.push_back(noise * std::exp(-whole.scene->reference->depth[at]));
    write_exr((folder_ / "right" / fmt::format("{:04}.exr", i)).string(), 8, 8, layers);
    for (Real& value : layers[2].values) value *= 1.05;
    write_exr((folder_ / "blue" / fmt::format("{:04}.exr", i)).string(), 8, 8, layers);
  }
  EXPECT_EQ(run("judge s right -o r.json"), 0) << read("out") << read("err");
  EXPECT_EQ(results("r.json").cells.at(0).channel.size(), 3u);
  EXPECT_EQ(results("r.json").cells.at(0).verdict->tests.size(), 51u);
  EXPECT_EQ(run("judge s blue"), 3) << read("out") << read("err");
  EXPECT_NE(read("out").find("channel 2"), std::string::npos) << read("out");
}

TEST_F(Pictures, OtherImagesAreRefused) {
  const Plan plan = scene().plan();
  const PreparedCell whole = drawn_samples::prepared(plan);
  const auto expect_refused = [&](const std::string& words) {
    EXPECT_EQ(run("judge p i"), 2) << read("out");
    const std::string err = read("err");
    EXPECT_NE(err.find(words), std::string::npos) << err;
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
  };
  std::filesystem::create_directories(folder_ / "i");
  expect_refused("has no *.exr images");
  write_images("i", whole, 3, 0);
  expect_refused("found 3 images; expected at least 4");
  write_images("i", whole, 8, 0, kSide / 2);
  expect_refused("0000.exr: found 8 x 8 pixels; the scene has 16 x 16");
  write_images("i", whole, 8, 0);
  for (int i = 1; i < 8; ++i)
    std::filesystem::copy(folder_ / "i/0000.exr", folder_ / fmt::format("i/{:04}.exr", i),
                          std::filesystem::copy_options::overwrite_existing);
  expect_refused("hold the same picture, and so do all; each image needs a seed of its own");
  write("i/0003.exr", read("i/0002.exr").substr(0, 200));
  expect_refused("0003.exr");
  write("i/0003.exr", "no image");
  expect_refused("0003.exr");
  write_exr((folder_ / "i/0003.exr").string(), kSide, kSide,
            {{"X", std::vector<Real>(kSide * kSide)}, {"Y", std::vector<Real>(kSide * kSide)}});
  expect_refused("0003.exr: found 2 channels; the scene has 1");
}

TEST_F(Pictures, RaysThatFormNoImageTakeNone) {
  write("c.json", R"({"nullmark":"config/2","name":"c","experiments":[{"name":"e","samples_per_ray":1,"rays":"single",
      "matrix":{"estimator":"ratio","medium":"linear"}}]})");
  ASSERT_EQ(run("problem c.json -o q --resolution 8"), 0) << read("err");
  std::filesystem::create_directories(folder_ / "i");
  EXPECT_EQ(run("judge q i"), 2);
  EXPECT_NE(read("err").find("the rays of the scene form no image"), std::string::npos) << read("err");
}

}  // namespace
}  // namespace nullmark
