#include "harness/verdict/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/model/names.h"

namespace nullmark {
namespace {

/// The reference's own error may take so much of epsilon where a PASS is to be had.
constexpr Real kReferenceShare = 0.25;

/// "channel 2, ray group 5: ", as far as there is a choice.
std::string place_of(const TestRecord& test, const std::vector<std::string>& outputs, bool one_channel) {
  if (test.channel < 0) return "lookups: ";
  const auto output = static_cast<std::size_t>(test.channel);
  std::string place = one_channel ? "" : output < outputs.size() ? outputs[output] : fmt::format("channel {}", test.channel);
  if (test.group >= 0) place += fmt::format("{}ray group {}", place.empty() ? "" : ", ", test.group);
  return place.empty() ? "" : place + ": ";
}

/// A mean error as a share of the reference, or itself where there is nothing to share.
std::string as_share(Real error, Real reference) {
  return reference != 0 && std::isfinite(error / reference) ? fmt::format("{:+.2g} %", 100 * error / reference)
                                                            : fmt::format("{:+.3g}", error);
}

/// "mean .3582, reference .3607: -.69 %", with as many digits as tell the two apart.
std::string measured_bias(const TestRecord& test) {
  const Real mean = test.reference + test.mean_error;
  const Real apart = test.mean_error != 0 ? std::abs(test.reference / test.mean_error) : 1;
  const int digits = std::clamp(static_cast<int>(std::ceil(std::log10(std::max<Real>(1, apart)))) + 2, 4, 15);
  return fmt::format("mean {:.{}g}, expected {:.{}g}: {}", mean, digits, test.reference, digits,
                     as_share(test.mean_error, test.reference));
}

/// Whether the bets against "mean error 0" took a variance that the tracker states and a law refutes.  They take it only where
/// samples have no bound above, and there the law is the one from below.
bool rests_on_a_false_variance(const TestRecord& test, const VerdictRecord& verdict) {
  return verdict.variance_basis == "analytic" && test.takes_variance() &&
         std::any_of(verdict.laws.begin(), verdict.laws.end(),
                     [](const LawRecord& law) { return law.outcome == Outcome::fail && law.name == "variance from below"; });
}

std::string samples_that(std::size_t count, const char* one, const char* many) {
  return count == 1 ? fmt::format("1 sample {}", one) : fmt::format("{} samples {}", count, many);
}

/// What a sample of a deterministic test that is not right shows.
std::string off(const TestRecord& test, const VerdictRecord& verdict) {
  return fmt::format("a sample is off by {:.3g}, rounding allows {:.3g}; {}{}", test.largest_error, test.allowed_error(),
                     measured_bias(test),
                     verdict.variance_basis == "analytic" ? "; biased, or theory() is wrong to state a variance of 0" : "");
}

/// What a failed test shows where its evidence rests on a claim of the tracker that is false: the bets need not be fair.
std::string without_proof(const TestRecord& test, Real alpha, const char* claim) {
  if (test.deterministic()) return measured_bias(test);
  return fmt::format("{}, but no bias is proven: the evidence (log E {:.1f} > {:.1f}) rests on {}", measured_bias(test),
                     std::max(test.log_e_fail, test.log_e_beyond), -std::log(alpha), claim);
}

std::string failure(const TestRecord& test, const Proof& proof, Real alpha, const VerdictRecord& verdict) {
  const Real needed = -std::log(alpha);
  if (test.deterministic()) return off(test, verdict);
  if (verdict.against == "difference")
    return fmt::format("the means differ by {:+.3g}, proven (log E {:.1f} > {:.1f})", test.mean_error,
                       std::max(test.log_e_fail, test.log_e_beyond), needed);
  if (rests_on_a_false_variance(test, verdict)) return without_proof(test, alpha, "the stated variance, which is too small");
  if (proof.beyond && !proof.biased)
    return fmt::format("{}; a bias beyond epsilon is proven (log E {:.1f} > {:.1f})", measured_bias(test), test.log_e_beyond,
                       needed);
  return fmt::format("{}; biased{}, proven (log E {:.1f} > {:.1f})", measured_bias(test), proof.beyond ? " beyond epsilon" : "",
                     test.log_e_fail, needed);
}

/// The error that a test excludes where it is within.
Real margin_of(const TestRecord& test) {
  return test.deterministic() ? std::max(test.allowed_error(), test.largest_error) : test.epsilon;
}

/// The largest over tests of means, of all rays or of groups of them, relative to the reference.
Real largest_margin(const VerdictRecord& verdict, bool of_groups) {
  Real largest = 0;
  for (const TestRecord& test : verdict.tests)
    if (test.channel >= 0 && (test.group >= 0) == of_groups && test.reference != 0)
      largest = std::max(largest, margin_of(test) / std::abs(test.reference));
  return largest;
}

/// The test that PASS says least of, relative to its reference; `error` is what is small.
std::string within_text(const std::vector<const TestRecord*>& tests, const char* error) {
  const TestRecord* widest = nullptr;
  const auto relative = [](const TestRecord& test) {
    return test.reference != 0 ? margin_of(test) / std::abs(test.reference) : kInfinity;
  };
  for (const TestRecord* test : tests)
    if (test->group < 0 && (!widest || relative(*test) > relative(*widest))) widest = test;
  if (!widest) return "";
  if (widest->reference == 0) return fmt::format("{} < {:.2g}", error, margin_of(*widest));
  return fmt::format("{} < {:.2g} % of the mean", error, 100 * relative(*widest));
}

void decide_laws(VerdictRecord& verdict) {
  verdict.lawful = verdict.laws.empty() ? Outcome::none : Outcome::pass;
  const Real broken = std::log(static_cast<Real>(verdict.laws_family) / verdict.alpha);
  for (LawRecord& law : verdict.laws) {
    law.outcome = law.log_e >= broken ? Outcome::fail : Outcome::pass;
    if (law.outcome == Outcome::fail) verdict.lawful = Outcome::fail;
  }
}

}  // namespace

Proof proven(const TestRecord& test, Real alpha_fail, Real alpha_pass) {
  const Real to_fail = -std::log(alpha_fail), to_pass = -std::log(alpha_pass);
  const bool precise = test.reference_error <= kReferenceShare * test.epsilon;
  if (test.deterministic()) {
    const bool biased = !test.right() && test.log_e_fail >= to_fail;
    return {.biased = biased,
            .beyond = biased && std::abs(test.mean_error) > test.epsilon + test.allowed_error(),
            .within = precise && (test.right() || test.largest_error <= test.epsilon)};
  }
  return {.biased = test.log_e_fail >= to_fail,
          .beyond = test.log_e_beyond >= to_fail,
          .within = precise && (test.basis == TestBasis::counted || (test.log_e_low >= to_pass && test.log_e_high >= to_pass))};
}

namespace {

/// What the tests of the means found.
struct Found {
  std::size_t means = 0;
  const TestRecord *failed = nullptr, *open = nullptr, *slightly = nullptr;
  std::vector<const TestRecord*> within;
};

/// " (unit: 0 to 1)" of a range by its name.
std::string ends_of(const std::string& range) {
  if (range == to_string(SampleRange::binary)) return " (binary: 0 or 1)";
  if (range == to_string(SampleRange::unit)) return " (unit: 0 to 1)";
  return range == to_string(SampleRange::non_negative) ? " (non_negative: at least 0)" : "";
}

/// The outcome of the means, with its reason or what it proves.
void conclude(VerdictRecord& verdict, const Found& found, const std::vector<std::string>& outputs, const std::string& range) {
  Outcome& outcome = verdict.against == "own mean" ? verdict.own_mean : verdict.unbiased;
  const Real alpha = verdict.alpha / static_cast<Real>(verdict.family);
  const bool drawn_as_planned = verdict.tolerate == Tolerate::epsilon || verdict.samples_per_ray >= verdict.planned;
  const bool one_channel = std::none_of(verdict.tests.begin(), verdict.tests.end(), [&](const TestRecord& test) {
    return test.channel >= 0 && test.channel != verdict.tests.front().channel;
  });
  const auto reason = [&](const TestRecord& test, const std::string& text) {
    verdict.reason = place_of(test, outputs, one_channel) + text;
  };
  if (found.means == 0) {
    outcome = Outcome::none;
  } else if (verdict.violated) {
    outcome = Outcome::violated;
    verdict.reason = "needs a majorant that bounds the extinction, and the extinction exceeds it";
  } else if (verdict.nonfinite > 0) {
    outcome = Outcome::fail;
    verdict.reason = samples_that(verdict.nonfinite, "is", "are") + " not finite";
  } else if (verdict.out_of_range > 0) {
    outcome = Outcome::fail;
    verdict.reason = samples_that(verdict.out_of_range, "lies", "lie") + " outside the declared range" + ends_of(range) +
                     "; if such samples are right, the tracker must declare a wider range";
    if (found.failed)
      verdict.reason += "; " + place_of(*found.failed, outputs, one_channel) + without_proof(*found.failed, alpha, "that range");
  } else if (found.failed) {
    outcome = Outcome::fail;
    reason(*found.failed, failure(*found.failed, proven(*found.failed, alpha, verdict.alpha_pass), alpha, verdict));
  } else if (found.open || !drawn_as_planned) {
    outcome = Outcome::inconclusive;
    // What the plan knew beforehand says more.
    if (verdict.reason.empty() && found.open && found.open->deterministic() && !found.open->right())
      reason(*found.open, off(*found.open, verdict));
    else if (verdict.reason.empty() && found.open)
      reason(*found.open,
             fmt::format("undecided after {} samples a ray; {} were planned", verdict.samples_per_ray, verdict.planned));
    else if (verdict.reason.empty())
      verdict.reason = fmt::format("within epsilon after {} samples a ray, but {} were planned to look for a smaller bias",
                                   verdict.samples_per_ray, verdict.planned);
  } else {
    outcome = Outcome::pass;
    verdict.reason.clear();
    // A mean that the tracker predicts of itself may be biased as it says.
    const char* error = verdict.against == "own mean"     ? "|mean - own mean|"
                        : verdict.against == "difference" ? "|difference of the means|"
                                                          : "|bias|";
    verdict.proves = within_text(found.within, error);
    if (found.slightly)
      verdict.proves += "; a bias is proven: " + place_of(*found.slightly, outputs, one_channel) + measured_bias(*found.slightly);
  }
}

}  // namespace

void decide(VerdictRecord& verdict, const std::vector<std::string>& outputs, const std::string& range) {
  const bool lenient = verdict.tolerate == Tolerate::epsilon;
  const auto outcome_of = [&](const Proof& proof) {
    if (proof.beyond || (proof.biased && !lenient)) return Outcome::fail;
    return proof.within ? Outcome::pass : Outcome::inconclusive;
  };
  verdict.unbiased = verdict.own_mean = verdict.lookups = Outcome::none;
  verdict.biased = verdict.beyond = false;
  verdict.proves.clear();
  const Real alpha = verdict.alpha / static_cast<Real>(verdict.family);
  const Real alpha_lookups = verdict.alpha / static_cast<Real>(verdict.lookups_family);
  Found found;
  for (TestRecord& test : verdict.tests) {
    if (test.channel < 0) {
      test.outcome = verdict.lookups = outcome_of(proven(test, alpha_lookups, verdict.alpha_pass));
      continue;
    }
    ++found.means;
    const Proof proof = proven(test, alpha, verdict.alpha_pass);
    verdict.biased |= proof.biased;
    verdict.beyond |= proof.beyond;
    test.outcome = outcome_of(proof);
    if (test.outcome == Outcome::fail && (!found.failed || test.log_e_fail > found.failed->log_e_fail)) found.failed = &test;
    if (test.outcome == Outcome::inconclusive && !found.open) found.open = &test;
    if (test.outcome == Outcome::pass) found.within.push_back(&test);
    if (test.outcome == Outcome::pass && proof.biased) found.slightly = &test;
  }
  verdict.within = found.means > 0 && found.within.size() == found.means;
  decide_laws(verdict);
  conclude(verdict, found, outputs, range);
}

Real excluded_bias(const VerdictRecord& verdict) { return largest_margin(verdict, false); }
Real excluded_bias_of_groups(const VerdictRecord& verdict) { return largest_margin(verdict, true); }

bool tests_walks(const VerdictRecord& verdict) {
  return std::any_of(verdict.laws.begin(), verdict.laws.end(),
                     [](const LawRecord& law) { return law.name != "replay" && !law.name.starts_with("variance"); });
}

}  // namespace nullmark
