// How often verdicts are wrong, on laws known exactly, and what right ones cost.  The seeds are fixed; NULLMARK_FRESH_SEED=N
// draws other samples.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <numeric>

#include "harness/config/config.h"
#include "harness/sampling/reference_loops.h"
#include "harness/sampling/sampling.h"
#include "harness/sampling/test_plan.h"
#include "harness/testing/run_untimed.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

/// Unoptimised builds and sanitizers take a sample of the sample.
#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
constexpr std::uint64_t kThin = 1;
#else
constexpr std::uint64_t kThin = 20;
#endif

/// A rate counts as above nominal where chance would show as many with less than this probability.
constexpr Real kSurprise = 1e-4;

std::uint64_t fresh_seed() {
  const char* text = std::getenv("NULLMARK_FRESH_SEED");
  return text ? std::strtoull(text, nullptr, 10) : 0;
}

PlainRng stream(std::uint64_t a, std::uint64_t b) { return PlainRng((fresh_seed() << 44) ^ (a << 22) ^ b); }

using Binomial = boost::math::binomial_distribution<Real>;

/// P(X >= count) of Binomial(trials, rate).
Real chance_of_as_many(std::uint64_t trials, std::uint64_t count, Real rate) {
  if (count == 0) return 1;
  return boost::math::cdf(boost::math::complement(Binomial(static_cast<Real>(trials), rate), static_cast<Real>(count) - 1));
}

/// Upper end of the one-sided 95 % Clopper-Pearson interval.
Real upper_bound(std::uint64_t trials, std::uint64_t count) {
  return Binomial::find_upper_bound_on_p(static_cast<Real>(trials), static_cast<Real>(count), 0.05);
}

void expect_not_above(const std::string& what, std::uint64_t trials, std::uint64_t count, Real nominal) {
  std::printf("%-58s %5llu of %6llu = %.5f (at most %.5f; nominal %g)\n", what.c_str(), static_cast<unsigned long long>(count),
              static_cast<unsigned long long>(trials), static_cast<double>(count) / static_cast<double>(trials),
              upper_bound(trials, count), nominal);
  EXPECT_GE(chance_of_as_many(trials, count, nominal), kSurprise) << what;
}

/// A law on finitely many values, drawn in constant time [Walker 1977, Vose 1991]; or a Pareto law.
class Law {
 public:
  explicit Law(std::map<Real, long double> law) : law_(std::move(law)) {
    long double total = 0, mean = 0, square = 0;
    for (const auto& [value, chance] : law_) total += chance;
    for (auto& [value, chance] : law_) mean += (chance /= total) * value;
    for (const auto& [value, chance] : law_) square += chance * (value - mean) * (value - mean);
    mean_ = static_cast<Real>(mean);
    variance_ = static_cast<Real>(square);

    std::vector<long double> share;
    std::vector<std::size_t> poor, rich;
    for (const auto& [value, chance] : law_) {
      share.push_back(chance * static_cast<long double>(law_.size()));
      (share.back() < 1 ? poor : rich).push_back(table_.size());
      table_.push_back({1, value, value});
    }
    while (!poor.empty() && !rich.empty()) {
      const std::size_t i = poor.back(), j = rich.back();
      poor.pop_back();
      table_[i].keep = static_cast<Real>(share[i]);
      table_[i].other = table_[j].own;
      share[j] -= 1 - share[i];
      if (share[j] < 1) {
        rich.pop_back();
        poor.push_back(j);
      }
    }
  }

  /// Density a x^{-a-1} on x >= 1.
  static Law pareto(Real index) {
    Law law({{Real{0}, 1}});
    law.index_ = index;
    law.mean_ = index / (index - 1);
    law.variance_ = index / ((index - 1) * (index - 1) * (index - 2));
    return law;
  }

  Real mean() const { return mean_; }
  Real variance() const { return variance_; }
  Real relative_variance() const { return variance_ / (mean_ * mean_); }
  std::size_t size() const { return table_.size(); }

  Real draw(PlainRng& rng) const {
    const Real u = rng.uniform();
    if (index_ > 0) return std::pow(1 - u, -1 / index_);
    const Real x = u * static_cast<Real>(table_.size());
    const auto i = static_cast<std::size_t>(x);
    const Entry& entry = table_[i];
    return x - static_cast<Real>(i) < entry.keep ? entry.own : entry.other;
  }

  /// The law of the sum of two independent draws.
  Law doubled() const {
    // On a grid, so that sums in another order are the same value.
    constexpr Real kGrid = 0x1p40;
    std::map<Real, long double> sums;
    for (const auto& [a, chance_a] : law_)
      for (const auto& [b, chance_b] : law_) sums[std::round((a + b) * kGrid) / kGrid] += chance_a * chance_b;
    return Law(std::move(sums));
  }

 private:
  struct Entry {
    Real keep, own, other;
  };
  std::map<Real, long double> law_;
  std::vector<Entry> table_;
  Real mean_ = 0, variance_ = 0, index_ = 0;
};

Law coin(Real chance) { return Law({{0, 1 - static_cast<long double>(chance)}, {1, chance}}); }

/// scale factor^N, N of a Poisson law: weights of ratio, weighted and residual tracking in a slab.  Values below `resolution` are
/// replaced by their mean.
Law product(Real scale, Real factor, Real collisions, Real resolution = 0) {
  std::map<Real, long double> law;
  long double chance = std::exp(-static_cast<long double>(collisions)), value = scale, small = 0, small_mean = 0;
  for (int n = 0; n < 150; ++n) {
    if (std::abs(value) >= static_cast<long double>(resolution)) {
      law[static_cast<Real>(value)] += chance;
    } else {
      small += chance;
      small_mean += chance * value;
    }
    chance *= static_cast<long double>(collisions) / (n + 1);
    value *= factor;
  }
  if (small > 0) law[static_cast<Real>(small_mean / small)] += small;
  return Law(law);
}

Law ratio(Real depth, Real resolution = 0) { return product(1, 0.2, 1.25 * depth, resolution); }

/// What a cell of such samples is judged by: the program's own plan, of a scene of which only the number of rays is real.
struct Subject {
  std::vector<Law> rays;
  SampleRange range = SampleRange::unit;
  std::optional<Real> epsilon{};
  std::vector<Real> claimed{};  ///< means; empty: the right ones
  bool lookups = false;         ///< the samples are counts of lookups
  bool constant = false;        ///< every sample is the mean but for its last digits
};

TestPlan test_plan_of(const Subject& subject, std::uint64_t samples_per_ray, const std::optional<Pilot>& pilot = {}) {
  const std::size_t rays = subject.rays.size();
  Scene scene;
  auto built = std::make_shared<BuiltRays>();
  built->world.resize(rays);
  scene.rays = built;
  Cell cell;
  cell.samples_per_ray = samples_per_ray;
  cell.verdict.epsilon = subject.epsilon;
  cell.verdict.max_samples_per_ray = std::uint64_t{1} << 40;
  CellTheory theory;
  Targets targets;
  for (std::size_t ray = 0; ray < rays; ++ray) {
    const Law& law = subject.rays[ray];
    const Real mean = subject.claimed.empty() ? law.mean() : subject.claimed[ray];
    targets.mean.push_back(subject.lookups ? 0.5 : mean);
    targets.error.push_back(targets.mean.back() * 1e-12);
    theory.ray_shift.push_back(0);
    if (!pilot) theory.ray_variance.push_back(subject.constant ? 0 : subject.lookups ? 0.25 : law.variance());
    if (!subject.lookups) continue;
    theory.ray_lookups.push_back(law.mean());
    theory.ray_lookups_variance.push_back(law.variance());
  }
  TestPlan test_plan = plan_tests(cell, scene, targets, subject.range, Guarantee::unbiased, theory, pilot, {});
  if (subject.lookups) std::erase_if(test_plan.tests, [](const MeanTest& test) { return test.channel != MeanTest::kLookups; });
  return test_plan;
}

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
        error = subject_.constant ? mean * (rng_.uniform() - 0.5) * 1e-15 : law.draw(rng_) - mean;
        total_ += error;
        squares_ += error * error;
        largest = std::max(largest, std::abs(error));
      }
      for (std::size_t i = 0; i < test_plan_.tests.size(); ++i) {
        const MeanTest& test = test_plan_.tests[i];
        if (test.group != MeanTest::kAllRays && test.group != test_plan_.group_of[ray]) continue;
        if (test.deterministic)
          evidence_[i].largest_error = std::max(evidence_[i].largest_error, largest);
        else
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
    return variance > 0 && !subject_.constant ? std::erfc(std::abs(total_) / std::sqrt(2 * n * variance)) : 1;
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

/// Whole sweeps without any bias, looked at after every doubling and, to be hard on the levels, to the last sample whatever was
/// decided before.  A sweep with even one FAIL is a false alarm.  On the same samples, what must not be: a z-test of the mean,
/// and Catoni's wealth without its denominator.
TEST(FalseAlarms, SweepsWithoutBiasKeepTheirLevel) {
  struct Entry {
    Subject subject;
    bool pilot = false;
  };
  std::vector<Entry> sweep;
  for (const Named& named : laws()) {
    // The default margin, and margins that the samples suffice for, where bets are high.
    for (const std::optional<Real>& epsilon :
         {std::optional<Real>(), std::optional(margin_for(named.law, kLastLook)), std::optional(margin_for(named.law, 2048))})
      sweep.push_back({{{named.law}, named.range, epsilon}});
    if (named.range != SampleRange::binary && named.law.relative_variance() < 60)
      sweep.push_back({{{named.law}, SampleRange::any_sign, margin_for(named.law, kLastLook)}, true});
  }
  sweep.push_back({{{coin(0.5)}, SampleRange::unit, {}, {}, false, true}});
  // Rays of different means share the pooled bet, and are judged in groups as well.
  for (const SampleRange range : {SampleRange::unit, SampleRange::any_sign}) {
    Subject rays;
    rays.range = range;
    rays.epsilon = 0.15;
    for (int i = 0; i < 16; ++i) rays.rays.push_back(i % 2 ? coin(0.05 * (i + 2)) : ratio(0.2 * (i + 1)));
    sweep.push_back({rays});
  }
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

  const std::uint64_t sweeps = 1000 / kThin;
  constexpr Real kLevels[] = {1e-1, 1e-2};
  std::vector<TestPlan> test_plans;
  std::uint64_t family = 0;
  for (const auto* list : {&sweep, &lookups})
    for (const Entry& entry : *list) {
      const std::uint64_t rays = entry.subject.rays.size();
      test_plans.push_back(
          test_plan_of(entry.subject, kFirstLook / rays, entry.pilot ? std::optional<Pilot>({{1}, {}, 0}) : std::nullopt));
      if (list == &sweep) family += test_plans.back().tests.size();
    }
  std::printf("%zu cells, %llu tests a sweep, looks at %llu to %llu samples\n", sweep.size(),
              static_cast<unsigned long long>(family), static_cast<unsigned long long>(kFirstLook),
              static_cast<unsigned long long>(kLastLook));

  struct Alarms {
    std::uint64_t engine = 0, lookups = 0, naive = 0, no_denominator = 0;
  } alarms[2];
  std::uint64_t single[2] = {}, single_trials = 0;  // alarms of single cells, each judged as if it were alone
  for (std::uint64_t s = 0; s < sweeps; ++s) {
    Alarms seen[2];
    for (std::size_t i = 0; i < test_plans.size(); ++i) {
      const bool counts_lookups = i >= sweep.size();
      const Entry& entry = counts_lookups ? lookups[i - sweep.size()] : sweep[i];
      std::optional<TestPlan> piloted;
      if (entry.pilot)
        piloted = test_plan_of(entry.subject, kFirstLook, pilot_of(entry.subject.rays[0], stream(s + 1, i + 100'000), kLastLook));
      const TestPlan& test_plan = piloted ? *piloted : test_plans[i];
      const std::uint64_t rays = entry.subject.rays.size();
      Trial trial(entry.subject, test_plan, stream(s + 1, i));
      bool failed[2] = {}, failed_alone[2] = {};
      for (std::uint64_t n = kFirstLook; n <= kLastLook; n *= 2) {
        trial.draw((n == kFirstLook ? n : n / 2) / rays);
        for (int level = 0; level < 2; ++level) {
          const Real alpha = kLevels[level];
          const std::uint64_t of = counts_lookups ? lookups.size() : family;
          failed[level] |= outcome_of(trial.verdict(of, alpha, 1e-3)) == Outcome::fail;
          failed_alone[level] |= outcome_of(trial.verdict(test_plan.tests.size(), alpha, 1e-3)) == Outcome::fail;
          if (!counts_lookups && n == kLastLook)
            seen[level].no_denominator += outcome_of(trial.verdict(of, alpha, 1e-3, true)) == Outcome::fail;
        }
      }
      for (int level = 0; level < 2; ++level) {
        (counts_lookups ? seen[level].lookups : seen[level].engine) += failed[level];
        single[level] += failed_alone[level];
        if (!counts_lookups) seen[level].naive += trial.naive_p() < kLevels[level] / static_cast<Real>(family);
      }
      ++single_trials;
    }
    for (int level = 0; level < 2; ++level) {
      alarms[level].engine += seen[level].engine > 0;
      alarms[level].lookups += seen[level].lookups > 0;
      alarms[level].naive += seen[level].naive > 0;
      alarms[level].no_denominator += seen[level].no_denominator > 0;
    }
  }
  for (int level = 0; level < 2; ++level) {
    const Real alpha = kLevels[level];
    expect_not_above(fmt::format("sweeps with a false FAIL, level {:g}", alpha), sweeps, alarms[level].engine, alpha);
    expect_not_above(fmt::format("sweeps with a false FAIL of lookups, level {:g}", alpha), sweeps, alarms[level].lookups, alpha);
    expect_not_above(fmt::format("cells judged alone, level {:g}", alpha), single_trials, single[level], alpha);
    std::printf("  the same samples, z-test of the mean: %llu sweeps; without Catoni's denominator: %llu\n",
                static_cast<unsigned long long>(alarms[level].naive),
                static_cast<unsigned long long>(alarms[level].no_denominator));
    RecordProperty(fmt::format("false_fail_sweeps_{:g}", alpha), static_cast<int>(alarms[level].engine));
    RecordProperty(fmt::format("false_fail_cells_{:g}", alpha), static_cast<int>(single[level]));
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

/// What verdicts cost at the level of a sweep of 400 cells, 1e-4/400 = 2.5e-7.  The program's own schedule: doublings of the
/// first samples up to four times the planned ones.
TEST(FalseAlarms, PowerAndCost) {
  struct Row {
    const char* name;
    Law law;
    SampleRange range;
    std::uint64_t runs_of_thousandth;
  };
  // Few enough values that sums of several have a table.
  constexpr Real kResolution = 1e-4;
  const std::vector<Row> rows = {{"binary T = .5", coin(0.5), SampleRange::binary, 100},
                                 {"binary T = .1", coin(0.1), SampleRange::binary, 20},
                                 {"ratio tau = 1", ratio(1, kResolution), SampleRange::unit, 40},
                                 {"ratio tau = 2", ratio(2, kResolution), SampleRange::unit, 20},
                                 {"ratio tau = 5", ratio(5, kResolution), SampleRange::unit, 3}};
  constexpr std::uint64_t kFirst = 4096, kFamily = 400;
  struct Result {
    std::uint64_t runs = 0, fail = 0, pass = 0;
    Real samples = 0;
  };
  const auto judged = [&](const Row& row, Real epsilon, Real bias, std::uint64_t runs) {
    Subject single{{row.law}, row.range, epsilon, {row.law.mean() / (1 + bias)}};
    const TestPlan test_plan = test_plan_of(single, kFirst);
    // The same test_plan, fed with sums of `together` errors as if each were one.
    const MeanTest& test = test_plan.tests[0];
    int together = 1;
    Law summed = row.law;
    constexpr std::size_t kMostValues = 500;
    while (together < test.sum_lengths[0] && summed.size() < kMostValues) {
      summed = summed.doubled();
      together *= 2;
    }
    const int draws = test.sum_lengths[0] / together;
    const Real mean = single.claimed[0] * together;
    Result result;
    std::vector<Real> sums, longer;
    for (std::uint64_t run = 0; run < std::max<std::uint64_t>(1, runs / kThin); ++run) {
      PlainRng rng = stream(run + 1, 300'000 + static_cast<std::uint64_t>(1e5 * std::abs(bias)));
      Evidence evidence;
      std::uint64_t samples = 0;
      for (Outcome outcome = Outcome::inconclusive; outcome == Outcome::inconclusive && samples < 4 * test_plan.planned;) {
        // As the program draws: doubled up to the plan, then a quarter more each time.
        const std::uint64_t wanted = samples < test_plan.planned ? std::min(samples, test_plan.planned - samples) : samples / 4;
        const std::uint64_t count = samples == 0 ? kFirst : (wanted + 63) / 64 * 64;
        for (std::uint64_t todo = count; todo > 0;) {
          const std::uint64_t now = std::min<std::uint64_t>(todo, 1 << 16);
          todo -= now;
          sums.resize(now / static_cast<std::uint64_t>(test.sum_lengths[0]));
          for (Real& sum : sums) {
            sum = 0;
            for (int i = 0; i < draws; ++i) sum += summed.draw(rng) - mean;
          }
          evidence.bet(test, test.sum_lengths[0], sums);
          for (std::size_t level = 1; level < test.sum_lengths.size(); ++level) {
            const auto of = static_cast<std::size_t>(test.sum_lengths[level] / test.sum_lengths[level - 1]);
            longer.assign(sums.size() / of, 0);
            for (std::size_t i = 0; i < sums.size(); ++i) longer[i / of] += sums[i];
            sums = longer;
            evidence.bet(test, test.sum_lengths[level], sums);
          }
          evidence.errors += now;
        }
        samples += count;
        VerdictRecord verdict;
        verdict.against = test_plan.against;
        verdict.family = kFamily;
        verdict.planned = test_plan.planned;
        verdict.samples_per_ray = samples;
        verdict.tests = {test_record(test, evidence)};
        decide(verdict);
        outcome = verdict.unbiased;
        result.fail += outcome == Outcome::fail;
        result.pass += outcome == Outcome::pass;
      }
      result.samples += static_cast<Real>(samples);
      ++result.runs;
    }
    result.samples /= static_cast<Real>(result.runs);
    return result;
  };
  const auto share = [](std::uint64_t count, std::uint64_t runs) {
    return static_cast<double>(count) / static_cast<double>(runs);
  };
  std::printf(
      "| law | planned, epsilon 1 %% | unbiased: PASS, samples | bias 1 %%: FAIL, samples | bias .1 %%, epsilon .1 %% |\n");
  std::printf("|---|---|---|---|---|\n");
  for (const Row& row : rows) {
    const std::uint64_t runs = row.law.relative_variance() > 20 ? 100 : 400;
    const Result right = judged(row, 1e-2, 0, runs), wrong = judged(row, 1e-2, 1e-2, runs);
    const Result slightly = judged(row, 1e-3, 1e-3, row.runs_of_thousandth);
    const TestPlan test_plan = test_plan_of({{row.law}, row.range, 1e-2}, kFirst);
    std::printf("| %s | %.2g | %.3f, %.2g | %.3f, %.2g | %.3f, %.2g |\n", row.name, static_cast<double>(test_plan.planned),
                share(right.pass, right.runs), right.samples, share(wrong.fail, wrong.runs), wrong.samples,
                share(slightly.fail, slightly.runs), slightly.samples);
    // Planned for more than .95.
    EXPECT_EQ(right.fail, 0u) << row.name;
    EXPECT_EQ(wrong.pass, 0u) << row.name;
    for (const auto& [count, of] : {std::pair(right.pass, right.runs), {wrong.fail, wrong.runs}, {slightly.fail, slightly.runs}})
      EXPECT_GE(chance_of_as_many(of, of - count, 0.05), kSurprise) << row.name;
  }
}

/// Ten thousand cells of the program itself: no bias, so hardly a FAIL.  Streams are each cell's own, so that cells are
/// independent.
TEST(FalseAlarms, TheProgramsOwnCells) {
  const std::uint64_t seeds = 250 / kThin;
  std::string list;
  for (std::uint64_t i = 1; i <= seeds; ++i) list += fmt::format("{}{}", i == 1 ? "" : ",", fresh_seed() * 1'000'000 + i);
  const auto experiment = [&](const char* name, const char* estimators, const char* media, const char* majorants) {
    return fmt::format(R"({{"name":"{}","rays":"single","samples_per_ray":2048,"own_streams":true,
        "verdict":{{"epsilon":0.1,"max_samples_per_ray":8192}},
        "matrix":{{"estimator":[{}],"medium":[{}],"majorant":[{}],"seed":[{}]}},"zip":[["medium","majorant"]]}})",
                       name, estimators, media, majorants, list);
  };
  const std::string bounded = experiment(
      "bounded",
      R"("delta","ratio","residual_delta","next_flight_ratio",{"type":"next_flight_delta","variant":["a","b"]},{"type":"residual_ratio","control":"average"})",
      R"({"type":"homogeneous","extinction":1},{"type":"linear","optical_depth":2},{"type":"exponential","optical_depth":5},
         {"type":"layers","optical_depth":1},{"type":"gaussian_bump","optical_depth":0.5})",
      R"({"type":"global","looseness":1.25},{"type":"global","looseness":1.5},{"type":"global","looseness":1.1},
         {"type":"grid","resolution":4},{"type":"global","looseness":3})");
  // Weights of any sign and heavy tails.
  const std::string unbounded =
      experiment("unbounded", R"("ratio","next_flight_ratio",{"type":"residual_ratio","control":"average"})",
                 R"({"type":"homogeneous","extinction":2},{"type":"cosine","optical_depth":1})",
                 R"({"type":"global","looseness":0.4},{"type":"global","looseness":0.5})");
  const Plan plan = read_config(
      fmt::format(R"({{"nullmark":"config/2","timing":{{"enabled":false}},"error_rates":{{"alpha":0.1}},"experiments":[{},{}]}})",
                  bounded, unbounded),
      "false_alarms.json");
  const std::vector<CellRecord> records = run_untimed(plan);

  constexpr Real kAlone = 1e-2;  // the level of a cell judged alone, at which alarms are frequent enough to be counted
  std::uint64_t cells = 0, fails = 0, passes = 0, means = 0, mean_alarms = 0, lookups = 0, lookup_alarms = 0;
  std::uint64_t lawful = 0, law_alarms = 0;  // cells whose walks were tested as well
  for (const CellRecord& record : records) {
    ASSERT_EQ(record.status, Status::ok) << record.cell.name << ": " << record.reason;
    if (!record.verdict) continue;
    const VerdictRecord& verdict = *record.verdict;
    ++cells;
    if (verdict.unbiased == Outcome::fail || verdict.lookups == Outcome::fail || verdict.lawful == Outcome::fail) {
      ++fails;
      std::printf("FAIL %s: %s\n", record.cell.name.c_str(), verdict.reason.c_str());
    }
    passes += verdict.unbiased == Outcome::pass;
    if (tests_walks(verdict)) {
      const Real needed = std::log(static_cast<Real>(verdict.laws.size()) / kAlone);
      ++lawful;
      law_alarms +=
          std::any_of(verdict.laws.begin(), verdict.laws.end(), [&](const LawRecord& law) { return law.log_e >= needed; });
    }
    for (const TestRecord& test : verdict.tests) {
      if (test.deterministic()) continue;
      const bool alarm = test.log_e_fail >= -std::log(kAlone);
      ++(test.channel < 0 ? lookups : means);
      (test.channel < 0 ? lookup_alarms : mean_alarms) += alarm;
    }
  }
  std::printf("%llu cells, %llu PASS\n", static_cast<unsigned long long>(cells), static_cast<unsigned long long>(passes));
  EXPECT_GE(cells, 10'000 / kThin);
  EXPECT_GT(passes, cells / 4);
  // Means, lookups and laws are a family each, at .1.
  expect_not_above("cells with a false FAIL", cells, fails, 0.3 / static_cast<Real>(cells));
  expect_not_above("means judged alone, level 1e-2", means, mean_alarms, kAlone);
  expect_not_above("lookups judged alone, level 1e-2", lookups, lookup_alarms, kAlone);
  expect_not_above("cells' laws judged alone, level 1e-2", lawful, law_alarms, kAlone);
  RecordProperty("cells", static_cast<int>(cells));
  RecordProperty("false_fail", static_cast<int>(fails));
  RecordProperty("mean_alarms_alone", static_cast<int>(mean_alarms));
}

}  // namespace
}  // namespace nullmark
