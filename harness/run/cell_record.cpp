#include "harness/run/cell_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/registry/components.h"
#include "harness/verdict/cell_word.h"
#include "harness/verdict/judge.h"

namespace nullmark {
namespace {

std::optional<Real> finite(Real x) { return std::isfinite(x) ? std::optional(x) : std::nullopt; }

/// See CellRecord::lookups_variance.
std::optional<Real> lookups_variance(const Sampled& sampled, Real samples_per_ray) {
  Real within = 0, squares = 0, lookups = 0;
  for (std::size_t ray = 0; ray < sampled.lookups.size(); ++ray) {
    const auto of_ray = static_cast<Real>(sampled.lookups[ray]);
    within += sampled.lookups_squared[ray] - of_ray * of_ray / samples_per_ray;
    squares += sampled.lookups_squared[ray];
    lookups += of_ray;
  }
  const auto rays = static_cast<Real>(sampled.lookups.size()), all = rays * samples_per_ray;
  if (samples_per_ray > 1) return finite(std::max<Real>(0, within / (rays * (samples_per_ray - 1))));
  if (all > 1) return finite(std::max<Real>(0, (squares - lookups * lookups / all) / (all - 1)));
  return std::nullopt;
}

/// See CellRecord::squared_error_blocks.
std::vector<Real> squared_error_blocks(const Sampled& sampled) {
  std::vector<Real> mean(BlockErrors::kBlocks);
  for (const BlockErrors& output : sampled.blocks)
    for (std::size_t b = 0; b < mean.size(); ++b) {
      if (output.count[b] == 0 || !std::isfinite(output.squares[b])) return {};
      mean[b] += output.squares[b] / static_cast<Real>(output.count[b]) / static_cast<Real>(sampled.blocks.size());
    }
  return mean;
}

/// Sums over the rays, of one output.  Moments are those of sample - reference.
struct Sums {
  Sums(const Sampled& sampled, const Targets& targets, const Measurement& measurement, std::size_t output) {
    const std::size_t count = sampled.moments.size() / targets.outputs;
    rays = static_cast<Real>(count);
    for (std::size_t ray = 0; ray < count; ++ray) {
      const std::size_t at = ray * targets.outputs + output;
      const Moments& moments = sampled.moments[at];
      const Real truth = measured(targets.mean[at], measurement);
      pooled += moments;
      bias += moments.mean();
      squares += moments.mean() * moments.mean();
      variance += moments.variance();
      mean += truth + moments.mean();
      reference += truth;
      reference_square += truth * truth;
      reference_error += targets.error[at];
    }
  }

  Moments pooled;
  Real rays = 0, mean = 0, reference = 0, reference_square = 0, reference_error = 0, bias = 0, squares = 0, variance = 0;
};

ChannelRecord channel_record(const CellRecord& record, const PreparedCell& prepared, const Sums& sums, std::size_t output) {
  const Real rays = sums.rays;
  const auto samples = static_cast<Real>(record.cell.samples_per_ray);
  const auto& theory = prepared.theory;
  ChannelRecord out;
  out.mean = finite(sums.mean / rays);
  if (prepared.targets.known) {
    out.reference = finite(sums.reference / rays);
    out.reference_error = finite(sums.reference_error / rays);
    out.reference_rms = finite(std::sqrt(sums.reference_square / rays));
    out.bias = finite(sums.bias / rays);
    out.rmse = finite(std::sqrt(sums.squares / rays));
  }
  if (record.cell.samples_per_ray > 1) out.variance = finite(sums.variance / rays);
  if (output < theory.variance.size() && theory.variance[output]) {
    out.variance_theory = finite(*theory.variance[output]);
    out.rmse_theory = finite(std::sqrt(*theory.variance[output] / samples + theory.squared_bias[output].value_or(0)));
  }
  if (output < theory.bias.size() && theory.bias[output]) out.bias_theory = finite(*theory.bias[output]);
  const std::optional<Real>& best = best_variance(out);
  if (best && sums.reference_square > 0) out.relative_variance = finite(*best * rays / sums.reference_square);
  const Moments& pooled = sums.pooled;
  if (pooled.s2 > 0) out.kurtosis = finite(static_cast<Real>(pooled.count) * pooled.s4 / (pooled.s2 * pooled.s2));
  return out;
}

void add_convergence(CellRecord& record, const std::vector<GroupErrors::Level>& levels, Real bias, std::size_t output) {
  const auto outputs = static_cast<std::size_t>(outputs_of(record));
  for (std::size_t level = 0; level < levels.size(); ++level) {
    if (level >= record.convergence.size())
      record.convergence.push_back({std::uint64_t{1} << level, std::vector<ConvergenceRecord::Error>(outputs)});
    const Real mean_square = levels[level].sum_of_squares / static_cast<Real>(levels[level].groups);
    record.convergence[level].channel[output] = {finite(std::sqrt(mean_square)),
                                                 finite(std::max<Real>(0, mean_square - bias * bias))};
  }
}

TrackerRecord tracker_record(const TrackerIdentity& identity) {
  return {identity.name, identity.version, hash_text(identity), identity.tells_lookups, !identity.repeatable};
}

}  // namespace

CellRecord blank_record(const Plan& plan, const PreparedCell& prepared) {
  const Cell& cell = *prepared.cell;
  CellRecord record;
  record.cell = cell;
  record.cell.samples_per_ray = prepared.samples_per_ray;
  record.medium = plan.media[cell.medium];
  record.majorant = plan.majorants[cell.majorant];
  record.ray_set = plan.ray_sets[cell.rays];
  const auto* entry = Registry<EstimatorEntry>::instance().find(cell.estimator->type);
  std::shared_ptr<const EstimatorSource> source = prepared.source;
  if (!source && !entry->foreign) source = make_estimator(*cell.estimator);
  if (source) {
    record.claims = to_string(source->claim(cell.quantity));
    record.range = to_string(entry->foreign ? prepared.range : entry->range);
    record.order = source->order(cell.quantity);
    if (const auto identity = source->identity()) record.tracker = tracker_record(*identity);
    if (prepared.subtracted) record.claims = to_string(prepared.claim);
  }
  if (prepared.scene) {
    record.channels = prepared.scene->medium->medium->channels();
    record.rays = prepared.scene->rays->world.size();
    record.structure = prepared.scene->majorant->structure->size();
    record.medium_hash = hash_text(*prepared.scene->medium);
    if (record.channels > 1) record.effects.push_back("chromatic");
    if (cell.quantity == Quantity::radiance) record.effects = prepared.effects;
    if (source && !entry->foreign)
      if (const auto alone = source->kernel(record.channels, cell.precision)) record.given_depth = alone->needs_optical_depth();
    record.in_lanes = prepared.kernel && prepared.kernel->in_lanes(cell.quantity);
    if (!prepared.takes_part) record.reason = "constant extinction: closed-form flights, the estimator takes no part";
  }
  return record;
}

void fill_statistics(CellRecord& record, const PreparedCell& prepared, const Sampled& sampled) {
  const Cell& cell = *prepared.cell;
  const auto samples = static_cast<Real>(record.cell.samples_per_ray);
  const Targets& targets = prepared.targets;
  record.outputs = targets.names;
  record.samples = sampled.counters.samples;
  record.lookups = sampled.counters.lookups;
  record.draws = sampled.counters.draws;
  const auto total = static_cast<Real>(sampled.counters.samples);
  record.lookups_per_sample = static_cast<Real>(record.lookups) / total;
  record.draws_per_sample = static_cast<Real>(record.draws) / total;
  record.null_collisions_per_sample = static_cast<Real>(sampled.counters.null_collisions) / total;
  record.lookups_theory = prepared.theory.lookups;
  record.lookups_variance = lookups_variance(sampled, samples);
  record.majorant_violations = sampled.counters.violations;
  if (sampled.counters.violations > 0) record.largest_violation = finite(sampled.counters.largest_violation);
  record.largest_sample = finite(sampled.largest);
  record.nonfinite = sampled.nonfinite;
  record.reference_method = targets.method + (cell.measurement == Measurement{} ? "" : ", measured");
  record.status = Status::ok;
  if (sampled.nonfinite > 0) {
    record.status = Status::error;
    record.reason =
        fmt::format("{} of {} samples are not finite; `replay` shows the first", sampled.nonfinite, sampled.counters.samples);
  }
  record.variance_basis = "sample";
  if (targets.known && targets.names.empty()) record.squared_error_blocks = squared_error_blocks(sampled);
  for (std::size_t o = 0; o < targets.outputs; ++o) {
    const Sums sums(sampled, targets, cell.measurement, o);
    record.channel.push_back(channel_record(record, prepared, sums, o));
    if (o < prepared.theory.variance.size() && prepared.theory.variance[o]) record.variance_basis = "analytic";
    add_convergence(record, sampled.groups[o].levels(), sums.bias / sums.rays, o);
  }
}

void drop_sampled_statistics(CellRecord& record) {
  for (ChannelRecord& channel : record.channel) {
    for (std::optional<Real> ChannelRecord::*figure :
         {&ChannelRecord::mean, &ChannelRecord::bias, &ChannelRecord::rmse, &ChannelRecord::variance, &ChannelRecord::kurtosis})
      (channel.*figure).reset();
    if (!channel.variance_theory) channel.relative_variance.reset();
  }
  if (record.variance_basis == "sample") record.variance_basis.clear();
  record.convergence.clear();
  record.squared_error_blocks.clear();
}

void add_verdict(CellRecord& record, const PreparedCell& prepared, const std::optional<VerdictRecord>& verdict) {
  record.verdict = verdict;
  if (verdict && tests_nothing(prepared) && kind_of(record) != Kind::fail) {
    record.verdict.reset();
    const auto& [lo, hi] = prepared.scene->medium->world_bounds;
    record.reason = fmt::format(
        "no ray meets any extinction: nothing was tested; the medium's bounds are [{:.6g}, {:.6g}, {:.6g}] to [{:.6g}, {:.6g}, "
        "{:.6g}]",
        lo.x(), lo.y(), lo.z(), hi.x(), hi.y(), hi.z());
  }
  if (!verdict && record.reason.empty()) record.reason = why_not_judged(prepared);
}

}  // namespace nullmark
