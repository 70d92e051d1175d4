#include "harness/sampling/test_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

#include "harness/kernel/given_samples.h"
#include "harness/sampling/margins.h"

namespace nullmark {
namespace {

/// Of epsilon, what rounding may take of a sample.
constexpr Real kNoBias = 1e-9;

/// Where the standard deviation is a millionth of rounding, no sample in 10^12 shows it, whatever its law [Chebyshev].
constexpr Real kSurely = 1e-12;

/// Of the squared mean, what theory may be wrong by where it states no variance: E[X^2] - T^2 has no more digits than E[X^2].
/// Then an error of a thousandth of the mean comes at most once in 10^6 samples [Chebyshev].
constexpr Real kStatedDigits = 1e-12, kNoNoise = 1e-3;

/// A pilot variance is trusted for unbounded samples only below this variance of the variance.
constexpr Real kTrustedVariance = 0.02;

/// A pilot's variance of lookups is trusted from so many samples, and so many lookups among them, on: flights are at most as
/// heavy in the tail as an exponential (variance of the variance 8/n), and lookups that are rare as a Poisson number (1/lookups).
constexpr std::uint64_t kTellingLookups = 400;

/// Margin of the groups over that of all rays: as many standard errors as in the pooled test.
const Real kGroupMargin = std::sqrt(static_cast<Real>(kRayGroups));

/// What the rays of one test have in common.
struct Pool {
  Real mean = 0, variance = 0, reference_error = 0, least = kInfinity, most = -kInfinity;
  Real size = 0;  ///< mean of what margins are relative to: the mean itself, or of the samples that a difference is of
  Real largest = 0;
  std::size_t rays = 0;
};

/// Normal quantile of the chance at which a test is planned; the chance that a test of the whole configuration stays undecided
/// where a decision counts as sure.
constexpr Real kPlannedPower = 1.645, kUnsure = 1e-3;

std::uint64_t per_ray(Real samples, std::size_t rays) {
  const Real each = std::ceil(samples / static_cast<Real>(rays));
  return each < 9e15 ? static_cast<std::uint64_t>(each) : std::uint64_t{1} << 53;
}

/// The fewest samples of which so many are judged, and the others the pilot's.
std::uint64_t with_a_pilot(std::uint64_t judged) {
  std::uint64_t samples = judged;
  while (split_samples(samples).judged < judged) samples += judged - split_samples(samples).judged;
  return samples;
}

std::uint64_t largest_power_of_two_divisor(std::uint64_t n) { return n & (~n + 1); }

}  // namespace

std::vector<int> ray_groups(const BuiltRays& rays) {
  const std::size_t n = rays.world.size();
  std::vector<int> groups(n, 0);
  if (n < static_cast<std::size_t>(kRayGroups)) return groups;
  constexpr std::size_t kTiles = 4;
  static_assert(kTiles * kTiles == kRayGroups);
  const auto width = static_cast<std::size_t>(rays.width), height = static_cast<std::size_t>(rays.height);
  const bool tiles = width >= kTiles && height >= kTiles;
  for (std::size_t r = 0; r < n; ++r)
    groups[r] = static_cast<int>(tiles ? r / width * kTiles / height * kTiles + r % width * kTiles / width : r * kRayGroups / n);
  return groups;
}

void MeanTest::place(std::vector<std::pair<Role, Bet>> placed) {
  bets = std::move(placed);
  basis = basis_of(bets);
  sum_lengths.clear();
  for (const auto& [role, bet] : bets) sum_lengths.push_back(bet.errors_per_sum);
  std::sort(sum_lengths.begin(), sum_lengths.end());
  sum_lengths.erase(std::unique(sum_lengths.begin(), sum_lengths.end()), sum_lengths.end());
  if (sum_lengths.empty()) sum_lengths.push_back(1);
}

namespace {

/// Plans the tests of one cell.
class TestPlanner {
 public:
  TestPlanner(const Cell& cell, const Scene& scene, const Targets& targets, Guarantee claim, const CellTheory& theory,
              const std::optional<Pilot>& pilot, const TestLevels& levels)
      : cell_(cell), targets_(targets), theory_(theory), pilot_(pilot), levels_(levels), rays_(scene.rays->world.size()) {
    const bool own_mean = claim == Guarantee::consistent || claim == Guarantee::biased;
    plan_.against = own_mean ? "own mean" : cell.minus ? "difference" : "reference";
    plan_.group_of = ray_groups(*scene.rays);
    plan_.shift.assign(rays_ * targets.outputs, 0);
    if (own_mean && !theory.ray_shift.empty()) plan_.shift = theory.ray_shift;
    analytic_ = !theory.ray_variance.empty();
    plan_.variance_basis = analytic_ ? "analytic" : pilot ? "pilot" : "none";
    // A free path is drawn, whatever its law is known by.
    exact_ = claim == Guarantee::exact && cell.quantity != Quantity::free_path && cell.quantity != Quantity::radiance;
    most_per_sum_ = static_cast<int>(std::min<std::uint64_t>(64, largest_power_of_two_divisor(cell.samples_per_ray)));
    plan_.longest_sum = static_cast<std::uint64_t>(most_per_sum_);
    mean_lookups_ = theory.lookups.value_or(pilot && pilot->samples > 0
                                                ? static_cast<Real>(pilot->lookups) / static_cast<Real>(pilot->samples)
                                                : theory.majorant_depth);
  }

  TestPlan plan(SampleRange range, bool bounding) {
    state_range(range, bounding);
    advise(range, bounding);
    allow();
    if (!analytic_ && !pilot_ && !exact_) return std::move(plan_);
    for (std::size_t o = 0; o < targets_.outputs; ++o) add_means(o);
    judge_plan();
    add_lookups();
    add_variances(range, bounding);
    return std::move(plan_);
  }

 private:
  /// Where the majorant does not bound, ranges that rest on it are not claimed.
  void state_range(SampleRange range, bool bounding) {
    if (cell_.quantity == Quantity::optical_depth || (!bounding && range != SampleRange::binary)) range = SampleRange::any_sign;
    if (range != SampleRange::any_sign) plan_.low = 0;
    if (range == SampleRange::binary || range == SampleRange::unit) plan_.high = 1;
    if (cell_.minus && plan_.high == 1) plan_.low = -1;
  }

  /// What of a range would help here.
  void advise(SampleRange range, bool bounding) {
    if (cell_.quantity == Quantity::optical_depth)
      advice_ = "the tracker could state the variance of its samples (theory)";
    else if (!bounding)
      advice_ =
          "a range of the samples holds only under a majorant that is known to bound the extinction: give one, or the tracker "
          "could state the variance of its samples (theory)";
    else if (range == SampleRange::non_negative)
      advice_ =
          "the tracker could state a range that is bounded above (kRange; in other languages: range), the variance of its "
          "samples (theory)";
    else
      advice_ = "the tracker could state a range of its samples (kRange; in other languages: range), their variance (theory)";
    advice_ += ", or the guarantee \"exact\"";
  }

  /// What the configuration lets a ray cost.
  void allow() {
    const std::uint64_t n = cell_.samples_per_ray, most = std::max(n, cell_.verdict.max_samples_per_ray);
    plan_.affordable = most;
    plan_.allowance = cell_.verdict.max_samples_per_ray == 0 ? kMostSampleFactor * n : most;
    if (!cell_.verdict.max_lookups_per_ray || !(mean_lookups_ > 0)) return;
    const auto paid = static_cast<std::uint64_t>(std::min<Real>(9e15, *cell_.verdict.max_lookups_per_ray / mean_lookups_));
    plan_.affordable = std::max(n, std::min(most, paid));
    plan_.allowance = std::max(n, std::min(plan_.allowance, paid));
  }

  /// A pilot's variance is trusted for bets that rest on it where samples have no range and their variance showed no heavy tail.
  ErrorLaw::Basis basis() const {
    if (analytic_) return ErrorLaw::Basis::analytic;
    const bool trusted = pilot_ && !theory_.infinite_variance && pilot_->variance_of_variance < kTrustedVariance;
    return trusted ? ErrorLaw::Basis::pilot : ErrorLaw::Basis::none;
  }

  /// Over all rays, then over each group of them.
  std::vector<Pool> pools(std::size_t output) const {
    std::vector<Pool> pools(rays_ < static_cast<std::size_t>(kRayGroups) ? 1 : 1 + kRayGroups);
    for (std::size_t ray = 0; ray < rays_; ++ray) {
      const std::size_t at = ray * targets_.outputs + output;
      const Real mean = targets_.mean[at] + plan_.shift[at], size = targets_.size.empty() ? mean : targets_.size[at];
      const auto add = [&](Pool& pool) {
        ++pool.rays;
        pool.mean += mean;
        pool.size += size;
        pool.largest = std::max(pool.largest, std::abs(size));
        pool.variance += analytic_ ? theory_.ray_variance[at] : pilot_ ? pilot_->variance[at] : 0;
        pool.reference_error += targets_.error[at];
        pool.least = std::min(pool.least, mean);
        pool.most = std::max(pool.most, mean);
      };
      add(pools[0]);
      if (pools.size() > 1) add(pools[static_cast<std::size_t>(plan_.group_of[ray]) + 1]);
    }
    for (Pool& pool : pools) pool.mean /= static_cast<Real>(pool.rays);
    for (Pool& pool : pools) pool.size /= static_cast<Real>(pool.rays);
    return pools;
  }

  void add_means(std::size_t output) {
    const std::vector<Pool> pools = this->pools(output);
    // Two trackers that are within epsilon of the truth are within twice that of each other.
    const Real epsilon = absolute_epsilon(cell_, pools[0].size) * (cell_.minus ? 2 : 1);
    for (std::size_t g = 0; g < pools.size(); ++g) {
      const Pool& pool = pools[g];
      const auto n = static_cast<Real>(pool.rays);
      MeanTest test;
      test.channel = static_cast<int>(output);
      test.group = static_cast<int>(g) - 1;
      test.rays = pool.rays;
      test.reference = pool.mean;
      test.epsilon = g == 0 ? epsilon : epsilon * kGroupMargin;
      test.reference_error = pool.reference_error / n + single_error(cell_, pool.size, mean_lookups_);
      test.variance = pool.variance / n;
      // A few hundred samples of one group may lack the rare events that its variance is made of; those of all rays have them.
      if (!analytic_) test.variance = std::max(test.variance, pools[0].variance / static_cast<Real>(pools[0].rays));
      const Real depth = pool.size > 0 ? std::abs(std::log(pool.size)) : 0, ulp = epsilon_of(cell_.precision);
      test.rounding = std::max(64 * ulp * (1 + mean_lookups_ + depth) * pool.largest, least_of(cell_.precision));
      // Trackers that divide by the chance of a rare event enlarge rounding; a billionth of epsilon is no bias.
      test.rounding = std::max(test.rounding, kNoBias * test.epsilon);
      // Rare events that a pilot did not see are no proof of a zero variance.
      test.deterministic =
          exact_ || (analytic_ && !may_be_killed(pool) && !(test.variance > kSurely * test.rounding * test.rounding));
      if (!analytic_ && !(test.variance > 0)) test.variance = std::max<Real>(pool.size * (1 - pool.size), 1e-300);
      // Far below epsilon a variance decides nothing, and theory's may be rounding.
      if (!test.deterministic) test.variance = std::max(test.variance, test.epsilon * test.epsilon / 4);
      place(test, {pool.most - plan_.low, plan_.high - pool.least, test.variance, basis(), test.reference_error});
      if (test.deterministic) doubt(test, pool);
      demand(test, pool);
      plan_.tests.push_back(std::move(test));
    }
  }

  /// A random number of 24 bits is 0 once in 2^24 lookups, and then collides with any extinction: samples in float that are 1 may
  /// be 0 at times, however unlikely a collision is.
  bool may_be_killed(const Pool& pool) const {
    return cell_.precision == Precision::float32 && plan_.high == 1 && pool.most > 0.5;
  }

  void place(MeanTest& test, const ErrorLaw& law) {
    if (test.deterministic) {
      test.basis = TestBasis::deterministic;
      return;
    }
    // A bias far beyond epsilon shows in the mean of all rays, or it is one of some groups that the others hide.
    const bool pooled = test.channel != MeanTest::kLookups && test.group == MeanTest::kAllRays;
    test.place(place_bets(law, test.epsilon, pooled ? cell_.samples_per_ray * rays_ : 0, most_per_sum_));
    const auto needed = [&](Real power) {
      return per_ray(errors_to_pass(test.bets, law, test.epsilon, levels_.alpha_pass, power), test.rays);
    };
    test.planned = needed(kPlannedPower);
    // The chance that all tests are decided is no less than 1 minus the sum of the others.
    test.sure = needed(boost::math::quantile(complement(boost::math::normal(), kUnsure / static_cast<Real>(levels_.tests))));
  }

  /// Bets on samples that are off although theory states no variance.  A tracker that is exact needs no theory.
  void doubt(MeanTest& test, const Pool& pool) const {
    test.certainly_biased = std::max(test.rounding + test.reference_error, exact_ ? 0 : kNoNoise * pool.largest);
    if (exact_) return;
    const Real variance = std::max({kStatedDigits * pool.largest * pool.largest, test.rounding * test.rounding, 1e-300});
    const ErrorLaw law{.variance = variance, .reference_error = test.reference_error};
    for (const auto& bet : place_bets(law, 2 * std::sqrt(variance), cell_.samples_per_ray * test.rays, 1))
      if (bet.first == Role::fail) test.bets.push_back(bet);
  }

  /// "2000 samples a ray, 272 of them the pilot's": whoever hands samples in counts the pilot's as well.
  std::string counted(std::uint64_t judged) const {
    if (!pilot_ || pilot_->taken == 0) return fmt::format("{} samples a ray", judged);
    return fmt::format("{} samples a ray, {} of them the pilot's", judged + pilot_->taken, pilot_->taken);
  }
  std::string needed_in_all(std::uint64_t judged) const {
    const auto digits = [](std::uint64_t samples) {
      // Rounded up: as many samples are enough.
      const double unit = std::pow(10, std::max(0., std::floor(std::log10(static_cast<double>(samples))) - 1));
      return fmt::format("{:.2g}", unit * std::ceil(static_cast<double>(samples) / unit));
    };
    return pilot_ && pilot_->taken > 0 ? digits(with_a_pilot(judged)) + " in all" : digits(judged);
  }

  /// What the test of a mean asks of the cell.
  void demand(const MeanTest& test, const Pool& pool) {
    if (test.reference_error > 0.25 * test.epsilon)
      plan_.undecidable =
          fmt::format("the reference's own error {:.2g} is too coarse for epsilon {:.2g}", test.reference_error, test.epsilon);
    if (test.deterministic || test.basis == TestBasis::none) return;
    plan_.planned = std::max(plan_.planned, test.planned);
    if (test.sure <= sure_) return;
    sure_ = test.sure;
    // Relative to a mean that has underflowed nothing can be said.
    const Real mean = std::max(std::abs(pool.size), least_of(cell_.precision));
    const std::string epsilon = fmt::format("a PASS at epsilon {:.2g}{}", test.epsilon / mean,
                                            test.group == MeanTest::kAllRays ? "" : " of the mean of a group of rays");
    needs_ = fmt::format("not decidable at {}; {} needs {} (relative variance {:.2g})", counted(plan_.affordable), epsilon,
                         needed_in_all(test.planned), test.variance / (mean * mean));
    tight_ = fmt::format("perhaps not decidable at {}; {} needs {} with a chance of .95, and {} to be sure",
                         counted(plan_.allowance), epsilon, needed_in_all(test.planned), needed_in_all(test.sure));
  }

  /// Whether the samples allowed decide the mean, and what is missing where they do not.
  void judge_plan() {
    const bool one_sided = std::any_of(plan_.tests.begin(), plan_.tests.end(), [](const MeanTest& test) {
      const auto has = [&](Role role) {
        return std::any_of(test.bets.begin(), test.bets.end(), [&](const auto& placed) { return placed.first == role; });
      };
      return !test.deterministic && !(has(Role::low) && has(Role::high));
    });
    if (one_sided) {
      plan_.undecidable =
          theory_.infinite_variance
              ? "the variance is infinite: no number of samples decides the mean"
              : fmt::format("no analytic variance, and a pilot's is not to be trusted (variance of variance {:.2g})",
                            pilot_->variance_of_variance);
      if (!theory_.infinite_variance) plan_.remedies = advice_;
    } else if (plan_.undecidable.empty() && (plan_.planned > plan_.affordable || sure_ > plan_.allowance)) {
      plan_.undecidable = plan_.planned > plan_.affordable ? needs_ : tight_;
    }
  }

  /// The same machinery for what a sample costs.
  void add_lookups() {
    const bool known_spread = !theory_.ray_lookups_variance.empty();
    if (theory_.ray_lookups.empty() || !(known_spread || pilot_)) return;
    plan_.lookups = theory_.ray_lookups;
    Pool pool;
    for (std::size_t ray = 0; ray < rays_; ++ray) {
      pool.mean += theory_.ray_lookups[ray];
      pool.variance += known_spread ? theory_.ray_lookups_variance[ray] : pilot_->lookups_variance[ray];
      pool.least = std::min(pool.least, theory_.ray_lookups[ray]);
      pool.most = std::max(pool.most, theory_.ray_lookups[ray]);
    }
    const auto n = static_cast<Real>(rays_);
    MeanTest test;
    test.channel = MeanTest::kLookups;
    test.rays = rays_;
    test.reference = pool.mean / n;
    constexpr Real kCostEpsilon = 0.01;
    // Expected lookups come from a quadrature as well.
    constexpr Real kTheoryError = 1e-6;
    // Below one lookup a sample a hundredth of a standard deviation is as much as anybody asks for.
    test.epsilon = kCostEpsilon * std::max(pool.mean / n, std::sqrt(pool.variance / n));
    test.reference_error = kTheoryError * pool.mean / n;
    test.variance = pool.variance / n;
    test.rounding = test.reference_error;
    const bool seen = known_spread || std::min(pilot_->samples, pilot_->lookups) >= kTellingLookups;
    // Numbers of lookups are not negative: where none is expected every sample makes none.
    test.deterministic = !(pool.most > 0) || (seen && !(test.variance > kSurely * test.rounding * test.rounding));
    // Numbers of lookups are whole: a mean between two of them varies by at least so much.
    if (!seen) test.variance = std::max(test.variance, pool.mean / n * (1 - std::min<Real>(1, pool.mean / n)));
    using Basis = ErrorLaw::Basis;
    const Basis basis = known_spread ? Basis::analytic : seen ? Basis::pilot : Basis::none;
    place(test, {pool.most, kInfinity, test.variance, basis, test.reference_error});
    plan_.tests.push_back(std::move(test));
  }

  /// Tests of the variance that theory states, E[(X - mu0)^2] = v: from below for any samples, from above where they have a
  /// range. Samples of 0 and 1 need none, their variance follows from their mean.
  void add_variances(SampleRange range, bool bounding) {
    if (!analytic_ || (range == SampleRange::binary && bounding)) return;
    for (const MeanTest& mean : plan_.tests) {
      if (mean.channel < 0 || mean.group != MeanTest::kAllRays || mean.deterministic) continue;
      Real most = 0, highest = std::isfinite(plan_.high) ? 0 : kInfinity, total = 0, reference = 0;
      for (std::size_t ray = 0; ray < rays_; ++ray) {
        const std::size_t at = ray * targets_.outputs + static_cast<std::size_t>(mean.channel);
        const Real v = theory_.ray_variance[at], mu = targets_.mean[at] + plan_.shift[at];
        most = std::max(most, v);
        total += v;
        reference = std::max(reference, targets_.error[at]);
        const Real far = std::max(plan_.high - mu, mu - plan_.low);
        highest = std::max(highest, far * far - v);
      }
      // A variance near rounding is one of the tracker's arithmetic.
      constexpr Real kAboveRounding = 1e4, kTheoryError = 2e-3;
      if (!(total / static_cast<Real>(rays_) > kAboveRounding * mean.rounding * mean.rounding)) continue;
      if (!std::isfinite(reference)) {
        plan_.untested.push_back("variance: the error of the reference has no bound");
        continue;
      }
      MeanTest test;
      test.channel = mean.channel;
      test.rays = rays_;
      const Real slack = kTheoryError * most + reference * reference + mean.rounding * mean.rounding;
      test.place(place_blind_bets({most, highest, 0, ErrorLaw::Basis::none, slack}, most_per_sum_));
      plan_.variances.push_back(std::move(test));
    }
    if (!plan_.variances.empty()) plan_.stated_variance = theory_.ray_variance;
  }

  const Cell& cell_;
  const Targets& targets_;
  const CellTheory& theory_;
  const std::optional<Pilot>& pilot_;
  const TestLevels& levels_;
  std::size_t rays_;
  bool analytic_ = false, exact_ = false;
  int most_per_sum_ = 1;
  Real mean_lookups_ = 0;
  std::uint64_t sure_ = 0;
  std::string needs_, tight_, advice_;
  TestPlan plan_;
};

}  // namespace

TestPlan plan_tests(const Cell& cell, const Scene& scene, const Targets& targets, SampleRange range, Guarantee claim,
                    const CellTheory& theory, const std::optional<Pilot>& pilot, const TestLevels& levels) {
  return TestPlanner(cell, scene, targets, claim, theory, pilot, levels).plan(range, scene.bounding);
}

}  // namespace nullmark
