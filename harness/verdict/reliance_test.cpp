// How much of an answer is the depth that was handed over.

#include "harness/verdict/reliance.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/config/config.h"
#include "harness/testing/run_untimed.h"

namespace nullmark {
namespace {

CellRecord run_told(const std::string& estimator, const std::string& medium, const std::string& rest = "") {
  const Plan plan = read_config(fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"experiments":[
      {{"name":"told","rays":{{"type":"orthographic","axis":"x","width":4,"height":4}},"samples_per_ray":256,"verdict":{{"laws":"never"}},{}
        "matrix":{{"estimator":[{}],"medium":[{}],"majorant":[{{"type":"global","looseness":2}}]}}}}]}})",
                                            rest, estimator, medium),
                                "test.json");
  return run_untimed(plan).at(0);
}

constexpr const char* kConstant = R"({"type":"homogeneous","extinction":1})";
constexpr const char* kColoured = R"({"type":"linear","optical_depth":2,"spectrum":[1,0.5]})";

/// .02 is four standard errors and more.
TEST(Reliance, TellsHowMuchOfTheAnswerIsTheDepth) {
  for (const char* medium :
       {kConstant, kColoured, R"({"type":"homogeneous","extinction":0.01})", R"({"type":"homogeneous","extinction":100})"}) {
    const CellRecord record = run_told(R"("closed_form")", medium);
    EXPECT_TRUE(record.given_depth);
    ASSERT_TRUE(record.reliance) << medium;
    EXPECT_NEAR(*record.reliance, 1, 1e-3) << medium;
  }
  const CellRecord depth = run_told(R"("closed_form")", kColoured, R"("quantity":"optical_depth",)");
  ASSERT_TRUE(depth.reliance);
  EXPECT_NEAR(*depth.reliance, 1, 1e-3);
  const CellRecord normal = run_told(R"("jackknife_normal")", kConstant);
  ASSERT_TRUE(normal.reliance);
  EXPECT_NEAR(*normal.reliance, 1, 0.02);
  const CellRecord half = run_told(R"("planted_half_depth")", kConstant);
  ASSERT_TRUE(half.reliance);
  EXPECT_NEAR(*half.reliance, 0.5, 1e-3);
}

/// A control that is wrong leaves the mean alone, also where an exact one leaves no variance, and where the target is what the
/// control leaves over.
TEST(Reliance, IsNoneOfAControl) {
  for (const char* component : {"product", "residual"})
    for (const char* medium : {kConstant, kColoured, R"({"type":"cosine","optical_depth":5})"}) {
      const CellRecord record =
          run_told(fmt::format(R"({{"type":"residual_ratio","control":"ray_average","component":"{}"}})", component), medium);
      SCOPED_TRACE(record.cell.name);
      EXPECT_TRUE(record.given_depth);
      ASSERT_TRUE(record.reliance);
      EXPECT_NEAR(*record.reliance, 0, 0.02);
    }
}

/// Samples that compensate a wrong depth are as rare as it is slight: too few of them tell nothing.
TEST(Reliance, SaysNothingWhereItCannotTell) {
  const CellRecord thin =
      run_told(R"({"type":"residual_ratio","control":"ray_average"})", R"({"type":"homogeneous","extinction":0.001})");
  EXPECT_TRUE(thin.given_depth);
  EXPECT_FALSE(thin.reliance);
  const CellRecord ratio = run_told(R"("ratio")", kConstant);
  EXPECT_FALSE(ratio.given_depth);
  EXPECT_FALSE(ratio.reliance);
  const CellRecord flights = run_told(R"("closed_form")", kConstant, R"("quantity":"free_path",)");
  EXPECT_TRUE(flights.given_depth);
  EXPECT_FALSE(flights.reliance);
}

}  // namespace
}  // namespace nullmark
