#include "harness/run/predict.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "harness/registry/components.h"
#include "harness/run/cpu_clock.h"
#include "harness/run/demand.h"
#include "harness/sampling/cell_theory.h"
#include "harness/sampling/test_families.h"
#include "harness/verdict/judge.h"

namespace nullmark {
namespace {

constexpr std::size_t kMostCells = 200, kMostRays = 256;

/// Indices of the selected cells, or of so many of them, evenly from all trackers.
std::vector<std::size_t> chosen_cells(const Plan& plan, const std::vector<bool>& selected) {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < plan.cells.size(); ++i)
    if (selected[i]) all.push_back(i);
  if (all.size() <= kMostCells) return all;
  std::stable_sort(all.begin(), all.end(),
                   [&](std::size_t a, std::size_t b) { return plan.cells[a].estimator->type < plan.cells[b].estimator->type; });
  std::vector<std::size_t> some;
  for (std::size_t k = 0; k < kMostCells; ++k) some.push_back(all[(2 * k + 1) * all.size() / (2 * kMostCells)]);
  std::sort(some.begin(), some.end());
  return some;
}

/// CPU seconds of a span of samples and of one more sample of each ray, measured by spans of two lengths, of which the longer
/// takes kLong more.  The calling thread draws them alone.
struct SpanCost {
  double span = 0, each = 0;
};

SpanCost span_cost(const PreparedCell& prepared, const TestPlan* plan, std::uint64_t most) {
  constexpr double kLong = 5e-4;
  const auto measured = [&](std::uint64_t per_ray) {
    const double began = thread_cpu_seconds();
    sample_cell(
        prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets, {.per_ray = per_ray}, plan, [] { return false; },
        [](double) {});
    return thread_cpu_seconds() - began;
  };
  const std::uint64_t least = plan ? plan->longest_sum : 1;
  if (2 * least > most) return {0, measured(least) / static_cast<double>(least)};
  // The first span of a cell fetches its memory.
  measured(least);
  const double took_least = measured(least);
  std::uint64_t count = 2 * least;
  double took = measured(count);
  while (took - took_least < kLong && 2 * count <= most) took = measured(count *= 2);
  const double each = std::max(0., took - took_least) / static_cast<double>(count - least);
  return {std::max(0., took_least - each * static_cast<double>(least)), each};
}

/// Verdict, samples and CPU seconds but for those of preparation and theory.
void predict(const PreparedCell& prepared, const TestLevels& levels, double rays_for_each, Prediction& prediction) {
  const Demand demand(prepared, levels, rays_for_each);
  const TestPlan* const tests = demand.tests ? &*demand.tests : nullptr;
  if (!tests)
    prediction.verdict = "not judged";
  else if (prepared.needs_bound && !prepared.scene->bounding)
    prediction.verdict = "VIOLATED";
  else if (tests->undecidable.empty())
    prediction.verdict = "PASS";
  else
    // This pilot is too small to be trusted; the pilot of the run is larger.
    prediction.verdict =
        demand.pilot > 0 && tests->planned <= std::max(demand.cell.samples_per_ray, demand.cell.verdict.max_samples_per_ray)
            ? "open"
            : "INCONCLUSIVE";
  if (tests) prediction.planned = static_cast<std::uint64_t>(std::ceil(static_cast<double>(tests->planned) / rays_for_each));
  const double samples = demand.samples + demand.pilot + demand.laws;
  const SpanCost cost = span_cost(demand.whole, tests, demand.whole.samples_per_ray);
  prediction.seconds = cost.span + cost.each * samples;
}

}  // namespace

Forecast forecast(const Plan& plan, const std::vector<bool>& selected) {
  Forecast result;
  result.selected = static_cast<std::size_t>(std::count(selected.begin(), selected.end(), true));
  std::vector<bool> chosen(plan.cells.size(), false);
  for (const std::size_t i : chosen_cells(plan, selected)) chosen[i] = true;
  CellPreparer preparer(plan, kMostRays);
  const double began = cpu_seconds();
  std::vector<PreparedCell> cells = prepare_all(preparer, plan, [&](std::size_t i) { return chosen[i]; });
  const double prepared_at = cpu_seconds();
  add_theory(cells);
  // Per cell.  A medium is loaded once for all rays; theory is computed for each.
  const double share = 1 / static_cast<double>(std::max<std::size_t>(1, cells.size()));
  const double preparation = (prepared_at - began) * share, theory = (cpu_seconds() - prepared_at) * share;
  const TestLevels levels{plan.error_rates.alpha_pass, mean_family(plan)};
  result.cells.resize(cells.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t i) {
    const PreparedCell& prepared = cells[i];
    Prediction& prediction = result.cells[i];
    prediction.cell = prepared.index;
    prediction.status = prepared.reason.empty() ? "ok" : prepared.reason;
    if (prepared.scene) {
      const std::size_t rays = prepared.scene->rays->world.size();
      prediction.rays = make_ray_set(*plan.ray_sets[prepared.cell->rays])->count();
      prediction.samples_per_ray = prepared.samples_per_ray;
      prediction.lookups_per_sample = prepared.theory.lookups;
      const double rays_for_each = static_cast<double>(prediction.rays) / static_cast<double>(std::max<std::size_t>(1, rays));
      Real squares = 0;
      for (std::size_t ray = 0; prepared.reason.empty() && ray < rays; ++ray) {
        const Real truth = prepared.targets.mean[ray * prepared.targets.outputs];
        squares += truth * truth;
      }
      if (!prepared.theory.variance.empty() && prepared.theory.variance[0] && squares > 0)
        prediction.relative_variance = *prepared.theory.variance[0] * static_cast<Real>(rays) / squares;
      // Threads that only wait for work would be charged to the cell.
      tbb::task_arena alone(1);
      if (prepared.reason.empty()) alone.execute([&] { predict(prepared, levels, rays_for_each, prediction); });
      prediction.seconds += preparation + theory * rays_for_each;
    }
  });
  // Each repetition times every number of samples that share a traversal, and one alone.
  const std::vector<std::uint64_t>& shared = plan.timing.samples_per_traversal;
  const std::size_t numbers = shared.size() + (std::find(shared.begin(), shared.end(), 1) == shared.end() ? 1 : 0);
  if (plan.timing.enabled)
    result.timing_seconds = static_cast<double>(result.selected * numbers) * plan.timing.repetitions * plan.timing.seconds;
  return result;
}

}  // namespace nullmark
