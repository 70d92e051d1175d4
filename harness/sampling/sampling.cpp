#include "harness/sampling/sampling.h"

#include <algorithm>
#include <cmath>

namespace nullmark {

Real measured(Real value, const Measurement& measurement) {
  if (measurement.clamp) value = std::min<Real>(1, std::max<Real>(0, value));
  if (measurement.quantise_bits > 0) {
    const Real steps = std::ldexp(1., measurement.quantise_bits) - 1;
    value = std::round(steps * value) / steps;
  }
  return value;
}

namespace {

/// Adds the rays of a portion, and what does not depend on rays.
void add_portion(const Portion& part, std::size_t outputs, Sampled& result) {
  for (std::size_t ray = part.first_ray; ray < part.end_ray; ++ray) {
    const std::size_t local = ray - part.first_ray;
    for (std::size_t o = 0; o < outputs; ++o) result.moments[ray * outputs + o] += part.moments[local * outputs + o];
    result.lookups[ray] += part.lookups[local];
    result.null_collisions[ray] += part.null_collisions[local];
    result.lookups_squared[ray] += part.lookups_squared[local];
  }
  add_what_rays_share(part, result);
}

/// Groups of samples that are larger than a chunk, within one ray.
void add_groups_across(const SpanCut& cut, const Portions& portions, Sampled& result) {
  const auto level = static_cast<std::size_t>(cut.level());
  std::vector<GroupErrors> across(result.groups.size());
  for (const auto& [number, portion] : portions) {
    const Real* sum = portion.chunk_sums.data();
    const auto [first, end] = cut.chunks_of(number);
    for (std::size_t at = first; at < end; ++at)
      for (GroupErrors& of_output : across) {
        if (cut.chunks()[at].first == 0) of_output.finish_ray();
        if (cut.chunks()[at].count == std::uint64_t{1} << level) of_output.carry(level, *sum);
        ++sum;
      }
  }
  // A chunk's own groups already hold the level at which the chunks begin.
  for (std::size_t o = 0; o < across.size(); ++o) result.groups[o].append_above(level, across[o]);
}

/// The kept samples of a span from those of its portions.
KeptSamples kept_of(const SpanCut& cut, const Portions& portions, KeptSamples kept) {
  std::vector<std::size_t> taken(cut.portions(), 0);
  for (std::size_t i = 0; i < kept.count(); ++i) {
    const KeptSamples::Sample sample = kept.at(i);
    const std::size_t number = cut.portion_of(sample.ray, sample.number), outputs = sample.values.size();
    kept.set(i, std::span(portions.at(number).kept).subspan(taken[number], outputs));
    taken[number] += outputs;
  }
  return kept;
}

}  // namespace

Sampled fold(const Portions& portions, std::size_t rays, std::size_t outputs, const SampleSpan& span, const TestPlan* plan) {
  const SpanCut cut(rays, span);
  Sampled result;
  result.moments.resize(rays * outputs);
  result.lookups.resize(rays);
  result.null_collisions.resize(rays);
  result.blocks.resize(outputs);
  result.lookups_squared.resize(rays);
  result.groups.resize(outputs);
  if (plan) result.evidence.resize(plan->tests.size());
  if (plan) result.variances.resize(plan->variances.size());
  for (const auto& [number, portion] : portions) add_portion(portion, outputs, result);
  if (cut.splits_rays() && !span.only_evidence) add_groups_across(cut, portions, result);
  if (span.keep) result.kept = kept_of(cut, portions, KeptSamples(rays, span.first, span.per_ray, outputs));
  return result;
}

std::optional<Sampled> sample_cell(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets,
                                   SampleSpan span, const TestPlan* plan, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress) {
  const auto portions = draw_portions(
      cell, scene, kernel, targets, span, plan, [](std::size_t) { return true; }, stop, progress);
  if (!portions) return std::nullopt;
  return fold(*portions, scene.rays->local.size(), targets.outputs, span, plan);
}

}  // namespace nullmark
