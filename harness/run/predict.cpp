#include "harness/run/predict.h"

#include <algorithm>
#include <cmath>

#include "harness/registry/components.h"
#include "harness/run/cpu_clock.h"
#include "harness/sampling/test_families.h"
#include "harness/verdict/judge.h"
#include "harness/verdict/walk_laws.h"

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
                   [&](std::size_t a, std::size_t b) { return plan.cells[a].estimator.type < plan.cells[b].estimator.type; });
  std::vector<std::size_t> some;
  for (std::size_t k = 0; k < kMostCells; ++k) some.push_back(all[(2 * k + 1) * all.size() / (2 * kMostCells)]);
  std::sort(some.begin(), some.end());
  return some;
}

/// The cell with as many samples in total, on the rays that stand for all.
Cell concentrated(const PreparedCell& prepared, double rays_for_each) {
  Cell cell = prepared.planned();
  const auto more = [&](std::uint64_t samples) {
    return static_cast<std::uint64_t>(std::min(9e15, static_cast<double>(samples) * rays_for_each));
  };
  cell.samples_per_ray = more(cell.samples_per_ray);
  cell.verdict.max_samples_per_ray = more(cell.verdict.max_samples_per_ray);
  if (cell.verdict.max_lookups_per_ray) *cell.verdict.max_lookups_per_ray *= rays_for_each;
  return cell;
}

/// CPU seconds of a span of samples and of one more sample of each ray, measured by spans of two lengths.
struct SpanCost {
  double span = 0, each = 0;
};

SpanCost span_cost(const PreparedCell& prepared, const TestPlan* plan, std::uint64_t most) {
  constexpr double kLong = 1e-3;
  const auto measured = [&](std::uint64_t per_ray) {
    const double began = cpu_seconds();
    sample_cell(
        prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets, {.per_ray = per_ray}, plan, [] { return false; },
        [](double) {});
    return cpu_seconds() - began;
  };
  std::uint64_t before = 0, count = plan ? plan->longest_sum : 1;
  double took_before = 0, took = measured(count);
  while (took < kLong && 2 * count <= most) {
    before = count;
    took_before = took;
    took = measured(count *= 2);
  }
  const double each = std::max(0., took - took_before) / static_cast<double>(count - before);
  return {std::max(0., took - each * static_cast<double>(count)), each};
}

/// Samples of each ray that cost as much as the laws of walks, which record what they draw.
double samples_of_laws(const PreparedCell& prepared, const TestPlan& plan) {
  constexpr double kRecording = 3;
  const LawPolicy policy = prepared.cell->verdict.laws;
  if (policy == LawPolicy::never || (policy == LawPolicy::undecided && plan.undecidable.empty()) || plan.against != "reference")
    return 0;
  const auto rays = static_cast<double>(prepared.scene->rays->world.size());
  const double affordable = LawBudget{}.lookups / std::max(1., prepared.theory.lookups.value_or(1)) / rays;
  return kRecording * std::min(affordable, static_cast<double>(LawBudget{}.most_per_ray));
}

/// The tests of a cell whose variance theory does not state, from a pilot smaller than the run's.
std::optional<TestPlan> tests_by_pilot(const PreparedCell& prepared, const TestLevels& levels) {
  constexpr std::uint64_t kSamples = 8192, kLeast = 16;
  PreparedCell small = prepared;
  const std::uint64_t rays = std::max<std::uint64_t>(1, prepared.scene->rays->world.size());
  small.samples_per_ray = std::min(prepared.samples_per_ray, std::max(kLeast, kSamples / rays));
  return tests_of(small, levels, draw_pilot(small, [] { return false; }));
}

void predict(const PreparedCell& prepared, const TestLevels& levels, double rays_for_each, Prediction& prediction) {
  PreparedCell whole = prepared;
  const Cell cell = concentrated(prepared, rays_for_each);
  whole.cell = &cell;
  whole.samples_per_ray = cell.samples_per_ray;
  const bool pilot = prepared.theory.ray_variance.empty() && prepared.claim != Guarantee::exact;
  std::optional<TestPlan> plan;
  if (why_not_judged(prepared).empty() && !tests_nothing(prepared))
    plan = pilot ? tests_by_pilot(whole, levels)
                 : plan_tests(cell, *prepared.scene, prepared.targets, prepared.range, prepared.claim, prepared.theory,
                              std::nullopt, levels);
  const TestPlan* const tests = plan ? &*plan : nullptr;
  if (!tests)
    prediction.verdict = "not judged";
  else if (prepared.needs_bound && !prepared.scene->bounding)
    prediction.verdict = "VIOLATED";
  else
    prediction.verdict = tests->undecidable.empty() ? "PASS" : "INCONCLUSIVE";
  if (tests) prediction.planned = static_cast<std::uint64_t>(std::ceil(static_cast<double>(tests->planned) / rays_for_each));
  auto samples = static_cast<double>(tests ? expected_samples(whole, *tests) : whole.samples_per_ray);
  if (pilot && tests) samples += static_cast<double>(whole.samples_per_ray);
  if (tests) samples += samples_of_laws(whole, *tests);
  const SpanCost cost = span_cost(whole, tests, whole.samples_per_ray);
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
  add_theory(cells);
  const double theory = cells.empty() ? 0 : (cpu_seconds() - began) / static_cast<double>(cells.size());
  const TestLevels levels{plan.error_rates.alpha_pass, mean_family(plan)};
  for (const PreparedCell& prepared : cells) {
    Prediction prediction;
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
      if (prepared.reason.empty()) predict(prepared, levels, rays_for_each, prediction);
      prediction.seconds += theory * rays_for_each;
    }
    result.cells.push_back(prediction);
  }
  // Each repetition times every number of samples that share a traversal, and one alone.
  const std::vector<std::uint64_t>& shared = plan.timing.samples_per_traversal;
  const std::size_t numbers = shared.size() + (std::find(shared.begin(), shared.end(), 1) == shared.end() ? 1 : 0);
  if (plan.timing.enabled)
    result.timing_seconds = static_cast<double>(result.selected * numbers) * plan.timing.repetitions * plan.timing.seconds;
  return result;
}

}  // namespace nullmark
