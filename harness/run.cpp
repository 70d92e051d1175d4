#include "harness/run.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_for_each.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "harness/background.h"
#include "harness/counted_lookups.h"
#include "harness/free_path_law.h"
#include "harness/image.h"
#include "harness/laws.h"
#include "harness/metrics.h"
#include "harness/names.h"
#include "harness/parameter_values.h"
#include "harness/ray_memory.h"
#include "harness/reliance.h"
#include "harness/timing.h"
#include "harness/verdict.h"
#include "harness/words.h"
#include "harness/workshop.h"

namespace nullmark {
namespace {

/// Theory of all runnable cells, scene by scene; a measurement stage changes the law of the samples, so those cells have none.
/// Where samples are planned by lookups, their number follows from it.
void add_theory(std::vector<PreparedCell>& cells) {
  std::map<const Scene*, std::vector<PreparedCell*>> by_scene;
  for (PreparedCell& prepared : cells) {
    const bool plain = prepared.cell->measurement == Measurement{};
    if (prepared.reason.empty() && plain && prepared.kernel->states_theory()) by_scene[prepared.scene.get()].push_back(&prepared);
  }
  tbb::parallel_for_each(by_scene.begin(), by_scene.end(), [](auto& entry) {
    auto& [scene, members] = entry;
    std::vector<TheoryQuery> queries;
    for (const PreparedCell* member : members)
      queries.push_back({member->kernel.get(), member->cell->quantity, member->range, &member->targets});
    const std::vector<CellTheory> theory = compute_theory(*scene, queries);
    for (std::size_t i = 0; i < members.size(); ++i) members[i]->theory = theory[i];
  });
  for (PreparedCell& prepared : cells) {
    if (!prepared.cell->equal_lookups || !prepared.reason.empty()) continue;
    if (!prepared.theory.lookups || !(*prepared.theory.lookups > 0))
      prepared.reason = "equal_lookups needs an estimator and medium with known expected lookups above 0";
    else
      prepared.samples_per_ray = std::max<std::uint64_t>(
          1, static_cast<std::uint64_t>(std::llround(*prepared.cell->equal_lookups / *prepared.theory.lookups)));
  }
}

/// What verdicts and all statistics cost beside the sampling they are of, and the walks that did not end.
struct Effort {
  double judging = 0, statistics = 0, working = 0;
  std::uint64_t overruns = 0;
  Effort& operator+=(const Sampled& sampled) {
    overruns += sampled.counters.overruns;
    judging += sampled.judging_seconds;
    statistics += sampled.statistics_seconds;
    working += sampled.working_seconds;
    return *this;
  }
  Effort& operator+=(const Effort& other) {
    overruns += other.overruns;
    judging += other.judging;
    statistics += other.statistics;
    working += other.working;
    return *this;
  }
};

/// Sizes of the families that a verdict's levels are shared out over.
struct Families {
  std::uint64_t means = 1, lookups = 1, laws = 1;
};

Real lookups_of_a_sample(const Sampled& sampled) {
  return static_cast<Real>(sampled.counters.lookups) / static_cast<Real>(std::max<std::uint64_t>(1, sampled.counters.samples));
}

/// Variances from samples of their own, where theory has none; some of them are kept.
std::optional<Pilot> run_pilot(const PreparedCell& prepared, std::vector<KeptSamples>& kept, const std::function<bool()>& stop) {
  const auto sampled =
      sample_cell(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets,
                  {.first = first_sample::kPilot, .per_ray = prepared.samples_per_ray, .keep = true}, nullptr, stop, [](double) {});
  if (!sampled || prepared.samples_per_ray < 2) return std::nullopt;
  if (sampled->counters.overruns == 0) kept.push_back(sampled->kept);
  Pilot pilot;
  const std::size_t outputs = prepared.targets.outputs;
  const auto n = static_cast<Real>(prepared.samples_per_ray);
  std::vector<Real> second(outputs), fourth(outputs), raw(outputs);  // central moments, summed over the rays
  for (std::size_t i = 0; i < sampled->moments.size(); ++i) {
    const Moments& x = sampled->moments[i];
    const Real m = x.mean();
    pilot.variance.push_back(x.variance());
    second[i % outputs] += std::max<Real>(0, x.s2 - n * m * m);
    fourth[i % outputs] += std::max<Real>(0, x.s4 - 4 * m * x.s3 + 6 * m * m * x.s2 - 3 * n * m * m * m * m);
    raw[i % outputs] += x.s2;
  }
  for (std::size_t ray = 0; ray < sampled->lookups.size(); ++ray) {
    const Real mean = static_cast<Real>(sampled->lookups[ray]) / n;
    pilot.lookups_variance.push_back(std::max<Real>(0, (sampled->lookups_squared[ray] - n * mean * mean) / (n - 1)));
  }
  pilot.samples = sampled->counters.samples;
  pilot.lookups = sampled->counters.lookups;
  // Below this share of the squared distance to the target a variance is rounding; one that has underflowed tells nothing.
  constexpr Real kCancelled = 1e-6;
  const auto count = n * static_cast<Real>(sampled->lookups.size());
  for (std::size_t o = 0; o < outputs; ++o) {
    const bool seen = second[o] > kCancelled * raw[o] && fourth[o] >= std::numeric_limits<Real>::min();
    pilot.variance_of_variance = std::max(pilot.variance_of_variance, seen ? fourth[o] / (second[o] * second[o]) - 1 / count : 1);
  }
  return pilot;
}

/// Why a cell has no verdict; empty where it has one.
std::string why_not_judged(const PreparedCell& prepared) {
  const bool predicts_itself = !prepared.theory.ray_variance.empty();
  if (!prepared.cell->gate.enabled) return "the configuration disables the verdict";
  if (!prepared.takes_part) return "the estimator takes no part";
  if (prepared.claim == Claim::biased) return "the estimator claims nothing";
  if (prepared.claim == Claim::consistent && !(predicts_itself && prepared.targets.names.empty()))
    return "the estimator claims to be consistent and predicts no mean to test";
  if (!prepared.targets.known) return "there is no reference";
  if (prepared.cell->measurement != Measurement{}) return "no claim covers samples that are clamped or rounded";
  return "";
}

bool is_judged(const PreparedCell& prepared) { return why_not_judged(prepared).empty(); }

/// Any tracker is right where there is nothing to meet.  Light may still meet surfaces.
bool tests_nothing(const PreparedCell& prepared) {
  const std::vector<Real>& depth = prepared.scene->reference->depth;
  return prepared.cell->quantity != Quantity::radiance &&
         std::all_of(depth.begin(), depth.end(), [](Real of_ray) { return of_ray == 0; });
}

/// The tests of a cell; nothing for cells that claim nothing that could be tested.
std::optional<CellGate> gate_of(PreparedCell& prepared, const TestLevels& levels, std::vector<KeptSamples>& kept,
                                const std::function<bool()>& stop) {
  if (!is_judged(prepared)) return std::nullopt;
  const bool spread_missing = !prepared.theory.ray_lookups.empty() && prepared.theory.ray_lookups_variance.empty();
  std::optional<Pilot> pilot;
  const bool exact = prepared.claim == Claim::exact;
  if ((prepared.theory.ray_variance.empty() && !exact) || spread_missing) pilot = run_pilot(prepared, kept, stop);
  return plan_gate(prepared.planned(), *prepared.scene, prepared.targets, prepared.range, prepared.claim, prepared.theory, pilot,
                   levels);
}

/// Laws of how the cell's samples and walks behave, where its configuration asks for them; and what of them is not tested.
std::vector<LawRecord> laws_of(const PreparedCell& prepared, const CellGate& gate, const Sampled& sampled,
                               std::span<const KeptSamples> kept, std::vector<std::string>& untested,
                               const std::function<bool()>& stop) {
  std::vector<LawRecord> laws;
  const LawPolicy policy = prepared.cell->gate.laws;
  const bool violates = prepared.needs_bound && !prepared.scene->bounding, judged = gate.against == "reference" && !violates;
  if (judged && (policy == LawPolicy::always || (policy == LawPolicy::undecided && !gate.undecidable.empty())))
    laws = test_laws(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets, prepared.range, prepared.theory,
                     {.each = lookups_of_a_sample(sampled)}, stop);
  // Bins are coarse; where weights are 1 the distribution itself can be looked at.
  if (judged && policy != LawPolicy::never && prepared.cell->quantity == Quantity::free_path) {
    const std::string why_not = why_no_free_path_laws(*prepared.scene, prepared.range, prepared.theory);
    if (!why_not.empty()) untested.push_back("distribution of free paths: " + why_not);
    for (const LawRecord& law :
         free_path_laws(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.range, prepared.theory, {}, stop))
      laws.push_back(law);
  }
  if (judged && !gate.variances.empty()) {
    std::vector<Real> logs;
    for (std::size_t i = 0; i < gate.variances.size(); ++i)
      logs.push_back(test_record(gate.variances[i], sampled.variances[i]).log_e_fail);
    // Without a bound above, samples not seen could make up for any variance that was stated too large.
    laws.push_back({std::isfinite(gate.high) ? "variance" : "variance from below", std::round(log_mean_exp(logs) * 1e4) / 1e4,
                    sampled.counters.samples, Outcome::none});
  }
  if (const LawRecord law = replay_law(prepared.planned(), *prepared.scene, *prepared.kernel, kept, stop); law.samples > 0)
    laws.push_back(law);
  return laws;
}

/// Whether the samples' own spread says that their mean is off, by more than ten samples of 1 that they have not shown could make
/// up for, though nothing could be bet on it; how, in words.  A few samples say nothing.
std::optional<std::string> far_off(const PreparedCell& prepared, const CellGate& gate, const Sampled& sampled) {
  constexpr Real kStandardErrors = 6, kUnseen = 10;
  constexpr std::uint64_t kFew = 256;
  if (sampled.counters.samples < kFew) return std::nullopt;
  const std::size_t outputs = prepared.targets.outputs;
  for (std::size_t o = 0; o < outputs; ++o) {
    Real error = 0, squared = 0, expected = 0, rounding = 0;  // of the mean over all rays
    const auto rays = static_cast<Real>(sampled.lookups.size());
    for (std::size_t ray = 0; ray < sampled.lookups.size(); ++ray) {
      const Moments& moments = sampled.moments[ray * outputs + o];
      error += (moments.mean() - gate.shift[ray * outputs + o]) / rays;
      expected += (prepared.targets.mean[ray * outputs + o] + gate.shift[ray * outputs + o]) / rays;
      squared += moments.variance() / (static_cast<Real>(std::max<std::uint64_t>(1, moments.count)) * rays * rays);
    }
    for (const MeanTest& test : gate.tests)
      if (test.channel == static_cast<int>(o) && test.group == MeanTest::kAllRays)
        rounding = test.rounding + test.reference_error;
    if (std::abs(error) <= kStandardErrors * std::sqrt(squared) + rounding) continue;
    const Real unseen = kUnseen * std::max({Real{1}, sampled.largest, std::abs(expected)});
    if (std::abs(error) * static_cast<Real>(sampled.counters.samples) <= unseen) continue;
    const std::string errors = squared > 0
                                   ? fmt::format("{:.3g} standard errors of the samples", std::abs(error) / std::sqrt(squared))
                                   : "and no variance";
    return fmt::format("mean {:.6g}, expected {:.6g} ({:+.2g}, {})", expected + error, expected, error, errors);
  }
  return std::nullopt;
}

/// Draws on where a verdict is open, as long as the plan and the configuration allow.
class Judging {
 public:
  Judging(const PreparedCell& prepared, const CellGate& gate, const Sampled& sampled, const GateLevels& levels,
          const Families& families)
      : prepared_(prepared), gate_(gate), evidence_(sampled.evidence), violations_(sampled.counters.violations) {
    verdict_.against = gate.against;
    verdict_.variance_basis = gate.variance_basis;
    verdict_.tolerate = prepared.cell->gate.tolerate;
    verdict_.family = families.means;
    verdict_.lookups_family = families.lookups;
    verdict_.laws_family = families.laws;
    verdict_.alpha = levels.alpha;
    verdict_.alpha_pass = levels.alpha_pass;
    verdict_.planned = gate.planned;
    verdict_.affordable = gate.affordable;
    verdict_.planned_undecidable = !gate.undecidable.empty();
    verdict_.samples_per_ray = prepared.samples_per_ray;
    verdict_.out_of_range = sampled.out_of_range;
    open_reason_ = gate.undecidable;
    if (gate.remedies.empty()) return;
    if (const auto off = far_off(prepared, gate, sampled)) {
      verdict_.planned_undecidable = false;
      open_reason_ = *off + ": " + open_reason_;
    }
    open_reason_ += "; " + gate.remedies;
  }

  void add_laws(std::vector<LawRecord> laws, std::vector<std::string> untested) {
    verdict_.laws = std::move(laws);
    verdict_.untested = std::move(untested);
  }
  void count_lookups(std::uint64_t walks) { verdict_.counted_walks = walks; }

  const VerdictRecord& decided() {
    const bool seen = prepared_.scene->exceeds_bound || violations_ > 0;
    verdict_.violated = prepared_.needs_bound && seen;
    verdict_.bound_unproven = prepared_.needs_bound && !prepared_.scene->bounding && !seen;
    verdict_.reason = open_reason_;
    verdict_.tests.clear();
    for (std::size_t i = 0; i < gate_.tests.size(); ++i) {
      verdict_.tests.push_back(test_record(gate_.tests[i], evidence_[i]));
      if (gate_.tests[i].channel == MeanTest::kLookups && verdict_.counted_walks > 0) verdict_.tests.back().basis = "counted";
    }
    decide(verdict_, prepared_.targets.names);
    return verdict_;
  }

  /// The samples to draw next of every ray, of a verdict that was just decided; none where it stands.
  SampleSpan next() const {
    const std::uint64_t drawn = verdict_.samples_per_ray;
    if (!open() || drawn >= gate_.allowance) return {};
    // As many again until the planned ones are drawn; then steps of a quarter overshoot by an eighth.
    const std::uint64_t wanted = drawn < gate_.planned ? std::min(drawn, gate_.planned - drawn) : drawn / 4;
    // Whole sums, and whole blocks of walks where there are many.
    constexpr std::uint64_t kRound = 64, kMany = 1024;
    const std::uint64_t round = drawn >= kMany ? kRound : gate_.longest_sum;
    const std::uint64_t count = std::clamp<std::uint64_t>(wanted, 1, gate_.allowance - drawn);
    return {.first = drawn, .per_ray = (count + round - 1) / round * round, .only_evidence = true};
  }

  void add(const Sampled& more, std::uint64_t per_ray) {
    for (std::size_t i = 0; i < evidence_.size(); ++i) evidence_[i] += more.evidence[i];
    verdict_.samples_per_ray += per_ray;
    verdict_.out_of_range += more.out_of_range;
    verdict_.nonfinite += more.nonfinite;
    violations_ += more.counters.violations;
  }

 private:
  /// Whether further samples may decide what is open, and are worth it.
  bool open() const {
    const Outcome mean = gate_.against == "own mean" ? verdict_.own_mean : verdict_.unbiased;
    if (mean == Outcome::inconclusive) {
      const bool decidable = gate_.remedies.empty() && gate_.planned <= gate_.affordable;
      return decidable || prepared_.cell->gate.all_samples || promising();
    }
    if (mean != Outcome::pass || verdict_.lookups != Outcome::inconclusive) return false;
    return gate_.tests.back().planned <= gate_.affordable;
  }

  /// A test of the mean has half the evidence that proves a bias.
  bool promising() const {
    const Real needed = std::log(static_cast<Real>(verdict_.family) / verdict_.alpha);
    return std::any_of(verdict_.tests.begin(), verdict_.tests.end(), [&](const TestRecord& test) {
      return test.channel >= 0 && !test.deterministic() && test.log_e_fail >= needed / 2;
    });
  }

  const PreparedCell& prepared_;
  const CellGate& gate_;
  VerdictRecord verdict_;
  std::vector<Evidence> evidence_;
  std::uint64_t violations_;
  std::string open_reason_;
};

/// Looks at the evidence of the first samples and draws further ones while the verdict is open.  Nothing where interrupted.
std::optional<VerdictRecord> judge(const PreparedCell& prepared, const CellGate& gate, const Sampled& sampled,
                                   std::span<const KeptSamples> kept, const GateLevels& levels, const Families& families,
                                   Effort& effort, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress) {
  Judging judging(prepared, gate, sampled, levels, families);
  std::vector<std::string> untested;
  std::vector<LawRecord> laws = laws_of(prepared, gate, sampled, kept, untested, stop);
  judging.add_laws(std::move(laws), std::move(untested));
  // A mean to a hundredth would take more samples than the rest of the verdict.
  if (!gate.lookups.empty() && gate.tests.back().planned > std::max(prepared.samples_per_ray, gate.planned))
    judging.count_lookups(
        counted_walks(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.theory, levels.alpha_pass, stop));
  for (;;) {
    const VerdictRecord& verdict = judging.decided();
    const SampleSpan span = judging.next();
    if (span.per_ray == 0) return verdict;
    const auto more =
        sample_cell(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets, span, &gate, stop, progress);
    if (!more) return std::nullopt;
    effort += *more;
    judging.add(*more, span.per_ray);
  }
}

/// What the verdict of a cell can be expected to say, before anything is sampled.
void foresee(const PreparedCell& prepared, const TestLevels& levels, Prediction& prediction) {
  prediction.most = prepared.samples_per_ray;
  if (!is_judged(prepared) || tests_nothing(prepared)) {
    prediction.verdict = "not judged";
    return;
  }
  if (prepared.theory.ray_variance.empty()) {
    prediction.verdict = "by a pilot";
    return;
  }
  const CellGate gate = plan_gate(prepared.planned(), *prepared.scene, prepared.targets, prepared.range, prepared.claim,
                                  prepared.theory, std::nullopt, levels);
  prediction.planned = gate.planned;
  if (gate.planned <= gate.affordable)
    prediction.most = std::max(prediction.most, std::min(gate.allowance, kPatience * gate.planned));
  prediction.verdict = prepared.needs_bound && !prepared.scene->bounding ? "VIOLATED"
                       : gate.undecidable.empty()                        ? "PASS"
                                                                         : "INCONCLUSIVE";
}

std::optional<Real> finite(Real x) { return std::isfinite(x) ? std::optional(x) : std::nullopt; }

CellRecord blank_record(const Plan& plan, const PreparedCell& prepared) {
  const Cell& cell = *prepared.cell;
  CellRecord record;
  record.cell = cell;
  record.cell.samples_per_ray = prepared.samples_per_ray;
  record.medium = plan.media[cell.medium];
  record.majorant = plan.majorants[cell.majorant];
  record.ray_set = plan.ray_sets[cell.rays];
  const auto* entry = Registry<EstimatorEntry>::instance().find(cell.estimator.type);
  record.claims = to_string(make_estimator(cell.estimator)->claim(cell.quantity));
  record.range = to_string(entry->range);
  record.order = make_estimator(cell.estimator)->order(cell.quantity);
  if (prepared.scene) {
    record.channels = prepared.scene->medium->medium->channels();
    record.rays = prepared.scene->rays->world.size();
    record.structure = prepared.scene->majorant->structure->size();
    record.medium_hash = fmt::format("{:016x}", prepared.scene->medium->hash);
    if (record.channels > 1) record.effects.push_back("chromatic");
    if (cell.quantity == Quantity::radiance) record.effects = prepared.effects;
    if (const auto alone = make_estimator(cell.estimator)->kernel(record.channels, cell.precision))
      record.given_depth = alone->needs_optical_depth();
    if (!prepared.takes_part) record.reason = "constant extinction: closed-form flights, the estimator takes no part";
  }
  return record;
}

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

void fill_statistics(CellRecord& record, const PreparedCell& prepared, const Sampled& sampled) {
  const Cell& cell = *prepared.cell;
  const auto rays = static_cast<std::size_t>(record.rays);
  const auto n = static_cast<Real>(rays), samples = static_cast<Real>(record.cell.samples_per_ray);
  const Targets& targets = prepared.targets;
  const std::size_t outputs = targets.outputs;
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
    record.reason = fmt::format("{} of {} samples are not finite; `nullmark replay` shows the first", sampled.nonfinite,
                                sampled.counters.samples);
  }
  record.variance_basis = "sample";
  if (targets.known && targets.names.empty()) record.squared_error_blocks = squared_error_blocks(sampled);
  for (std::size_t o = 0; o < outputs; ++o) {
    Moments pooled;
    Real mean = 0, reference = 0, reference_square = 0, error = 0, bias = 0, squares = 0, variance = 0;
    for (std::size_t ray = 0; ray < rays; ++ray) {
      const Moments& moments = sampled.moments[ray * outputs + o];
      const Real truth = measured(targets.mean[ray * outputs + o], cell.measurement);
      pooled += moments;
      bias += moments.mean();
      squares += moments.mean() * moments.mean();
      variance += moments.variance();
      mean += truth + moments.mean();
      reference += truth;
      reference_square += truth * truth;
      error += targets.error[ray * outputs + o];
    }
    ChannelRecord out;
    out.mean = finite(mean / n);
    if (targets.known) {
      out.reference = finite(reference / n);
      out.reference_error = finite(error / n);
      out.reference_rms = finite(std::sqrt(reference_square / n));
      out.bias = finite(bias / n);
      out.rmse = finite(std::sqrt(squares / n));
    }
    if (record.cell.samples_per_ray > 1) out.variance = finite(variance / n);
    if (o < prepared.theory.variance.size() && prepared.theory.variance[o]) {
      out.variance_theory = finite(*prepared.theory.variance[o]);
      out.rmse_theory = finite(std::sqrt(*prepared.theory.variance[o] / samples + prepared.theory.squared_bias[o].value_or(0)));
      record.variance_basis = "analytic";
    }
    if (o < prepared.theory.bias.size() && prepared.theory.bias[o]) out.bias_theory = finite(*prepared.theory.bias[o]);
    const std::optional<Real>& best = best_variance(out);
    if (best && reference_square > 0) out.relative_variance = finite(*best * n / reference_square);
    const auto count = static_cast<Real>(pooled.count);
    if (pooled.s2 > 0) out.kurtosis = finite(count * pooled.s4 / (pooled.s2 * pooled.s2));
    record.channel.push_back(out);

    const std::vector<GroupErrors::Level>& levels = sampled.groups[o].levels();
    for (std::size_t level = 0; level < levels.size(); ++level) {
      if (level >= record.convergence.size())
        record.convergence.push_back(
            {std::uint64_t{1} << level, std::vector<std::optional<Real>>(outputs), std::vector<std::optional<Real>>(outputs)});
      const Real mean_square = levels[level].sum_of_squares / static_cast<Real>(levels[level].groups);
      record.convergence[level].rmse[o] = finite(std::sqrt(mean_square));
      record.convergence[level].variance[o] = finite(std::max<Real>(0, mean_square - bias / n * (bias / n)));
    }
  }
}

/// Where samples are not finite or walks did not end, what is left of them has no say; references and theory stand.
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

/// The verdict, or why there is none.  A bias is one even where there is nothing to meet; a PASS is none.
void add_verdict(CellRecord& record, const PreparedCell& prepared, const std::optional<VerdictRecord>& verdict) {
  record.verdict = verdict;
  if (verdict && tests_nothing(prepared) && kind_of(record) != Kind::fail) {
    record.verdict.reset();
    record.reason = "no ray meets any extinction: nothing was tested";
  }
  if (!verdict && record.reason.empty()) record.reason = why_not_judged(prepared);
}

/// What a cell's pixels hold, unrounded but for single precision: mean, reference, variance and what theory says of it per
/// channel, lookups and null collisions.
std::vector<Layer> layers(const PreparedCell& prepared, const Sampled& sampled) {
  const std::size_t outputs = prepared.targets.outputs, rays = prepared.scene->rays->world.size();
  std::vector<Layer> all;
  const auto add = [&](const std::string& name, auto value) {
    all.push_back({name, std::vector<Real>(rays)});
    for (std::size_t ray = 0; ray < rays; ++ray) all.back().values[ray] = value(ray);
  };
  for (std::size_t o = 0; o < outputs; ++o) {
    const auto truth = [&](std::size_t ray) {
      return measured(prepared.targets.mean[ray * outputs + o], prepared.cell->measurement);
    };
    const auto moments = [&](std::size_t ray) -> const Moments& { return sampled.moments[ray * outputs + o]; };
    add(fmt::format("mean.{}", o), [&](std::size_t ray) { return truth(ray) + moments(ray).mean(); });
    if (prepared.targets.known) add(fmt::format("reference.{}", o), truth);
    add(fmt::format("variance.{}", o), [&](std::size_t ray) { return moments(ray).variance(); });
    if (!prepared.theory.ray_variance.empty())
      add(fmt::format("variance_theory.{}", o), [&](std::size_t ray) { return prepared.theory.ray_variance[ray * outputs + o]; });
  }
  const auto per_sample = [&](std::uint64_t count) {
    return static_cast<Real>(count) / static_cast<Real>(prepared.samples_per_ray);
  };
  add("lookups", [&](std::size_t ray) { return per_sample(sampled.lookups[ray]); });
  add("null_collisions", [&](std::size_t ray) { return per_sample(sampled.null_collisions[ray]); });
  return all;
}

void write_images(CellRecord& record, const PreparedCell& prepared, const Sampled& sampled, const RunOptions& options,
                  const RunObserver& observer) {
  const BuiltRays& rays = *prepared.scene->rays;
  if (!prepared.cell->images || !prepared.targets.names.empty() || rays.width == 0 || options.image_directory.empty()) return;
  const auto channels = static_cast<std::size_t>(record.channels);
  const std::size_t shown = channels >= 3 ? 3 : 1, outputs = prepared.targets.outputs;
  std::vector<Real> mean, variance, reference, lookups, null_collisions;
  for (std::size_t ray = 0; ray < rays.world.size(); ++ray) {
    for (std::size_t c = 0; c < shown; ++c) {
      const Moments& moments = sampled.moments[ray * outputs + c];
      reference.push_back(measured(prepared.targets.mean[ray * outputs + c], prepared.cell->measurement));
      mean.push_back(reference.back() + moments.mean());
      variance.push_back(moments.variance());
    }
    lookups.push_back(static_cast<Real>(sampled.lookups[ray]) / static_cast<Real>(prepared.samples_per_ray));
    null_collisions.push_back(static_cast<Real>(sampled.null_collisions[ray]) / static_cast<Real>(prepared.samples_per_ray));
  }
  const auto greatest = [](const std::vector<Real>& values) {
    const Real most = *std::max_element(values.begin(), values.end());
    return most > 0 ? most : 1;
  };
  try {
    std::filesystem::create_directories(options.image_directory);
    const auto write = [&](const char* kind, const std::vector<Real>& values, std::size_t count, Real maximum) {
      const std::string file = fmt::format("{}.{}.png", prepared.cell->id, kind);
      write_png((std::filesystem::path(options.image_directory) / file).string(), rays.width, rays.height,
                static_cast<int>(count), values, maximum, prepared.cell->quantity == Quantity::radiance && &values == &mean);
      record.images[kind] = (std::filesystem::path(options.image_prefix) / file).string();
    };
    write("mean", mean, shown, prepared.cell->image_maximum);
    if (prepared.targets.known) write("reference", reference, shown, prepared.cell->image_maximum);
    write("variance", variance, shown, greatest(variance));
    write("lookups", lookups, 1, greatest(lookups));
    write("null_collisions", null_collisions, 1, greatest(null_collisions));
    const std::string file = fmt::format("{}.exr", prepared.cell->id);
    write_exr((std::filesystem::path(options.image_directory) / file).string(), rays.width, rays.height,
              layers(prepared, sampled));
    record.images["layers"] = (std::filesystem::path(options.image_prefix) / file).string();
  } catch (const std::exception& error) {
    observer.warning(error.what());
  }
}

/// Prepares the cells that `wanted` picks, by their place in the plan.
std::vector<PreparedCell> prepare_all(Workshop& workshop, const Plan& plan, const std::function<bool(std::size_t)>& wanted) {
  expect_rays_fit(plan, wanted);
  std::vector<PreparedCell> cells;
  for (std::size_t i = 0; i < plan.cells.size(); ++i)
    if (wanted(i)) cells.push_back(workshop.prepare(i));
  return cells;
}

struct CellOutcome {
  CellRecord record;
  Effort effort;
};

/// Samples and judges a cell.
CellOutcome run_cell(const Plan& plan, PreparedCell& prepared, const Families& families, bool late, const RunOptions& options,
                     const RunObserver& observer, const std::function<bool()>& stop) {
  CellOutcome outcome{blank_record(plan, prepared), {}};
  CellRecord& record = outcome.record;
  if (!prepared.reason.empty()) {
    record.status = Status::skipped;
    record.reason = prepared.reason;
    return outcome;
  }
  if (stop() || late) {
    record.reason = stop() ? "interrupted" : "time budget spent";
    return outcome;
  }
  const auto progress = [&](double fraction) { observer.progress(record, fraction); };
  std::vector<KeptSamples> kept;
  const std::optional<CellGate> gate = gate_of(prepared, TestLevels{plan.levels.alpha_pass, families.means}, kept, stop);
  const auto sampled =
      sample_cell(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets,
                  {.per_ray = prepared.samples_per_ray, .keep = gate.has_value()}, gate ? &*gate : nullptr, stop, progress);
  if (sampled) outcome.effort += *sampled;
  if (sampled && sampled->counters.overruns == 0) kept.push_back(sampled->kept);
  std::optional<VerdictRecord> verdict;
  if (sampled && gate) verdict = judge(prepared, *gate, *sampled, kept, plan.levels, families, outcome.effort, stop, progress);
  if (!sampled || (gate && !verdict)) {
    record.reason = "interrupted";
    return outcome;
  }
  fill_statistics(record, prepared, *sampled);
  if (record.status == Status::ok && verdict && verdict->nonfinite > 0) {
    record.status = Status::error;
    record.nonfinite += verdict->nonfinite;
    record.reason = fmt::format("{} samples are not finite, among those drawn for the verdict; `nullmark replay` shows the first",
                                verdict->nonfinite);
  }
  if (record.status == Status::ok && outcome.effort.overruns > 0) {
    record.status = Status::error;
    record.reason = fmt::format("{} walks exceeded the bound on lookups", outcome.effort.overruns);
  }
  if (record.status == Status::ok) {
    add_verdict(record, prepared, verdict);
    record.reliance = measure_reliance(prepared.planned(), *prepared.scene, *prepared.kernel, stop);
  } else {
    drop_sampled_statistics(record);
  }
  write_images(record, prepared, *sampled, options, observer);
  return outcome;
}

/// Calls `work` for 0 .. count - 1, begun in this order, one on each thread; threads that find none left help with the chunks of
/// those under way.  Throws what the first that failed threw; `failed` is then set, and no further ones are begun.
template <class F>
void for_each_in_order(std::size_t count, int threads, std::atomic<bool>& failed, F&& work) {
  std::atomic<std::size_t> next = 0;
  std::exception_ptr error;
  const auto take = [&](int) {
    for (std::size_t i = next++; i < count && !failed; i = next++) {
      // An exception that reached TBB would cut the others' chunks short in silence.
      try {
        // While it waits for chunks of its own, a thread must not begin another cell.
        tbb::this_task_arena::isolate([&] { work(i); });
      } catch (...) {
        if (!failed.exchange(true)) error = std::current_exception();
      }
    }
  };
  tbb::parallel_for(0, std::max(1, threads), take, tbb::simple_partitioner{});
  if (error) std::rethrow_exception(error);
}

}  // namespace

std::vector<CellRecord> run_plan(const Plan& plan, const std::vector<bool>& selected, const std::vector<CellRecord>& finished,
                                 const RunOptions& options, const RunObserver& observer) {
  const int threads = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(std::max(1, threads)));
  const auto start = std::chrono::steady_clock::now();
  const auto stop = [&] { return options.interrupted && options.interrupted->load() != 0; };

  std::map<std::size_t, CellRecord> records;  // by place in the plan
  for (std::size_t i = 0; i < plan.cells.size(); ++i)
    for (const CellRecord& record : finished)
      if (selected[i] && record.cell.id == plan.cells[i].id) records[i] = record;

  const bool timing = options.timing && plan.timing.enabled;
  const Families families{mean_family(plan), lookups_family(plan), laws_family(plan)};
  Workshop workshop(plan);
  std::vector<PreparedCell> cells =
      prepare_all(workshop, plan, [&](std::size_t i) { return selected[i] && !records.contains(i); });
  // Statistics of a resumed run stand; a run that was stopped before or while timing still owes the times.
  const std::vector<PreparedCell> untimed = prepare_all(workshop, plan, [&](std::size_t i) {
    const auto record = records.find(i);
    return timing && record != records.end() && record->second.status == Status::ok && !record->second.time;
  });
  if (!stop()) add_theory(cells);

  std::vector<CellOutcome> outcomes(cells.size());
  {
    std::mutex telling;
    Background teller;
    std::size_t done = 0;
    std::atomic<bool> failed = false;
    const auto given_up = [&] { return stop() || failed || teller.failed(); };
    RunObserver guarded = observer;
    guarded.warning = [&](const std::string& message) {
      const std::lock_guard lock(telling);
      observer.warning(message);
    };
    // Some progress untold is better than samples that wait.
    guarded.progress = [&](const CellRecord& record, double fraction) {
      if (const std::unique_lock lock(telling, std::try_to_lock); lock) observer.progress(record, fraction);
    };
    for_each_in_order(cells.size(), threads, failed, [&](std::size_t i) {
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const bool late = options.time_budget && seconds > *options.time_budget;
      outcomes[i] = run_cell(plan, cells[i], families, late, options, guarded, given_up);
      teller.add([&, i] {
        const std::lock_guard lock(telling);
        observer.cell_done(outcomes[i].record, ++done, cells.size());
      });
    });
    teller.finish();
  }

  std::vector<const PreparedCell*> to_time;
  to_time.reserve(untimed.size() + cells.size());
  for (const PreparedCell& prepared : untimed) to_time.push_back(&prepared);
  Effort effort;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    effort += outcomes[i].effort;
    if (outcomes[i].record.status == Status::ok) to_time.push_back(&cells[i]);
    records[cells[i].index] = std::move(outcomes[i].record);
  }

  if (timing && !to_time.empty() && !stop()) {
    std::vector<TimedCell> timed;
    timed.reserve(to_time.size());
    for (const PreparedCell* prepared : to_time) timed.push_back({prepared->cell, prepared->scene.get(), prepared->kernel.get()});
    const auto times = time_cells(timed, plan.timing, stop, [&](double fraction) { observer.timing(fraction); });
    for (std::size_t i = 0; i < times.size(); ++i) {
      CellRecord& record = records[to_time[i]->index];
      record.time = times[i];
      if (!times[i]) continue;
      record.time->majorant_build_seconds = to_time[i]->scene->majorant->build_seconds;
      observer.cell_timed(record);
    }
  }
  if (effort.working > 0) {
    observer.verdict_share(effort.judging / (effort.working - effort.judging));
    observer.statistics_share(effort.statistics / (effort.working - effort.statistics));
  }
  std::vector<CellRecord> result;
  result.reserve(records.size());
  for (auto& [index, record] : records) result.push_back(std::move(record));
  return result;
}

std::vector<Prediction> predict(const Plan& plan, const std::vector<bool>& selected) {
  Workshop workshop(plan);
  std::vector<PreparedCell> cells = prepare_all(workshop, plan, [&](std::size_t i) { return selected[i]; });
  add_theory(cells);
  std::vector<Prediction> result;
  const TestLevels levels{plan.levels.alpha_pass, mean_family(plan)};
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
        prediction.relative_variance = finite(*prepared.theory.variance[0] * static_cast<Real>(prediction.rays) / squares);
    }
    if (prepared.scene && prepared.reason.empty()) foresee(prepared, levels, prediction);
    result.push_back(prediction);
  }
  return result;
}

}  // namespace nullmark
