// Media by name and the settings of their parameters: which are met, which are refused.

#include <gtest/gtest.h>

#include "media/media_test.h"

namespace nullmark {
namespace {

using namespace media_test;

std::string error_of(const std::string& type, const Settings& settings) {
  try {
    make(type, settings);
  } catch (const ParameterError& error) {
    return error.parameter + ": " + error.what();
  }
  return "";
}

TEST(MediaRegistry, HoldsTheProceduralMedia) {
  for (const char* name : {"checkerboard", "cosine", "exponential", "exponential_cube", "fractal_noise", "gaussian_bump",
                           "gaussian_hole", "homogeneous", "layers", "linear", "polynomial"}) {
    const MediumEntry* entry = Registry<MediumEntry>::instance().find(name);
    ASSERT_NE(entry, nullptr) << name;
    EXPECT_FALSE(entry->summary.empty());
    EXPECT_FALSE(entry->source.empty());
    EXPECT_EQ(make(name)->channels(), 1);
  }
}

TEST(MediaParameters, AxisHasTheAskedOpticalDepth) {
  for (const char* type :
       {"linear", "polynomial", "exponential", "exponential_cube", "cosine", "gaussian_bump", "gaussian_hole", "layers"})
    for (const char* axis : {"x", "y", "z"})
      for (const Real tau : {1e-4, 1., 1000.}) {
        const auto medium = make(type, {{"axis", axis}, {"optical_depth", tau}, {"lo", kLo}, {"hi", kHi}});
        Ray r;
        r.origin = (kLo + kHi) / 2;
        r.direction = Vec3::Unit(axis[0] - 'x');
        r.begin = -100;
        r.end = 100;
        EXPECT_NEAR((*medium->optical_depth(r))[0], tau, 1e-14 * tau) << type << axis;
      }
}

TEST(MediaParameters, ContradictionsAreNamed) {
  using Numbers = std::vector<Real>;
  const std::string dip = error_of("polynomial", {{"coefficients", Numbers{0.2, -1, 1}}});
  EXPECT_NE(dip.find("coefficients: "), std::string::npos);
  EXPECT_NE(dip.find("-0.05 at s = 0.5"), std::string::npos) << dip;
  const std::string cubic = error_of("polynomial", {{"coefficients", Numbers{0, 1, -3, 2}}});  // s (1-s) (1-2s)
  EXPECT_NE(cubic.find("at s = 0.788675"), std::string::npos) << cubic;
  EXPECT_EQ(error_of("polynomial", {{"coefficients", Numbers{0.25, -1, 1}}}), "");
  EXPECT_NE(error_of("gaussian_hole", {{"depth", 1.5}}).find("depth: "), std::string::npos);
  EXPECT_NE(error_of("exponential_cube", {{"x0", 1.}}).find("x0: "), std::string::npos);
  EXPECT_NE(error_of("exponential_cube", {{"x1", 0.}}).find("x1: "), std::string::npos);
  EXPECT_NE(error_of("layers", {{"edges", Numbers{0.5}}}).find("edges: "), std::string::npos);
  EXPECT_NE(error_of("layers", {{"edges", Numbers{0.5, 0.5, 0.75}}}).find("edges: "), std::string::npos);
  EXPECT_NE(error_of("layers", {{"edges", Numbers{0., 0.5, 0.75}}}).find("edges: "), std::string::npos);
  EXPECT_NE(error_of("fractal_noise", {{"frequency", 64}, {"octaves", 9}}).find("octaves: "), std::string::npos);
  for (const MediumEntry& entry : Registry<MediumEntry>::instance().entries()) {
    if (entry.name == "vdb" || entry.name == "canonical") continue;  // their boxes are the file's, and of a length
    EXPECT_NE(error_of(entry.name, {{"hi", Vec3(1, 0, 1)}}).find("hi: "), std::string::npos) << entry.name;
  }
}

}  // namespace
}  // namespace nullmark
