// FAILs of what is right and PASSes of what is not, on laws known exactly.

#include "harness/verdict/false_alarms_test.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <optional>
#include <vector>

#include "harness/sampling/test_evidence.h"
#include "harness/verdict/known_laws_test.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

using namespace false_alarms_test;

/// A cell under judgement.
class Trial {
 public:
  Trial(const Subject& subject, const TestPlan& test_plan, PlainRng rng)
      : subject_(subject), test_plan_(test_plan), rng_(rng), evidence_(test_plan.tests.size()) {}

  /// `count` further samples of every ray.
  void draw(std::uint64_t count) {
    errors_.resize(count);
    for (std::size_t ray = 0; ray < subject_.rays.size(); ++ray) {
      Real largest = 0;
      const Law& law = subject_.rays[ray];
      const Real mean = subject_.claimed.empty() ? law.mean() : subject_.claimed[ray];
      for (Real& error : errors_) {
        error = subject_.spread > 0 ? mean * (2 * rng_.uniform() - 1) * subject_.spread : law.draw(rng_) - mean;
        total_ += error;
        squares_ += error * error;
        largest = std::max(largest, std::abs(error));
      }
      for (std::size_t i = 0; i < test_plan_.tests.size(); ++i) {
        const MeanTest& test = test_plan_.tests[i];
        if (test.group != MeanTest::kAllRays && test.group != test_plan_.group_of[ray]) continue;
        if (test.deterministic) evidence_[i].largest_error = std::max(evidence_[i].largest_error, largest);
        add(evidence_[i], test);
      }
    }
    samples_ += count;
  }

  VerdictRecord verdict(std::uint64_t family, Real alpha, Real alpha_pass, bool forget_denominators = false) const {
    VerdictRecord verdict;
    verdict.against = test_plan_.against;
    verdict.samples_per_ray = samples_;
    verdict.family = verdict.lookups_family = family;
    verdict.alpha = alpha;
    verdict.alpha_pass = alpha_pass;
    for (std::size_t i = 0; i < test_plan_.tests.size(); ++i) {
      MeanTest test = test_plan_.tests[i];
      if (forget_denominators)
        for (auto& [role, bet] : test.bets) bet.variance = 0;
      verdict.tests.push_back(test_record(test, evidence_[i]));
    }
    decide(verdict);
    return verdict;
  }

  /// Two-sided p-value of the mean over the sample's own standard error; 1 where all samples are the same.
  Real naive_p() const {
    const auto n = static_cast<Real>(samples_ * subject_.rays.size());
    const Real variance = (squares_ - total_ * total_ / n) / (n - 1);
    return variance > 0 ? std::erfc(std::abs(total_) / std::sqrt(2 * n * variance)) : 1;
  }

  std::uint64_t samples() const { return samples_; }

 private:
  void add(Evidence& evidence, const MeanTest& test) {
    for (const int length : test.sum_lengths) evidence.bet(test, length, sums(static_cast<std::size_t>(length)));
    evidence.errors += errors_.size();
    for (const Real error : errors_) evidence.total_error += error;
  }

  /// Of so many consecutive errors each.
  const std::vector<Real>& sums(std::size_t together) {
    sums_.assign(errors_.size() / together, 0);
    for (std::size_t i = 0; i < sums_.size() * together; ++i) sums_[i / together] += errors_[i];
    return sums_;
  }

  const Subject& subject_;
  const TestPlan& test_plan_;
  PlainRng rng_;
  std::vector<Evidence> evidence_;
  std::vector<Real> errors_, sums_;
  Real total_ = 0, squares_ = 0;
  std::uint64_t samples_ = 0;
};

Outcome outcome_of(const VerdictRecord& verdict) { return verdict.lookups == Outcome::fail ? Outcome::fail : verdict.unbiased; }

struct Named {
  const char* name;
  Law law;
  SampleRange range;
};

std::vector<Named> laws() {
  using enum SampleRange;
  return {{"binary .5", coin(0.5), SampleRange::binary},
          {"binary .1", coin(0.1), SampleRange::binary},
          {"binary .01", coin(0.01), SampleRange::binary},
          {"ratio 1", ratio(1), unit},
          {"ratio 2", ratio(2), unit},
          {"ratio 5", ratio(5), unit},
          {"ratio 20", ratio(20), unit},
          {"ratio 1, no range", ratio(1), any_sign},
          {"ratio 2, no upper end", ratio(2), non_negative},
          {"ratio 5, no range", ratio(5), any_sign},
          // Control depths 4 and 6 over a depth of 2: the residual is negative, the weight grows.
          {"residual 4, factor 3", product(std::exp(-4.), 3, 1), non_negative},
          {"residual 6, factor 3", product(std::exp(-6.), 3, 2), non_negative},
          {"residual 4, no range", product(std::exp(-4.), 3, 1), any_sign},
          {"weighted, factor -1.5", product(1, -1.5, 0.8), any_sign},
          {"weighted, factor -3", product(1, -3, 1), any_sign},
          {"Pareto 2.1", Law::pareto(2.1), non_negative},
          {"Pareto 2.1, no range", Law::pareto(2.1), any_sign}};
}

/// Relative margin at which `samples` are about what PASS takes.
Real margin_for(const Law& law, std::uint64_t samples) {
  return std::min(1., 5 * std::sqrt(law.relative_variance() / static_cast<Real>(samples)));
}

constexpr std::uint64_t kFirstLook = 256, kLastLook = 16384;

/// Variance and its guard from a pilot of as many samples.
Pilot pilot_of(const Law& law, PlainRng rng, std::uint64_t samples) {
  const auto n = static_cast<Real>(samples);
  std::vector<Real> values(samples);
  for (Real& value : values) value = law.draw(rng);
  const Real mean = std::accumulate(values.begin(), values.end(), Real{0}) / n;
  Real second = 0, fourth = 0;
  for (const Real value : values) {
    const Real square = (value - mean) * (value - mean);
    second += square;
    fourth += square * square;
  }
  Pilot pilot;
  pilot.variance = {second / (n - 1)};
  pilot.variance_of_variance = second > 0 ? fourth / (second * second) - 1 / n : 1;
  return pilot;
}

/// A cell of a sweep.
struct Entry {
  Subject subject;
  bool pilot = false;  ///< whether a pilot tells its variance
};

std::vector<Entry> unbiased_cells() {
  std::vector<Entry> sweep;
  for (const Named& named : laws()) {
    // The default margin, and margins that the samples suffice for, where bets are high.
    for (const std::optional<Real>& epsilon :
         {std::optional<Real>(), std::optional(margin_for(named.law, kLastLook)), std::optional(margin_for(named.law, 2048))})
      sweep.push_back({{{named.law}, named.range, epsilon}});
    if (named.range != SampleRange::binary && named.law.relative_variance() < 60)
      sweep.push_back({{{named.law}, SampleRange::any_sign, margin_for(named.law, kLastLook)}, true});
  }
  constexpr Real kRoundingOnly = 5e-16;
  sweep.push_back({{{coin(0.5)}, SampleRange::unit, {}, {}, false, kRoundingOnly}});
  // Rays of different means share the pooled bet, and are judged in groups as well.
  for (const SampleRange range : {SampleRange::unit, SampleRange::any_sign}) {
    Subject rays;
    rays.range = range;
    rays.epsilon = 0.15;
    for (int i = 0; i < 16; ++i) rays.rays.push_back(i % 2 ? coin(0.05 * (i + 2)) : ratio(0.2 * (i + 1)));
    sweep.push_back({rays});
  }
  // Theory that cancels to 0, up to where the variance is 1e-12 of the squared mean.
  for (const Real spread : {1e-9, 1e-7, std::sqrt(3.) * 1e-6})
    for (const SampleRange range : {SampleRange::unit, SampleRange::any_sign})
      sweep.push_back({{{coin(0.5)}, range, {}, {}, false, spread}});
  return sweep;
}

/// Cells whose samples are lookups, in numbers that follow a Poisson law.
std::vector<Entry> unbiased_lookups() {
  std::vector<Entry> lookups;
  for (const Real depth : {0.1, 2., 20.}) {
    std::map<Real, long double> counts;
    long double chance = std::exp(-static_cast<long double>(depth));
    for (int n = 0; n < 150; ++n) {
      counts[n] = chance;
      chance *= static_cast<long double>(depth) / (n + 1);
    }
    lookups.push_back({{{Law(counts)}, SampleRange::unit, {}, {}, true}});
  }
  return lookups;
}

constexpr std::size_t kLevelCount = 2;
constexpr Real kLevels[kLevelCount] = {1e-1, 1e-2};

/// False FAILs at one level: of the program's verdicts, of those of lookups, and of what must not be.
struct Alarms {
  std::uint64_t engine = 0, lookups = 0, naive = 0, no_denominator = 0;
  std::uint64_t alone = 0;  ///< of single cells, each judged as if it were alone
};

/// Cells without any bias, and their plans.
class Sweep {
 public:
  Sweep() {
    for (const auto* list : {&cells_, &lookups_})
      for (const Entry& entry : *list) {
        const std::uint64_t rays = entry.subject.rays.size();
        test_plans_.push_back(
            test_plan_of(entry.subject, kFirstLook / rays, entry.pilot ? std::optional<Pilot>({{1}, {}, 0}) : std::nullopt));
        if (list == &cells_) family_ += test_plans_.back().tests.size();
      }
    std::printf("%zu cells, %llu tests a sweep, looks at %llu to %llu samples\n", cells_.size(),
                static_cast<unsigned long long>(family_), static_cast<unsigned long long>(kFirstLook),
                static_cast<unsigned long long>(kLastLook));
  }

  std::size_t size() const { return test_plans_.size(); }

  /// Numbers of cells that show a false alarm in sweep `s`, by level.
  std::array<Alarms, kLevelCount> alarms(std::uint64_t s) const {
    std::array<Alarms, kLevelCount> seen;
    for (std::size_t i = 0; i < test_plans_.size(); ++i) judge(s, i, seen);
    return seen;
  }

 private:
  void judge(std::uint64_t s, std::size_t i, std::array<Alarms, kLevelCount>& seen) const {
    const bool counts_lookups = i >= cells_.size();
    const Entry& entry = counts_lookups ? lookups_[i - cells_.size()] : cells_[i];
    std::optional<TestPlan> piloted;
    if (entry.pilot)
      piloted = test_plan_of(entry.subject, kFirstLook, pilot_of(entry.subject.rays[0], stream(s + 1, i + 100'000), kLastLook));
    const TestPlan& test_plan = piloted ? *piloted : test_plans_[i];
    const std::uint64_t rays = entry.subject.rays.size();
    Trial trial(entry.subject, test_plan, stream(s + 1, i));
    bool failed[kLevelCount] = {}, failed_alone[kLevelCount] = {};
    for (std::uint64_t n = kFirstLook; n <= kLastLook; n *= 2) {
      trial.draw((n == kFirstLook ? n : n / 2) / rays);
      for (std::size_t level = 0; level < kLevelCount; ++level) {
        const Real alpha = kLevels[level];
        const std::uint64_t of = counts_lookups ? lookups_.size() : family_;
        failed[level] |= outcome_of(trial.verdict(of, alpha, 1e-3)) == Outcome::fail;
        failed_alone[level] |= outcome_of(trial.verdict(test_plan.tests.size(), alpha, 1e-3)) == Outcome::fail;
        if (!counts_lookups && n == kLastLook)
          seen[level].no_denominator += outcome_of(trial.verdict(of, alpha, 1e-3, true)) == Outcome::fail;
      }
    }
    for (std::size_t level = 0; level < kLevelCount; ++level) {
      (counts_lookups ? seen[level].lookups : seen[level].engine) += failed[level];
      seen[level].alone += failed_alone[level];
      if (!counts_lookups) seen[level].naive += trial.naive_p() < kLevels[level] / static_cast<Real>(family_);
    }
  }

  const std::vector<Entry> cells_ = unbiased_cells(), lookups_ = unbiased_lookups();
  std::vector<TestPlan> test_plans_;
  std::uint64_t family_ = 0;
};

/// Whole sweeps without any bias, looked at after every doubling and, to be hard on the levels, to the last sample whatever was
/// decided before.  A sweep with even one FAIL is a false alarm.  On the same samples, what must not be: a z-test of the mean,
/// and Catoni's wealth without its denominator.
TEST(FalseAlarms, SweepsWithoutBiasKeepTheirLevel) {
  const Sweep sweep;
  const std::uint64_t sweeps = 1000 / kThin;
  std::array<Alarms, kLevelCount> alarms;
  for (std::uint64_t s = 0; s < sweeps; ++s) {
    const std::array<Alarms, kLevelCount> seen = sweep.alarms(s);
    for (std::size_t level = 0; level < kLevelCount; ++level) {
      alarms[level].engine += seen[level].engine > 0;
      alarms[level].lookups += seen[level].lookups > 0;
      alarms[level].naive += seen[level].naive > 0;
      alarms[level].no_denominator += seen[level].no_denominator > 0;
      alarms[level].alone += seen[level].alone;
    }
  }
  for (std::size_t level = 0; level < kLevelCount; ++level) {
    const Real alpha = kLevels[level];
    expect_not_above(fmt::format("sweeps with a false FAIL, level {:g}", alpha), sweeps, alarms[level].engine, alpha);
    expect_not_above(fmt::format("sweeps with a false FAIL of lookups, level {:g}", alpha), sweeps, alarms[level].lookups, alpha);
    expect_not_above(fmt::format("cells judged alone, level {:g}", alpha), sweeps * sweep.size(), alarms[level].alone, alpha);
    std::printf("  the same samples, z-test of the mean: %llu sweeps; without Catoni's denominator: %llu\n",
                static_cast<unsigned long long>(alarms[level].naive),
                static_cast<unsigned long long>(alarms[level].no_denominator));
    RecordProperty(fmt::format("false_fail_sweeps_{:g}", alpha), static_cast<int>(alarms[level].engine));
    RecordProperty(fmt::format("false_fail_cells_{:g}", alpha), static_cast<int>(alarms[level].alone));
    // This test can fail.
    EXPECT_LT(chance_of_as_many(sweeps, alarms[level].naive, alpha), kSurprise);
    EXPECT_LT(chance_of_as_many(sweeps, alarms[level].no_denominator, alpha), kSurprise);
  }
}

/// A bias of exactly the margin must not pass more often than its level, looked at after every doubling.
TEST(FalseAlarms, ABiasOfTheMarginHardlyPasses) {
  constexpr Real kLevel = 1e-2;
  const std::uint64_t runs = 1000 / kThin;
  constexpr std::uint64_t kPlanned = 4096;
  std::uint64_t all = 0, all_runs = 0;
  for (const Named& named : laws()) {
    for (const int side : {-1, 1}) {
      Subject subject{{named.law}, named.range};
      const Real margin = std::min(0.9, margin_for(named.law, kPlanned));
      subject.epsilon = margin;
      subject.claimed = {named.law.mean() / (1 + side * margin)};
      const TestPlan test_plan = test_plan_of(subject, kFirstLook);
      std::uint64_t passed = 0;
      for (std::uint64_t run = 0; run < runs; ++run) {
        Trial trial(subject, test_plan, stream(run + 1, 200'000 + all_runs));
        bool pass = false;
        for (std::uint64_t n = kFirstLook; n <= kLastLook; n *= 2) {
          trial.draw(n == kFirstLook ? n : n / 2);
          // No FAIL forestalls the PASS.
          pass |= outcome_of(trial.verdict(1, 1e-300, kLevel)) == Outcome::pass;
        }
        passed += pass;
      }
      all += passed;
      all_runs += runs;
      expect_not_above(fmt::format("PASS of {}, bias {:+.3g}", named.name, side * margin), runs, passed, kLevel);
    }
  }
  expect_not_above("PASS at a bias of the margin, all laws", all_runs, all, kLevel);
  RecordProperty("false_pass", static_cast<int>(all));
}

}  // namespace
}  // namespace nullmark
