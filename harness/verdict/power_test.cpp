// What right verdicts cost, on laws known exactly.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>
#include <vector>

#include "harness/sampling/test_evidence.h"
#include "harness/verdict/false_alarms_test.h"
#include "harness/verdict/known_laws_test.h"
#include "harness/verdict/verdict.h"

namespace nullmark {
namespace {

using namespace false_alarms_test;

constexpr std::uint64_t kFirst = 4096, kFamily = 400;

struct Row {
  const char* name;
  Law law;
  SampleRange range;
  std::uint64_t runs_of_thousandth;
};

std::vector<Row> rows() {
  // Few enough values that sums of several have a table.
  constexpr Real kResolution = 1e-4;
  return {{"binary T = .5", coin(0.5), SampleRange::binary, 30},
          {"binary T = .1", coin(0.1), SampleRange::binary, 10},
          {"ratio tau = 1", ratio(1, kResolution), SampleRange::unit, 15},
          {"ratio tau = 2", ratio(2, kResolution), SampleRange::unit, 10},
          {"ratio tau = 5", ratio(5, kResolution), SampleRange::unit, 3}};
}

/// Sums of `length` errors against a claimed mean, drawn from a table of the law of sums where that is small enough.
class SummedErrors {
 public:
  SummedErrors(const Law& law, Real claimed, int length) : summed_(law) {
    int together = 1;
    constexpr std::size_t kMostValues = 500;
    while (together < length && summed_.size() < kMostValues) {
      summed_ = summed_.doubled();
      together *= 2;
    }
    draws_ = length / together;
    mean_ = claimed * together;
  }

  Real draw(PlainRng& rng) const {
    Real sum = 0;
    for (int i = 0; i < draws_; ++i) sum += summed_.draw(rng) - mean_;
    return sum;
  }

 private:
  Law summed_;
  int draws_ = 0;
  Real mean_ = 0;
};

/// Bets on `count` further samples, in sums as the test plans them.
void bet(Evidence& evidence, const MeanTest& test, const SummedErrors& errors, std::uint64_t count, PlainRng& rng) {
  std::vector<Real> sums, longer;
  for (std::uint64_t todo = count; todo > 0;) {
    const std::uint64_t now = std::min<std::uint64_t>(todo, 1 << 16);
    todo -= now;
    sums.resize(now / static_cast<std::uint64_t>(test.sum_lengths[0]));
    for (Real& sum : sums) sum = errors.draw(rng);
    evidence.bet(test, test.sum_lengths[0], sums);
    for (std::size_t level = 1; level < test.sum_lengths.size(); ++level) {
      const auto of = static_cast<std::size_t>(test.sum_lengths[level] / test.sum_lengths[level - 1]);
      longer.clear();
      for (auto sum = sums.begin(); sum != sums.end(); sum += static_cast<std::ptrdiff_t>(of))
        longer.push_back(std::accumulate(sum, sum + static_cast<std::ptrdiff_t>(of), Real{0}));
      sums = longer;
      evidence.bet(test, test.sum_lengths[level], sums);
    }
    evidence.errors += now;
  }
}

VerdictRecord verdict_of(const TestPlan& test_plan, const Evidence& evidence, std::uint64_t samples) {
  VerdictRecord verdict;
  verdict.against = test_plan.against;
  verdict.family = kFamily;
  verdict.planned = test_plan.planned;
  verdict.samples_per_ray = samples;
  verdict.tests = {test_record(test_plan.tests[0], evidence)};
  decide(verdict);
  return verdict;
}

struct Result {
  std::uint64_t runs = 0, fail = 0, pass = 0;
  Real samples = 0;  ///< of a run, on average
};

Result judged(const Row& row, Real epsilon, Real bias, std::uint64_t runs) {
  Subject single{{row.law}, row.range, epsilon, {row.law.mean() / (1 + bias)}};
  const TestPlan test_plan = test_plan_of(single, kFirst);
  const MeanTest& test = test_plan.tests[0];
  const SummedErrors errors(row.law, single.claimed[0], test.sum_lengths[0]);
  Result result;
  for (std::uint64_t run = 0; run < std::max<std::uint64_t>(1, runs / kThin); ++run) {
    PlainRng rng = stream(run + 1, 300'000 + static_cast<std::uint64_t>(1e5 * std::abs(bias)));
    Evidence evidence;
    std::uint64_t samples = 0;
    for (Outcome outcome = Outcome::inconclusive; outcome == Outcome::inconclusive && samples < 4 * test_plan.planned;) {
      // As the program draws: doubled up to the plan, then a quarter more each time.
      const std::uint64_t wanted = samples < test_plan.planned ? std::min(samples, test_plan.planned - samples) : samples / 4;
      const std::uint64_t count = samples == 0 ? kFirst : (wanted + 63) / 64 * 64;
      bet(evidence, test, errors, count, rng);
      samples += count;
      outcome = verdict_of(test_plan, evidence, samples).unbiased;
      result.fail += outcome == Outcome::fail;
      result.pass += outcome == Outcome::pass;
    }
    result.samples += static_cast<Real>(samples);
    ++result.runs;
  }
  result.samples /= static_cast<Real>(result.runs);
  return result;
}

/// What verdicts cost at the level of a sweep of 400 cells, 1e-4/400 = 2.5e-7.  The program's own schedule: doublings of the
/// first samples up to four times the planned ones.
TEST(FalseAlarms, PowerAndCost) {
  const auto share = [](std::uint64_t count, std::uint64_t runs) {
    return static_cast<double>(count) / static_cast<double>(runs);
  };
  std::printf(
      "| law | planned, epsilon 1 %% | unbiased: PASS, samples | bias 1 %%: FAIL, samples | bias .1 %%, epsilon .1 %% |\n");
  std::printf("|---|---|---|---|---|\n");
  for (const Row& row : rows()) {
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

}  // namespace
}  // namespace nullmark
