#include "harness/verdict/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/verdict/counted_lookups.h"
#include "harness/verdict/free_path_law.h"
#include "harness/verdict/replay_law.h"
#include "harness/verdict/verdict.h"
#include "harness/verdict/walk_laws.h"

namespace nullmark {
namespace {

Real lookups_of_a_sample(const Sampled& sampled) {
  return static_cast<Real>(sampled.counters.lookups) / static_cast<Real>(std::max<std::uint64_t>(1, sampled.counters.samples));
}

/// Variances from samples of their own, where theory has none; some of them are kept.
std::optional<Pilot> run_pilot(const PreparedCell& prepared, std::vector<KeptSamples>& kept, const std::function<bool()>& stop) {
  const std::uint64_t per_ray = prepared.kernel->pilot_samples().value_or(prepared.samples_per_ray);
  if (per_ray < 2) return std::nullopt;
  const auto sampled =
      sample_cell(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets,
                  {.first = first_sample::kPilot, .per_ray = per_ray, .keep = true}, nullptr, stop, [](double) {});
  if (!sampled) return std::nullopt;
  if (sampled->counters.overruns == 0) kept.push_back(sampled->kept);
  Pilot pilot;
  const std::size_t outputs = prepared.targets.outputs;
  const auto n = static_cast<Real>(per_ray);
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

/// Means per ray and output of the tracker that a difference subtracts: what its margins are relative to.
std::vector<Real> means_of_subtracted(const PreparedCell& prepared, const std::function<bool()>& stop) {
  const auto sampled =
      sample_cell(prepared.planned(), *prepared.scene, *prepared.subtracted, prepared.targets,
                  {.first = first_sample::kPilot, .per_ray = prepared.samples_per_ray}, nullptr, stop, [](double) {});
  std::vector<Real> means;
  if (!sampled) return means;
  for (const Moments& moments : sampled->moments) means.push_back(moments.mean());
  return means;
}

/// Laws of how the cell's samples and walks behave, where its configuration asks for them; and what of them is not tested.
std::vector<LawRecord> laws_of(const PreparedCell& prepared, const TestPlan& plan, const Sampled& sampled,
                               std::span<const KeptSamples> kept, std::vector<std::string>& untested,
                               const std::function<bool()>& stop) {
  constexpr const char* kTooLong = "walks take more lookups than a recording holds";
  std::vector<LawRecord> laws;
  const LawPolicy policy = prepared.cell->verdict.laws;
  const bool violates = prepared.needs_bound && !prepared.scene->bounding, judged = plan.against == "reference" && !violates;
  if (judged && (policy == LawPolicy::always || (policy == LawPolicy::undecided && !plan.undecidable.empty()))) {
    auto of_walks = test_laws(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets, prepared.range,
                              prepared.theory, {.each = lookups_of_a_sample(sampled)}, stop);
    if (of_walks)
      laws = *std::move(of_walks);
    else
      untested.push_back(fmt::format("laws of walks: {}", kTooLong));
  }
  // Bins are coarse; where weights are 1 the distribution itself can be looked at.
  if (judged && policy != LawPolicy::never && prepared.cell->quantity == Quantity::free_path) {
    const std::string why_not = why_no_free_path_laws(*prepared.scene, prepared.range, prepared.theory);
    if (!why_not.empty()) untested.push_back("distribution of free paths: " + why_not);
    const std::vector<LawRecord> of_flights =
        free_path_laws(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.range, prepared.theory, {}, stop);
    if (of_flights.empty() && why_not.empty()) untested.push_back(fmt::format("distribution of free paths: {}", kTooLong));
    laws.insert(laws.end(), of_flights.begin(), of_flights.end());
  }
  if (judged && !plan.variances.empty()) {
    std::vector<Real> logs;
    for (std::size_t i = 0; i < plan.variances.size(); ++i)
      logs.push_back(test_record(plan.variances[i], sampled.variances[i]).log_e_fail);
    // Without a bound above, samples not seen could make up for any variance that was stated too large.
    laws.push_back({std::isfinite(plan.high) ? "variance" : "variance from below", std::round(log_mean_exp(logs) * 1e4) / 1e4,
                    sampled.counters.samples, Outcome::none});
  }
  const auto identity = prepared.source ? prepared.source->identity() : std::nullopt;
  if (identity && !identity->repeatable) {
    untested.push_back("replay: the tracker says that its samples cannot be drawn again");
    return laws;
  }
  if (const LawRecord law = replay_law(prepared.planned(), *prepared.scene, *prepared.kernel, kept, stop); law.samples > 0)
    laws.push_back(law);
  return laws;
}

/// Whether the samples' own spread says that their mean is off, by more than ten samples of 1 that they have not shown could make
/// up for, though nothing could be bet on it; how, in words.  A few samples say nothing.
std::optional<std::string> far_off(const PreparedCell& prepared, const TestPlan& plan, const Sampled& sampled) {
  constexpr Real kStandardErrors = 6, kUnseen = 10;
  constexpr std::uint64_t kFew = 256;
  if (sampled.counters.samples < kFew) return std::nullopt;
  const std::size_t outputs = prepared.targets.outputs;
  for (std::size_t o = 0; o < outputs; ++o) {
    Real error = 0, squared = 0, expected = 0, rounding = 0;  // of the mean over all rays
    const auto rays = static_cast<Real>(sampled.lookups.size());
    for (std::size_t ray = 0; ray < sampled.lookups.size(); ++ray) {
      const Moments& moments = sampled.moments[ray * outputs + o];
      error += (moments.mean() - plan.shift[ray * outputs + o]) / rays;
      expected += (prepared.targets.mean[ray * outputs + o] + plan.shift[ray * outputs + o]) / rays;
      squared += moments.variance() / (static_cast<Real>(std::max<std::uint64_t>(1, moments.count)) * rays * rays);
    }
    for (const MeanTest& test : plan.tests)
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
  Judging(const PreparedCell& prepared, const TestPlan& plan, const Sampled& sampled, const ErrorRates& levels,
          const Families& families)
      : prepared_(prepared), plan_(plan), evidence_(sampled.evidence), violations_(sampled.counters.violations) {
    verdict_.against = plan.against;
    verdict_.variance_basis = plan.variance_basis;
    verdict_.tolerate = prepared.cell->verdict.tolerate;
    verdict_.family = families.means;
    verdict_.lookups_family = families.lookups;
    verdict_.laws_family = families.laws;
    verdict_.alpha = levels.alpha;
    verdict_.alpha_pass = levels.alpha_pass;
    verdict_.planned = plan.planned;
    verdict_.affordable = plan.affordable;
    verdict_.planned_undecidable = !plan.undecidable.empty();
    verdict_.samples_per_ray = prepared.samples_per_ray;
    verdict_.out_of_range = sampled.out_of_range;
    open_reason_ = plan.undecidable;
    if (plan.remedies.empty()) return;
    if (const auto off = far_off(prepared, plan, sampled)) {
      verdict_.planned_undecidable = false;
      open_reason_ = *off + ": " + open_reason_;
    }
    open_reason_ += "; " + plan.remedies;
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
    for (std::size_t i = 0; i < plan_.tests.size(); ++i) {
      verdict_.tests.push_back(test_record(plan_.tests[i], evidence_[i]));
      if (plan_.tests[i].channel == MeanTest::kLookups && verdict_.counted_walks > 0) verdict_.tests.back().basis = TestBasis::counted;
    }
    decide(verdict_, prepared_.targets.names);
    return verdict_;
  }

  /// The samples to draw next of every ray, of a verdict that was just decided; none where it stands.
  SampleSpan next() const {
    const std::uint64_t drawn = verdict_.samples_per_ray;
    if (!open() || drawn >= plan_.allowance) return {};
    // As many again until the planned ones are drawn; then steps of a quarter overshoot by an eighth.
    const std::uint64_t wanted = drawn < plan_.planned ? std::min(drawn, plan_.planned - drawn) : drawn / 4;
    // Whole sums, and whole blocks of walks where there are many.
    constexpr std::uint64_t kRound = 64, kMany = 1024;
    const std::uint64_t round = drawn >= kMany ? kRound : plan_.longest_sum;
    const std::uint64_t count = std::clamp<std::uint64_t>(wanted, 1, plan_.allowance - drawn);
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
    const Outcome mean = plan_.against == "own mean" ? verdict_.own_mean : verdict_.unbiased;
    if (mean == Outcome::inconclusive) {
      const bool decidable = plan_.remedies.empty() && plan_.planned <= plan_.affordable;
      return decidable || prepared_.cell->verdict.all_samples || promising();
    }
    if (mean != Outcome::pass || verdict_.lookups != Outcome::inconclusive) return false;
    return plan_.tests.back().planned <= plan_.affordable;
  }

  /// A test of the mean has half the evidence that proves a bias.
  bool promising() const {
    const Real needed = std::log(static_cast<Real>(verdict_.family) / verdict_.alpha);
    return std::any_of(verdict_.tests.begin(), verdict_.tests.end(), [&](const TestRecord& test) {
      return test.channel >= 0 && !test.deterministic() && test.log_e_fail >= needed / 2;
    });
  }

  const PreparedCell& prepared_;
  const TestPlan& plan_;
  VerdictRecord verdict_;
  std::vector<Evidence> evidence_;
  std::uint64_t violations_;
  std::string open_reason_;
};

}  // namespace

std::string why_not_judged(const PreparedCell& prepared) {
  const bool predicts_itself = !prepared.theory.ray_variance.empty();
  if (!prepared.cell->verdict.enabled) return "the configuration disables the verdict";
  if (!prepared.takes_part) return "the estimator takes no part";
  if (prepared.claim == Guarantee::biased) return "the estimator claims nothing";
  if (prepared.claim == Guarantee::consistent && !(predicts_itself && prepared.targets.names.empty()))
    return "the estimator claims to be consistent and predicts no mean to test";
  if (!prepared.targets.known) return "there is no reference";
  if (prepared.cell->measurement != Measurement{}) return "no claim covers samples that are clamped or rounded";
  return "";
}

bool tests_nothing(const PreparedCell& prepared) {
  const std::vector<Real>& depth = prepared.scene->reference->depth;
  return prepared.cell->quantity != Quantity::radiance &&
         std::all_of(depth.begin(), depth.end(), [](Real of_ray) { return of_ray == 0; });
}

std::optional<TestPlan> tests_of(const PreparedCell& prepared, const TestLevels& levels, std::vector<KeptSamples>& kept,
                                 const std::function<bool()>& stop) {
  if (!why_not_judged(prepared).empty()) return std::nullopt;
  const bool spread_missing = !prepared.theory.ray_lookups.empty() && prepared.theory.ray_lookups_variance.empty();
  std::optional<Pilot> pilot;
  const bool exact = prepared.claim == Guarantee::exact;
  if ((prepared.theory.ray_variance.empty() && !exact) || spread_missing) pilot = run_pilot(prepared, kept, stop);
  Targets targets = prepared.targets;
  if (prepared.subtracted) targets.size = means_of_subtracted(prepared, stop);
  return plan_tests(prepared.planned(), *prepared.scene, targets, prepared.range, prepared.claim, prepared.theory, pilot, levels);
}

std::optional<VerdictRecord> judge(const PreparedCell& prepared, const TestPlan& plan, const Sampled& sampled,
                                   std::span<const KeptSamples> kept, const ErrorRates& levels, const Families& families,
                                   Effort& effort, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress) {
  Judging judging(prepared, plan, sampled, levels, families);
  std::vector<std::string> untested = plan.untested;
  std::vector<LawRecord> laws = laws_of(prepared, plan, sampled, kept, untested, stop);
  judging.add_laws(std::move(laws), std::move(untested));
  // A mean to a hundredth would take more samples than the rest of the verdict.
  if (!plan.lookups.empty() && plan.tests.back().planned > std::max(prepared.samples_per_ray, plan.planned))
    judging.count_lookups(
        counted_walks(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.theory, levels.alpha_pass, stop));
  for (;;) {
    const VerdictRecord& verdict = judging.decided();
    const SampleSpan span = judging.next();
    if (span.per_ray == 0) return verdict;
    const auto more =
        sample_cell(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets, span, &plan, stop, progress);
    if (!more) return std::nullopt;
    effort += *more;
    judging.add(*more, span.per_ray);
  }
}

}  // namespace nullmark
