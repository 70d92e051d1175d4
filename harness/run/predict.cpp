#include "harness/run/predict.h"

#include <algorithm>
#include <cmath>

#include "harness/sampling/test_families.h"
#include "harness/verdict/judge.h"

namespace nullmark {
namespace {

/// What the verdict of a cell can be expected to say, before anything is sampled.
void foresee(const PreparedCell& prepared, const TestLevels& levels, Prediction& prediction) {
  prediction.most = prepared.samples_per_ray;
  if (!why_not_judged(prepared).empty() || tests_nothing(prepared)) {
    prediction.verdict = "not judged";
    return;
  }
  if (prepared.theory.ray_variance.empty()) {
    prediction.verdict = "by a pilot";
    return;
  }
  const TestPlan test_plan = plan_tests(prepared.planned(), *prepared.scene, prepared.targets, prepared.range, prepared.claim,
                                        prepared.theory, std::nullopt, levels);
  prediction.planned = test_plan.planned;
  if (test_plan.planned <= test_plan.affordable)
    prediction.most = std::max(prediction.most, std::min(test_plan.allowance, kMostSampleFactor * test_plan.planned));
  prediction.verdict = prepared.needs_bound && !prepared.scene->bounding ? "VIOLATED"
                       : test_plan.undecidable.empty()                   ? "PASS"
                                                                         : "INCONCLUSIVE";
}

}  // namespace

std::vector<Prediction> predict(const Plan& plan, const std::vector<bool>& selected) {
  CellPreparer preparer(plan);
  std::vector<PreparedCell> cells = prepare_all(preparer, plan, [&](std::size_t i) { return selected[i]; });
  add_theory(cells);
  std::vector<Prediction> result;
  const TestLevels levels{plan.error_rates.alpha_pass, mean_family(plan)};
  for (const PreparedCell& prepared : cells) {
    Prediction prediction;
    prediction.status = prepared.reason.empty() ? "ok" : prepared.reason;
    if (prepared.scene) {
      prediction.rays = prepared.scene->rays->world.size();
      prediction.samples_per_ray = prepared.samples_per_ray;
      prediction.lookups_per_sample = prepared.theory.lookups;
      Real squares = 0;
      for (std::size_t ray = 0; prepared.reason.empty() && ray < prediction.rays; ++ray) {
        const Real truth = prepared.targets.mean[ray * prepared.targets.outputs];
        squares += truth * truth;
      }
      if (!prepared.theory.variance.empty() && prepared.theory.variance[0] && squares > 0)
        prediction.relative_variance = *prepared.theory.variance[0] * static_cast<Real>(prediction.rays) / squares;
    }
    if (prepared.scene && prepared.reason.empty()) foresee(prepared, levels, prediction);
    result.push_back(prediction);
  }
  return result;
}

}  // namespace nullmark
