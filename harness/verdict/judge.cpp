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

/// Variances from samples of their own, where theory has none; some of them are kept.
void run_pilot(const PreparedCell& prepared, const std::function<bool()>& stop, DrawnPilot& drawn) {
  const SampleSpan span = pilot_span(prepared);
  if (span.per_ray < 2) return;
  const auto sampled =
      sample_cell(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets, span, nullptr, stop, [](double) {});
  if (!sampled) return;
  if (sampled->counters.overruns == 0) drawn.kept = sampled->kept;
  drawn.pilot.emplace();
  Pilot& pilot = *drawn.pilot;
  const std::size_t outputs = prepared.targets.outputs;
  const auto n = static_cast<Real>(span.per_ray);
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
  pilot.taken = prepared.kernel->pilot_samples().value_or(0);
  pilot.samples = sampled->counters.samples;
  pilot.lookups = sampled->counters.lookups;
  // Below this share of the squared distance to the target a variance is rounding; one that has underflowed tells nothing.
  constexpr Real kCancelled = 1e-6;
  const auto count = n * static_cast<Real>(sampled->lookups.size());
  for (std::size_t o = 0; o < outputs; ++o) {
    const bool seen = second[o] > kCancelled * raw[o] && fourth[o] >= std::numeric_limits<Real>::min();
    pilot.variance_of_variance = std::max(pilot.variance_of_variance, seen ? fourth[o] / (second[o] * second[o]) - 1 / count : 1);
  }
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

/// Whether laws tell of the cell: it is judged against the reference, under a bound where its tracker needs one.
bool against_reference(const PreparedCell& prepared, const TestPlan& plan) {
  return plan.against == "reference" && (!prepared.needs_bound || prepared.scene->bounding);
}

/// Laws of the cell's samples, and what of them is not tested.
void add_laws_of_samples(const PreparedCell& prepared, const TestPlan& plan, const Sampled& sampled,
                         std::span<const KeptSamples> kept, const std::function<bool()>& stop, WalkLaws& all) {
  std::vector<LawRecord>& laws = all.laws;
  if (against_reference(prepared, plan) && !plan.variances.empty()) {
    std::vector<Real> logs;
    for (std::size_t i = 0; i < plan.variances.size(); ++i)
      logs.push_back(test_record(plan.variances[i], sampled.variances[i]).log_e_fail);
    // Without a bound above, samples not seen could make up for any variance that was stated too large.
    laws.push_back({std::isfinite(plan.high) ? "variance" : "variance from below", std::round(log_mean_exp(logs) * 1e4) / 1e4,
                    sampled.counters.samples, Outcome::none});
  }
  const auto identity = prepared.source ? prepared.source->identity() : std::nullopt;
  if (identity && !identity->repeatable) {
    all.untested.emplace_back("replay: the tracker says that its samples cannot be drawn again");
    return;
  }
  if (const LawRecord law = replay_law(prepared.planned(), *prepared.scene, *prepared.kernel, kept, stop); law.samples > 0)
    laws.push_back(law);
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
    return fmt::format("biased, or its mean rests on samples too rare to be drawn: mean {:.6g}, expected {:.6g} ({:+.2g}, {})",
                       expected + error, expected, error, errors);
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

  void add_laws(WalkLaws laws) {
    verdict_.laws = std::move(laws.laws);
    verdict_.untested = std::move(laws.untested);
    verdict_.counted_walks = laws.counted_walks;
  }

  const VerdictRecord& decided() {
    const bool seen = prepared_.scene->exceeds_bound || violations_ > 0;
    verdict_.violated = prepared_.needs_bound && seen;
    verdict_.bound_unproven = prepared_.needs_bound && !prepared_.scene->bounding && !seen;
    verdict_.reason = open_reason_;
    verdict_.tests.clear();
    for (std::size_t i = 0; i < plan_.tests.size(); ++i) {
      verdict_.tests.push_back(test_record(plan_.tests[i], evidence_[i]));
      if (plan_.tests[i].channel == MeanTest::kLookups && verdict_.counted_walks > 0)
        verdict_.tests.back().basis = TestBasis::counted;
    }
    decide(verdict_, prepared_.targets.names, to_string(prepared_.range));
    return verdict_;
  }

  /// The samples to draw next of every ray, of a verdict that was just decided; none where it stands.
  SampleSpan next() const { return open() ? next_span(plan_, verdict_.samples_per_ray) : SampleSpan(); }

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

bool needs_theory(const PreparedCell& prepared) {
  // A consistent estimator's claim is a prediction of theory.
  return prepared.cell->equal_lookups || prepared.claim == Guarantee::consistent || why_not_judged(prepared).empty();
}

bool tests_nothing(const PreparedCell& prepared) {
  const std::vector<Real>& depth = prepared.scene->reference->depth;
  return prepared.cell->quantity != Quantity::radiance &&
         std::all_of(depth.begin(), depth.end(), [](Real of_ray) { return of_ray == 0; });
}

SampleSpan pilot_span(const PreparedCell& prepared) {
  return {.first = first_sample::kPilot,
          .per_ray = prepared.kernel->pilot_samples().value_or(prepared.samples_per_ray),
          .keep = true};
}

DrawnPilot draw_pilot(const PreparedCell& prepared, const std::function<bool()>& stop) {
  DrawnPilot drawn;
  if (!why_not_judged(prepared).empty()) return drawn;
  const bool spread_missing = !prepared.theory.ray_lookups.empty() && prepared.theory.ray_lookups_variance.empty();
  const bool exact = prepared.claim == Guarantee::exact;
  if ((prepared.theory.ray_variance.empty() && !exact) || spread_missing) run_pilot(prepared, stop, drawn);
  if (prepared.subtracted) drawn.size = means_of_subtracted(prepared, stop);
  return drawn;
}

std::optional<TestPlan> tests_of(const PreparedCell& prepared, const TestLevels& levels, const DrawnPilot& drawn) {
  if (!why_not_judged(prepared).empty()) return std::nullopt;
  Targets targets = prepared.targets;
  if (prepared.subtracted) targets.size = drawn.size;
  return plan_tests(prepared.planned(), *prepared.scene, targets, prepared.range, prepared.claim, prepared.theory, drawn.pilot,
                    levels);
}

SampleSpan next_span(const TestPlan& plan, std::uint64_t drawn) {
  if (drawn >= plan.allowance) return {};
  // As many again until the planned ones are drawn; then steps of a quarter overshoot by an eighth.
  const std::uint64_t wanted = drawn < plan.planned ? std::min(drawn, plan.planned - drawn) : drawn / 4;
  // Whole sums, and whole blocks of walks where there are many.
  constexpr std::uint64_t kRound = 64, kMany = 1024;
  const std::uint64_t round = drawn >= kMany ? kRound : plan.longest_sum;
  const std::uint64_t count = std::clamp<std::uint64_t>(wanted, 1, plan.allowance - drawn);
  return {.first = drawn, .per_ray = (count + round - 1) / round * round, .only_evidence = true};
}

std::uint64_t expected_samples(const PreparedCell& prepared, const TestPlan& plan) {
  std::uint64_t samples = prepared.samples_per_ray;
  if (plan.remedies.empty() && plan.planned <= plan.affordable)
    samples = std::max(samples, plan.planned);
  else if (prepared.cell->verdict.all_samples)
    return plan.allowance;
  if (plan.lookups.empty()) return samples;
  // Beyond the planned samples walks are counted, of trackers that fly.
  const std::uint64_t most = prepared.kernel->flies() ? std::min(plan.affordable, samples) : plan.affordable;
  return plan.tests.back().planned <= most ? std::max(samples, plan.tests.back().planned) : samples;
}

WalkLaws draw_walk_laws(const PreparedCell& prepared, const TestPlan& plan, Real lookups_of_a_sample, Real alpha,
                        const std::function<bool()>& stop) {
  constexpr const char* kTooLong = "walks take more lookups than a recording holds";
  WalkLaws drawn;
  const LawPolicy policy = prepared.cell->verdict.laws;
  const bool judged = against_reference(prepared, plan);
  if (judged && (policy == LawPolicy::always || (policy == LawPolicy::undecided && !plan.undecidable.empty()))) {
    auto of_walks = test_laws(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.targets, prepared.range,
                              prepared.theory, {.each = lookups_of_a_sample}, stop);
    if (of_walks)
      drawn.laws = *std::move(of_walks);
    else
      drawn.untested.push_back(fmt::format("laws of walks: {}", kTooLong));
  }
  // Bins are coarse; where weights are 1 the distribution itself can be looked at.
  if (judged && policy != LawPolicy::never && prepared.cell->quantity == Quantity::free_path) {
    const std::string why_not = why_no_free_path_laws(*prepared.scene, prepared.range, prepared.theory);
    if (!why_not.empty()) drawn.untested.push_back("distribution of free paths: " + why_not);
    const std::vector<LawRecord> of_flights =
        free_path_laws(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.range, prepared.theory, {}, stop);
    if (of_flights.empty() && why_not.empty()) drawn.untested.push_back(fmt::format("distribution of free paths: {}", kTooLong));
    drawn.laws.insert(drawn.laws.end(), of_flights.begin(), of_flights.end());
  }
  // A mean to a hundredth would take more samples than the rest of the verdict.
  if (!plan.lookups.empty() && plan.tests.back().planned > std::max(prepared.samples_per_ray, plan.planned))
    drawn.counted_walks = counted_walks(prepared.planned(), *prepared.scene, *prepared.kernel, prepared.theory, alpha, stop);
  return drawn;
}

std::optional<VerdictRecord> judge(const PreparedCell& prepared, const TestPlan& plan, const Sampled& sampled,
                                   std::span<const KeptSamples> kept, WalkLaws laws, const ErrorRates& levels,
                                   const Families& families, Effort& effort, const DrawSpan& draw,
                                   const std::function<bool()>& stop) {
  Judging judging(prepared, plan, sampled, levels, families);
  add_laws_of_samples(prepared, plan, sampled, kept, stop, laws);
  laws.untested.insert(laws.untested.begin(), plan.untested.begin(), plan.untested.end());
  judging.add_laws(std::move(laws));
  for (;;) {
    const VerdictRecord& verdict = judging.decided();
    const SampleSpan span = judging.next();
    if (span.per_ray == 0) return verdict;
    const auto more = draw(span);
    if (!more) return std::nullopt;
    effort += *more;
    judging.add(*more, span.per_ray);
  }
}

}  // namespace nullmark
