#include "harness/analysis/scaling.h"

#include <gtest/gtest.h>

#include <cmath>

#include "harness/config/config.h"

namespace nullmark {
namespace {

TEST(Scaling, APowerLawIsFoundWithTheScatterAroundIt) {
  EXPECT_FALSE(power_law({{1, 1}, {2, 4}}));
  EXPECT_FALSE(power_law({{2, 1}, {2, 4}, {2, 5}}));
  const Interval exact = *power_law({{1, 3}, {2, 12}, {4, 48}, {8, 192}});
  EXPECT_NEAR(exact.value, 2, 1e-12);
  EXPECT_NEAR(exact.high - exact.low, 0, 1e-9);
  // Residuals of +-e at x = 1, e, e^2: slope 0, squares 6 e^2 / ... by hand with three points and one degree of freedom.
  const Real e = std::exp(1.);
  const Interval bent = *power_law({{1, e}, {e, std::exp(-2.)}, {e * e, e}});
  EXPECT_NEAR(bent.value, 0, 1e-12);
  // residuals 1, -2, 1: squares 6; sum of squares of x: 2; t_1(.975) = 12.7062
  EXPECT_NEAR(bent.high, 12.7062 * std::sqrt(6. / 2), 1e-3);
}

std::vector<CellRecord> sampled(const std::string& matrix) {
  const Plan plan = read_config(
      R"({"nullmark":"config/2","experiments":[{"name":"e","rays":"single","samples_per_ray":10,"matrix":{)" + matrix + "}}]}",
      "test.json");
  std::vector<CellRecord> cells;
  for (const Cell& cell : plan.cells) {
    CellRecord record;
    record.cell = cell;
    record.medium = plan.media[cell.medium];
    record.majorant = plan.majorants[cell.majorant];
    record.ray_set = plan.ray_sets[cell.rays];
    record.status = Status::ok;
    record.lookups_per_sample = std::get<Real>(record.medium->field.values.at("optical_depth"));
    cells.push_back(record);
  }
  return cells;
}

TEST(Scaling, SeriesDifferInOneParameterAlone) {
  RunRecord run;
  run.cells = sampled(R"("estimator":["ratio","delta"],"medium":{"type":"linear","optical_depth":[4,1,2]},
                         "majorant":{"type":"global","looseness":[1,2]})");
  const std::vector<ScalingSeries> series = scaling_series(run);
  ASSERT_EQ(series.size(), 4u);
  for (const ScalingSeries& one : series) {
    EXPECT_EQ(one.axis, "medium.optical_depth");
    EXPECT_EQ(one.x, (std::vector<Real>{1, 2, 4}));
    EXPECT_NEAR(one.lookups->value, 1, 1e-12);
    EXPECT_FALSE(one.time);
    for (const CellRecord* record : one.cells) EXPECT_EQ(record->cell.estimator->type, one.tracker);
  }
}

}  // namespace
}  // namespace nullmark
