#include "harness/run/demand.h"

#include <gtest/gtest.h>

#include "harness/config/config.h"
#include "harness/sampling/cell_theory.h"
#include "harness/sampling/test_families.h"
#include "harness/verdict/walk_laws.h"

namespace nullmark {
namespace {

/// The laws of walks stop at a number of lookups.  Where theory does not state how many a sample takes, as for majorant-guided
/// ratio tracking, their demand must come from counted ones: with one lookup a sample a sweep was foreseen 12 times too long.
TEST(Demand, LawsDrawAsManyLookupsAsTheyMay) {
  const Plan plan = read_config(R"({"nullmark":"config/2","timing":{"enabled":false},"experiments":[
      {"name":"e","rays":"single","samples_per_ray":64,"verdict":{"laws":"always"},
       "matrix":{"estimator":["ratio",{"type":"majorant_guided_ratio","start":"lookup"}],
                 "medium":{"type":"cosine","optical_depth":5},"majorant":{"type":"global","looseness":40}}}]})",
                                "demand.json");
  CellPreparer preparer(plan, 256);
  std::vector<PreparedCell> cells = prepare_all(preparer, plan, [](std::size_t) { return true; });
  add_theory(cells);
  ASSERT_EQ(cells.size(), 2u);
  for (const PreparedCell& prepared : cells) {
    SCOPED_TRACE(prepared.cell->name);
    const Demand demand(prepared, {plan.error_rates.alpha_pass, mean_family(plan)}, 1);
    const double each = static_cast<double>(demand.probe.lookups) / static_cast<double>(demand.probe.samples);
    // One ray; samples of laws count for 3, because they are recorded.
    EXPECT_GT(each, 60);
    EXPECT_NEAR(demand.laws * each / 3, LawBudget{}.lookups, 0.2 * LawBudget{}.lookups);
  }
}

}  // namespace
}  // namespace nullmark
