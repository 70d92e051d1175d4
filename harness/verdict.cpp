#include "harness/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace nullmark {
namespace {

std::string place_of(const TestRecord& test, const std::vector<std::string>& outputs) {
  if (test.channel < 0) return "lookups";
  const auto output = static_cast<std::size_t>(test.channel);
  const std::string text = output < outputs.size() ? outputs[output] : fmt::format("channel {}", test.channel);
  return test.group < 0 ? text : fmt::format("{}, ray group {}", text, test.group);
}

}  // namespace

Outcome decide(const TestRecord& test, Real alpha_fail, Real alpha_pass) {
  const bool deterministic = test.basis == "deterministic";
  if (deterministic ? !(test.largest_error <= test.rounding + test.reference_error) : test.log_e_fail >= -std::log(alpha_fail))
    return Outcome::fail;
  const Real needed = -std::log(alpha_pass);
  const bool proven = deterministic || (test.log_e_low >= needed && test.log_e_high >= needed);
  return proven && test.reference_error <= 0.25 * test.epsilon ? Outcome::pass : Outcome::inconclusive;
}

void decide(VerdictRecord& verdict, const std::vector<std::string>& outputs) {
  verdict.unbiased = verdict.own_mean = Outcome::none;
  Outcome& outcome = verdict.against == "own mean" ? verdict.own_mean : verdict.unbiased;
  const Real alpha = verdict.alpha / static_cast<Real>(verdict.family);
  const Real alpha_lookups = verdict.alpha / static_cast<Real>(verdict.lookups_family);
  const TestRecord *failed = nullptr, *open = nullptr;
  bool any = false;
  verdict.lookups = Outcome::none;
  for (TestRecord& test : verdict.tests) {
    if (test.channel < 0) {
      test.outcome = verdict.lookups = decide(test, alpha_lookups, verdict.alpha_pass);
      continue;
    }
    any = true;
    test.outcome = decide(test, alpha, verdict.alpha_pass);
    if (test.outcome == Outcome::fail && (!failed || test.log_e_fail > failed->log_e_fail)) failed = &test;
    if (test.outcome == Outcome::inconclusive && !open) open = &test;
  }
  verdict.lawful = verdict.laws.empty() ? Outcome::none : Outcome::pass;
  const Real broken = std::log(static_cast<Real>(verdict.laws_family) / verdict.alpha);
  for (LawRecord& law : verdict.laws) {
    law.outcome = law.log_e >= broken ? Outcome::fail : Outcome::pass;
    if (law.outcome == Outcome::fail) verdict.lawful = Outcome::fail;
  }
  if (!any) {
    outcome = Outcome::none;
  } else if (verdict.violated) {
    outcome = Outcome::violated;
    verdict.reason = "needs a majorant that bounds the extinction, and violations were counted";
  } else if (verdict.nonfinite > 0) {
    outcome = Outcome::fail;
    verdict.reason = fmt::format("{} samples are not finite", verdict.nonfinite);
  } else if (verdict.out_of_range > 0) {
    outcome = Outcome::fail;
    verdict.reason = fmt::format("{} samples lie outside the declared range", verdict.out_of_range);
  } else if (failed) {
    outcome = Outcome::fail;
    verdict.reason = failed->basis == "deterministic"
                         ? fmt::format("{}: a sample is off by {:.3g}, rounding allows {:.3g}", place_of(*failed, outputs),
                                       failed->largest_error, failed->rounding + failed->reference_error)
                         : fmt::format("{}: log E = {:.1f}, {:.1f} proves bias", place_of(*failed, outputs), failed->log_e_fail,
                                       -std::log(alpha));
  } else if (open) {
    outcome = Outcome::inconclusive;
    if (!verdict.planned_undecidable)
      verdict.reason = fmt::format("{}: undecided after {} samples a ray; {} were planned", place_of(*open, outputs),
                                   verdict.samples_per_ray, verdict.planned);
  } else {
    outcome = Outcome::pass;
    verdict.reason.clear();
  }
}

}  // namespace nullmark
