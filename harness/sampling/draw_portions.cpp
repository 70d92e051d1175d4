#include "harness/sampling/draw_portions.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>

#include "harness/model/in_flight.h"
#include "harness/sampling/sampling.h"
#include "harness/statistics/double8.h"

namespace nullmark {
namespace {

using Clock = std::chrono::steady_clock;

double seconds(Clock::duration time) { return std::chrono::duration<double>(time).count(); }

/// Samples that a kernel is asked for at once.
constexpr std::uint64_t kBatch = std::uint64_t{1} << 14;

/// The threads' private memory.
struct Scratch {
  std::unique_ptr<Workspace> workspace;
  PreparedRay context;
  SampleBlock block;
  std::vector<Real> errors, finite;
};

/// Rounding allowed to samples at the ends of their declared range.
constexpr Real kRangeSlack = 1e-9, kSingleRangeSlack = 1e-5;

/// errors = values - reference; whether all values lie in [low, high], which none does that is not finite; then `largest` has
/// grown to the largest of their magnitudes.
bool subtract(const Real* values, Real reference, Real low, Real high, std::span<Real> errors, Real& largest) {
  Eight lowest = kInfinity, highest = -kInfinity, nothing = 0;
  std::size_t i = 0;
  for (; i + Eight::kCount <= errors.size(); i += Eight::kCount) {
    const Eight value = Eight::load(values + i);
    lowest = smaller(value, lowest);
    highest = larger(value, highest);
    nothing += value - value;  // of a number that is not finite it is none
    (value - reference).store(&errors[i]);
  }
  bool all = least(lowest) >= low && most(highest) <= high && total(nothing) == 0;
  Real farthest = std::max({largest, most(highest), -least(lowest)});
  for (; i < errors.size(); ++i) {
    all &= values[i] >= low && values[i] <= high;
    errors[i] = values[i] - reference;
    farthest = std::max(farthest, std::abs(values[i]));
  }
  if (all) largest = farthest;
  return all;
}

Real sum_of_squares(std::span<const std::uint32_t> counts) {
  Eight sum = 0;
  std::size_t i = 0;
  for (; i + Eight::kCount <= counts.size(); i += Eight::kCount) {
    const Eight count = Eight::load(&counts[i]);
    sum += count * count;
  }
  Real result = total(sum);
  for (; i < counts.size(); ++i) result += static_cast<Real>(counts[i]) * counts[i];
  return result;
}

using Errors = std::span<Real>;

/// What all chunks of a cell share.
class ChunkSampler {
 public:
  ChunkSampler(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets, const SampleSpan& span,
               const TestPlan* plan, KeptSamples& kept)
      : cell_(cell),
        scene_(scene),
        kernel_(kernel),
        targets_(targets),
        span_(span),
        plan_(plan),
        kept_(kept),
        key_(stream_key(cell, *scene.medium)),
        as_drawn_(cell.measurement == Measurement{}),
        varies_(plan && !plan->variances.empty() && !span.only_evidence) {
    constexpr Real kLargest = std::numeric_limits<Real>::max();
    const Real slack = cell.precision == Precision::float64 ? kRangeSlack : kSingleRangeSlack;
    low_ = plan ? std::max(plan->low - slack, -kLargest) : -kLargest;
    high_ = plan ? std::min(plan->high + slack, kLargest) : kLargest;
  }

  /// Draws a chunk; in the middle of it where `stop` says so.
  void sample(const Chunk& chunk, Scratch& mine, Portion& out, const std::function<bool()>& stop) const {
    const std::size_t rays = chunk.end_ray - chunk.first_ray, outputs = targets_.outputs;
    out.first_ray = chunk.first_ray;
    out.end_ray = chunk.end_ray;
    out.moments.resize(rays * outputs);
    out.lookups.resize(rays);
    out.lookups_squared.resize(rays);
    out.null_collisions.resize(rays);
    out.groups.resize(outputs);
    out.blocks.resize(outputs);
    out.chunk_sums.assign(outputs, 0);
    const auto begun = Clock::now();
    const std::span<const MeanTest> tests = plan_ ? plan_->tests : std::span<const MeanTest>();
    EvidenceAccumulator evidences(plan_, tests, outputs, EvidenceAccumulator::Memory::of_this_thread(), out.evidence);
    EvidenceAccumulator variances(plan_, varies_ ? plan_->variances : std::span<const MeanTest>(), outputs,
                                  EvidenceAccumulator::Memory::of_variances(), out.variances);
    for (std::size_t ray = chunk.first_ray; ray < chunk.end_ray; ++ray)
      sample_ray(chunk, ray, mine, out, evidences, variances, stop);
    const auto drawn_at = Clock::now();
    evidences.finish();
    variances.finish();
    const auto judged_at = Clock::now();
    out.statistics_seconds += seconds(judged_at - drawn_at);
    out.judging_seconds += seconds(judged_at - drawn_at);
    out.working_seconds += seconds(judged_at - begun);
  }

 private:
  void sample_ray(const Chunk& chunk, std::size_t ray, Scratch& mine, Portion& out, EvidenceAccumulator& evidences,
                  EvidenceAccumulator& variances, const std::function<bool()>& stop) const {
    const Medium& medium = *scene_.medium->medium;
    const std::size_t local = ray - chunk.first_ray, outputs = targets_.outputs;
    scene_.context(ray, kernel_, mine.context);
    kernel_.begin_ray(*mine.workspace, medium, scene_.medium->extrema, mine.context);
    const std::uint64_t lookups_before = out.counters.lookups, null_collisions_before = out.counters.null_collisions;
    for (std::uint64_t drawn = 0; drawn < chunk.count; drawn += kBatch) {
      if (drawn > 0 && stop()) return;
      const std::uint64_t first = span_.first + chunk.first + drawn, batch = std::min(kBatch, chunk.count - drawn);
      kernel_.sample(*mine.workspace, medium, mine.context, key_, first, batch, cell_.quantity, mine.block, out.counters);
      const auto drawn_at = Clock::now();
      if (span_.keep) kept_.keep(ray, first, batch, mine.block.values);
      take_moments(ray, local, batch, mine, out);
      const auto counted_at = Clock::now();
      take_evidence(ray, batch, mine, evidences, variances);
      const auto judged_at = Clock::now();
      out.statistics_seconds += seconds(judged_at - drawn_at);
      out.judging_seconds += seconds(judged_at - counted_at);
    }
    out.lookups[local] = out.counters.lookups - lookups_before;
    out.null_collisions[local] = out.counters.null_collisions - null_collisions_before;
    for (std::size_t o = 0; o < outputs; ++o) {
      out.chunk_sums[o] = out.moments[local * outputs + o].s1;
      out.groups[o].finish_ray();
    }
  }

  void take_moments(std::size_t ray, std::size_t local, std::uint64_t batch, Scratch& mine, Portion& out) const {
    const std::size_t outputs = targets_.outputs;
    mine.errors.resize(batch * outputs);
    for (std::size_t o = 0; o < outputs; ++o) {
      const std::span<const Real> counted =
          take_errors(mine, o, targets_.mean[ray * outputs + o], errors_of(mine, o, batch), out);
      if (span_.only_evidence) continue;
      out.blocks[o].add(ray, counted, out.moments[local * outputs + o]);
      out.groups[o].add(counted);
    }
    if (!span_.only_evidence) out.lookups_squared[local] += sum_of_squares(mine.block.lookups);
  }

  void take_evidence(std::size_t ray, std::uint64_t batch, Scratch& mine, EvidenceAccumulator& evidences,
                     EvidenceAccumulator& variances) const {
    const std::size_t outputs = targets_.outputs;
    for (std::size_t o = 0; o < outputs && plan_; ++o) {
      const Errors errors = errors_of(mine, o, batch);
      if (const Real shift = plan_->shift[ray * outputs + o]; shift != 0)
        for (Real& error : errors) error -= shift;
      evidences.add_errors(ray, o, errors);
      if (!varies_) continue;
      for (Real& error : errors) error = error * error - plan_->stated_variance[ray * outputs + o];
      variances.add_errors(ray, o, errors);
    }
    evidences.add_lookups(ray, mine.block.lookups);
  }

  static Errors errors_of(Scratch& mine, std::size_t o, std::uint64_t batch) { return {&mine.errors[o * batch], batch}; }

  /// Fills `errors` of an output, 0 for samples that are not finite, and returns those that count.
  std::span<const Real> take_errors(Scratch& mine, std::size_t o, Real target, Errors errors, Portion& out) const {
    const std::size_t outputs = targets_.outputs;
    const std::vector<Real>& values = mine.block.values;
    const Real reference = measured(target, cell_.measurement);
    if (as_drawn_) {
      const Real* drawn = values.data();
      if (outputs > 1) {
        mine.finite.resize(errors.size());
        for (std::size_t i = 0; i < errors.size(); ++i) mine.finite[i] = values[i * outputs + o];
        drawn = mine.finite.data();
      }
      if (subtract(drawn, reference, low_, high_, errors, out.largest)) return errors;
    }
    mine.finite.clear();
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const Real value = values[i * outputs + o];
      errors[i] = 0;
      if (!std::isfinite(value)) {
        ++out.nonfinite;
        continue;
      }
      out.out_of_range += !(value >= low_ && value <= high_);
      out.largest = std::max(out.largest, std::abs(value));
      errors[i] = measured(value, cell_.measurement) - reference;
      mine.finite.push_back(errors[i]);
    }
    return mine.finite;
  }

  const Cell& cell_;
  const Scene& scene_;
  const Kernel& kernel_;
  const Targets& targets_;
  const SampleSpan& span_;
  const TestPlan* plan_;
  KeptSamples& kept_;
  std::uint64_t key_;
  bool as_drawn_, varies_;
  Real low_, high_;  ///< the range that the estimator declares, with slack
};

/// Moves the chunks' results into those of their portions, in order.
Portions joined(const SpanCut& cut, const std::vector<std::size_t>& drawn, std::vector<Portion>& parts) {
  Portions portions;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const auto [at, fresh] = portions.try_emplace(cut.portion_of_chunk(drawn[i]));
    if (fresh)
      at->second = std::move(parts[i]);
    else
      at->second.append(parts[i]);
    parts[i] = {};
  }
  return portions;
}

}  // namespace

std::optional<Portions> draw_portions(const Cell& cell, const Scene& scene, const Kernel& kernel, const Targets& targets,
                                      const SampleSpan& span, const TestPlan* plan,
                                      const std::function<bool(std::size_t)>& wanted, const std::function<bool()>& stop,
                                      const std::function<void(double)>& progress) {
  const std::size_t rays = scene.rays->local.size(), outputs = targets.outputs;
  const SpanCut cut(rays, span);
  std::vector<std::size_t> drawn;  // chunks
  for (std::size_t at = 0; at < cut.chunks().size(); ++at)
    if (wanted(cut.portion_of_chunk(at))) drawn.push_back(at);

  KeptSamples kept;
  if (span.keep) kept = KeptSamples(rays, span.first, span.per_ray, outputs);
  std::vector<Portion> parts(drawn.size());
  std::atomic<bool> stopped = false;
  const std::function<bool()> stops = [&] {
    if (!stopped && stop()) stopped = true;
    return stopped.load();
  };
  tbb::enumerable_thread_specific<Scratch> scratch([&] {
    Scratch fresh;
    fresh.workspace = kernel.workspace();
    fresh.workspace->stop = stops;
    return fresh;
  });
  const ChunkSampler sampler(cell, scene, kernel, targets, span, plan, kept);
  std::atomic<std::size_t> done = 0;
  const auto draw = [&](std::size_t i) {
    if (stops()) return;
    const InFlight named(cell.name);
    sampler.sample(cut.chunks()[drawn[i]], scratch.local(), parts[i], stops);
    progress(static_cast<double>(++done) / static_cast<double>(drawn.size()));
  };
  // The kept samples begin with the first of the cell.  A tracker that learns from samples is found out by them only if no others
  // were drawn before.
  const std::size_t alone = span.keep && !drawn.empty() ? 1 : 0;
  if (alone > 0) draw(0);
  tbb::parallel_for(alone, drawn.size(), draw);
  if (stopped) return std::nullopt;

  Portions portions = joined(cut, drawn, parts);
  for (std::size_t i = 0; i < kept.count(); ++i) {
    const KeptSamples::Sample sample = kept.at(i);
    if (const auto at = portions.find(cut.portion_of(sample.ray, sample.number)); at != portions.end())
      at->second.kept.insert(at->second.kept.end(), sample.values.begin(), sample.values.end());
  }
  return portions;
}

}  // namespace nullmark
