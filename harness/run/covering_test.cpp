#include "harness/run/covering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "harness/config/config.h"
#include "harness/io/file_io.h"

namespace nullmark {
namespace {

Plan plan_of(const std::string& matrix) {
  return read_config(
      R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":1,"matrix":)" + matrix + "}]}",
      "test.json");
}

std::ptrdiff_t count(const std::vector<bool>& chosen) { return std::count(chosen.begin(), chosen.end(), true); }

TEST(Covering, TakesAllWhereEveryCellHasACombinationOfItsOwn) {
  EXPECT_EQ(count(covering_cells(plan_of(R"({"estimator":["ratio","delta"],"medium":["linear","cosine"]})"))), 4);
}

TEST(Covering, LeavesOutWhatOtherCellsMeet) {
  // Four depths of two media, which two trackers meet once each in turn.
  const Plan plan = plan_of(
      R"({"estimator":["ratio","delta"],"medium":[{"type":"linear","optical_depth":[1,2,3,4]},{"type":"cosine","optical_depth":[1,2,3,4]}]})");
  EXPECT_EQ(plan.cells.size(), 16u);
  EXPECT_EQ(count(covering_cells(plan)), 8);
}

TEST(Covering, MeetsEveryCombinationOfTheSweep) {
  const Plan plan = read_config(read_file(NULLMARK_SOURCE_DIR "/configs/unbiasedness.json"), "unbiasedness.json");
  const std::vector<bool> chosen = covering_cells(plan);
  std::set<std::pair<std::string, std::string>> media[2], bounds[2];
  std::set<std::tuple<std::string, std::string, std::string>> triples[2];
  for (std::size_t i = 0; i < plan.cells.size(); ++i)
    for (const bool covering : {false, true}) {
      if (covering && !chosen[i]) continue;
      const Cell& cell = plan.cells[i];
      const std::string &type = plan.media[cell.medium]->field.type, &majorant = plan.majorants[cell.majorant]->label;
      media[covering].insert({cell.estimator->label, type});
      bounds[covering].insert({type, majorant});
      triples[covering].insert({cell.estimator->label, majorant, cell.experiment});
    }
  EXPECT_EQ(media[0], media[1]);
  EXPECT_EQ(bounds[0], bounds[1]);
  EXPECT_EQ(triples[0], triples[1]);
  EXPECT_LT(count(chosen), static_cast<std::ptrdiff_t>(plan.cells.size() / 4));
}

}  // namespace
}  // namespace nullmark
