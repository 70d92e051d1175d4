#include "harness/run/demand.h"

#include <algorithm>

#include "harness/verdict/walk_laws.h"

namespace nullmark {
namespace {

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

/// Lookups of a sample; as counted where theory does not state them.
double lookups_of_a_sample(const PreparedCell& prepared, const Counters& probe) {
  const double counted = static_cast<double>(probe.lookups) / static_cast<double>(std::max<std::uint64_t>(1, probe.samples));
  return prepared.theory.lookups.value_or(counted);
}

/// Samples of each ray that cost as much as the laws of walks, which record what they draw.
double samples_of_laws(const PreparedCell& prepared, const TestPlan& plan, const Counters& probe) {
  constexpr double kRecording = 3;
  const LawPolicy policy = prepared.cell->verdict.laws;
  if (policy == LawPolicy::never || (policy == LawPolicy::undecided && plan.undecidable.empty()) || plan.against != "reference")
    return 0;
  const auto rays = static_cast<double>(prepared.scene->rays->world.size());
  const double affordable = LawBudget{}.lookups / std::max(1., lookups_of_a_sample(prepared, probe)) / rays;
  return kRecording * std::min(affordable, static_cast<double>(LawBudget{}.most_per_ray));
}

/// Counts of a few samples of every ray.
Counters few_samples(const PreparedCell& prepared) {
  constexpr std::uint64_t kSamples = 256, kLeast = 2;
  const std::uint64_t per_ray = std::max(kLeast, kSamples / std::max<std::uint64_t>(1, prepared.scene->rays->world.size()));
  const auto sampled = sample_cell(
      prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets,
      {.per_ray = std::min(per_ray, prepared.samples_per_ray), .only_evidence = true}, nullptr, [] { return false; },
      [](double) {});
  return sampled->counters;
}

/// The tests of a cell whose variance theory does not state, from a pilot smaller than the run's.
std::optional<TestPlan> tests_by_pilot(const PreparedCell& prepared, const TestLevels& levels, const Counters& probe) {
  constexpr std::uint64_t kSamples = 4096, kLeast = 16, kLookups = 1 << 20;
  PreparedCell small = prepared;
  const std::uint64_t rays = std::max<std::uint64_t>(1, prepared.scene->rays->world.size());
  const std::uint64_t each = probe.lookups / std::max<std::uint64_t>(1, probe.samples) + 1;
  const std::uint64_t samples = std::min(kSamples, kLookups / each);
  small.samples_per_ray = std::min(prepared.samples_per_ray, std::max(kLeast, samples / rays));
  return tests_of(small, levels, draw_pilot(small, [] { return false; }));
}

}  // namespace

Demand::Demand(const PreparedCell& prepared, const TestLevels& levels, double rays_for_each)
    : cell(concentrated(prepared, rays_for_each)), whole(prepared) {
  whole.cell = &cell;
  whole.samples_per_ray = cell.samples_per_ray;
  probe = few_samples(whole);
  const bool drawn = prepared.theory.ray_variance.empty() && prepared.claim != Guarantee::exact;
  if (why_not_judged(prepared).empty() && !tests_nothing(prepared))
    tests = drawn ? tests_by_pilot(whole, levels, probe)
                  : plan_tests(cell, *prepared.scene, prepared.targets, prepared.range, prepared.claim, prepared.theory,
                               std::nullopt, levels);
  samples = static_cast<double>(tests ? expected_samples(whole, *tests) : whole.samples_per_ray);
  if (!tests) return;
  if (drawn) pilot = static_cast<double>(whole.samples_per_ray);
  laws = samples_of_laws(whole, *tests, probe);
}

}  // namespace nullmark
