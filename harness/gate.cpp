#include "harness/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/sampling.h"

namespace nullmark {
namespace {

/// Rates of the bets, as multiples of epsilon/variance: a mixture over them stands in for the rate that hindsight would pick.
constexpr Real kFailRates[] = {0.4, 1.5}, kPassRates[] = {0.5, 0.9};

/// Catoni's variance bound over the known variance: quadrature slack, and what PASS concedes ("given Var <= 1.25 sigma^2").
constexpr Real kFailSlack = 1.02, kPassSlack = 1.25, kPilotSlack = 2;

/// Numbers below have fewer digits than others.
Real least_of(Precision precision) {
  return precision == Precision::float64 ? std::numeric_limits<Real>::min() : Real{std::numeric_limits<float>::min()};
}

/// What single precision may add to a mean: every factor of a weight is off by a few units in its last place, and all of them
/// may be so to the same side, and numbers below the least normal one have no digits left.
Real single_error(const Cell& cell, Real mean, Real lookups) {
  if (cell.precision == Precision::float64) return 0;
  return 2 * epsilon_of(cell.precision) * std::abs(mean) * (1 + lookups) + least_of(cell.precision);
}

/// Where the standard deviation is a millionth of rounding, no sample in 10^12 shows it, whatever its law [Chebyshev].
constexpr Real kSurely = 1e-12;

/// A pilot variance is trusted for unbounded samples only below this variance of the variance.
constexpr Real kTrustedVariance = 0.02;

/// A pilot's variance of lookups is trusted from so many samples, and so many lookups among them, on: flights are at most as
/// heavy in the tail as an exponential (variance of the variance 8/n), and lookups that are rare as a Poisson number (1/lookups).
constexpr std::uint64_t kTellingLookups = 400;

/// Margin of the groups over that of all rays: as many standard errors as in the pooled test.
const Real kGroupMargin = std::sqrt(static_cast<Real>(kRayGroups));

/// The relative margin where the configuration names none, wider where depth makes samples noisier.
Real default_epsilon(Real transmittance) {
  if (transmittance > std::exp(-2.)) return 0.01;
  if (transmittance > std::exp(-5.)) return 0.02;
  return transmittance > 1e-4 ? 0.05 : 0.5;
}

/// Absolute margin of the scores of a free path, of all flights, and the least of it.
constexpr Real kOfFlights = 2e-3, kRareScore = 1e-4;

/// Smaller where a score is rare, or nearly always given, or a tracker that never scores it would pass.  A weight's mean is 1.
Real score_epsilon(const Cell& cell, Real mean) {
  constexpr Real kOfScore = 0.25, kNever = 1e-9;
  const Real margin = cell.gate.epsilon.value_or(kOfFlights), rare = std::min(mean, 1 - mean);
  return rare < kNever ? margin : std::max(std::min(margin, kOfScore * rare), kRareScore);
}

/// Absolute margin of an output.  Where hardly anything is absorbed it shrinks with 1 - T, or a tracker that sees no medium at
/// all would pass.
Real absolute_epsilon(const Cell& cell, Real mean) {
  if (cell.quantity == Quantity::free_path) return score_epsilon(cell, mean);
  // A mean that has underflowed has no part of itself.
  const Real least = 16 * least_of(cell.precision);
  if (!(std::abs(mean) > least)) return least;
  if (cell.gate.epsilon) return *cell.gate.epsilon * mean;
  if (cell.quantity == Quantity::optical_depth || cell.quantity == Quantity::radiance) return 0.01 * std::abs(mean);
  const Real margin = default_epsilon(mean) * mean, absorbed = 1 - mean;
  constexpr Real kOfAbsorbed = 0.1;
  return absorbed > 1e-12 ? std::min(margin, kOfAbsorbed * absorbed) : margin;
}

/// What the rays of one test have in common.
struct Pool {
  Real mean = 0, variance = 0, reference_error = 0, least = kInfinity, most = -kInfinity;
  std::size_t rays = 0;
};

/// `most_per_sum` errors may share a sum.
void set_bets(MeanTest& test, const Pool& pool, Real low, Real high, bool analytic, int most_per_sum) {
  const bool bounded_below = std::isfinite(low), bounded_above = std::isfinite(high);
  const Real below = pool.most - low, above = high - pool.least;  // the largest errors down and up
  const Real slack = analytic ? 1 : kPilotSlack;
  const auto place = [&](Role role, Bet::Kind kind, int side, Real limit) {
    Bet bet{kind, side, limit, 0, {}};
    bet.variance = test.variance * (analytic ? (role == Role::fail ? kFailSlack : kPassSlack) : slack);
    const Real scale = test.epsilon / (test.variance * slack);
    if (role == Role::fail)
      for (const Real rate : kFailRates) bet.rates.push_back(rate * scale);
    else
      for (const Real rate : kPassRates) bet.rates.push_back(rate * scale);
    test.bets.emplace_back(role, std::move(bet));
  };
  using Kind = Bet::Kind;
  if (!bounded_below || !bounded_above) {
    place(Role::fail, Kind::catoni, 1, test.reference_error);
    place(Role::fail, Kind::catoni, -1, -test.reference_error);
  }
  if (bounded_below) place(Role::fail, Kind::betting, 1, test.reference_error);
  if (bounded_above) place(Role::fail, Kind::betting, -1, -test.reference_error);
  place(Role::low, bounded_below ? Kind::betting : Kind::catoni, 1, -test.epsilon);
  place(Role::high, bounded_above ? Kind::betting : Kind::catoni, -1, test.epsilon);
  test.basis = bounded_below && bounded_above ? "betting" : bounded_below || bounded_above ? "catoni+betting" : "catoni";

  // Sums may be as long as a bet at its highest rate still resembles the product over single errors.
  constexpr Real kSmall = 0.5;
  int& b = test.errors_per_sum = most_per_sum;
  for (const auto& placed : test.bets) {
    const Bet& bet = placed.second;
    const Real rate = bet.rates.back();
    const auto fits = [&] {
      if (bet.kind == Kind::catoni) return b * rate * rate * bet.variance <= kSmall * kSmall;
      const Real widest = std::max(bounded_below ? below : 0, bounded_above ? above : 0) + std::abs(bet.limit);
      return b * rate * widest <= kSmall;
    };
    while (b > 1 && !fits()) b /= 2;
  }
}

/// Without a variance to trust, only bets that need none can be placed.
void drop_catoni(MeanTest& test) {
  std::erase_if(test.bets, [](const auto& bet) { return bet.second.kind == Bet::Kind::catoni; });
}

/// Keeps the wealth of betting bets positive.
void clip_rates(MeanTest& test, const Pool& pool, Real low, Real high) {
  for (auto& [role, bet] : test.bets) {
    if (bet.kind != Bet::Kind::betting) continue;
    const Real loss = bet.side > 0 ? pool.most - low + bet.limit : high - pool.least - bet.limit;
    const Real most = loss > 0 ? 0.5 / (loss * test.errors_per_sum) : kInfinity;
    for (Real& rate : bet.rates) rate = std::min(rate, most);
  }
}

/// Samples (over all rays of the test) at which an unbiased cell passes with probability about .95.
Real samples_to_pass(const MeanTest& test, Real alpha_pass) {
  constexpr Real kPower = 1.645;
  const Real margin = test.epsilon - test.reference_error;
  if (!(margin > 0)) return kInfinity;
  const Real normal = std::sqrt(2 * std::log(1 / alpha_pass)) + kPower;
  Real samples = normal * normal * test.variance / (margin * margin);
  for (const auto& [role, bet] : test.bets) {
    if (role == Role::fail) continue;
    const Real v = bet.kind == Bet::Kind::catoni ? bet.variance : test.variance;
    Real growth = 0;
    for (const Real l : bet.rates) growth = std::max(growth, l * margin - l * l * v / 2);
    constexpr Real kSpread = 1.6;  // between the expected wealth and that of 95 of 100 runs
    samples = std::max(samples, kSpread * std::log(static_cast<Real>(bet.rates.size()) / alpha_pass) / growth);
  }
  return samples;
}

std::uint64_t per_ray(Real samples, std::size_t rays) {
  const Real each = std::ceil(samples / static_cast<Real>(rays));
  return each < 9e15 ? static_cast<std::uint64_t>(each) : std::uint64_t{1} << 53;
}

std::uint64_t largest_power_of_two_divisor(std::uint64_t n) { return n & (~n + 1); }

/// Upper bound on the number of ray groups, from the specification alone.
std::uint64_t possible_groups(const Component& rays) { return rays.type == "single" ? 0 : kRayGroups; }

/// Upper bound on the outputs of a quantity, for each channel.
std::uint64_t outputs_per_channel(Quantity quantity) {
  if (quantity == Quantity::transmittance_profile) return kProfileMarks;
  return quantity == Quantity::free_path ? kFreePathBins + 3 : 1;
}

std::uint64_t channels_of(const MediumSpec& medium) {
  if (medium.field.type == "channels") return medium.per_channel.size();
  return std::max<std::size_t>(1, medium.spectrum.size());
}

}  // namespace

std::vector<int> ray_groups(const BuiltRays& rays) {
  const std::size_t n = rays.world.size();
  std::vector<int> groups(n, 0);
  if (n < static_cast<std::size_t>(kRayGroups)) return groups;
  constexpr int kTiles = 4;
  static_assert(kTiles * kTiles == kRayGroups);
  const bool tiles = rays.width >= kTiles && rays.height >= kTiles;
  for (std::size_t r = 0; r < n; ++r) {
    if (tiles) {
      const auto width = static_cast<std::size_t>(rays.width), height = static_cast<std::size_t>(rays.height);
      groups[r] = static_cast<int>((r / width) * kTiles / height * kTiles + (r % width) * kTiles / width);
    } else {
      groups[r] = static_cast<int>(r * kRayGroups / n);
    }
  }
  return groups;
}

void Evidence::add(const MeanTest& test, std::span<const Real> summed) {
  std::vector<const Bet*> bets;
  for (const auto& placed : test.bets) bets.push_back(&placed.second);
  const std::vector<Real> added = bet_on(bets, summed, test.errors_per_sum);
  logs.resize(std::max(logs.size(), added.size()), 0);
  for (std::size_t i = 0; i < added.size(); ++i) logs[i] += added[i];
  sums += summed.size();
}

Evidence& Evidence::operator+=(const Evidence& other) {
  logs.resize(std::max(logs.size(), other.logs.size()), 0);
  for (std::size_t i = 0; i < other.logs.size(); ++i) logs[i] += other.logs[i];
  sums += other.sums;
  largest_error = std::max(largest_error, other.largest_error);
  return *this;
}

CellGate plan_gate(const Cell& cell, const Scene& scene, const Targets& targets, SampleRange range, Claim claim,
                   const CellTheory& theory, const std::optional<Pilot>& pilot, const GateLevels& levels) {
  const std::size_t rays = scene.rays->world.size(), outputs = targets.outputs;
  CellGate gate;
  const bool own_mean = claim == Claim::consistent || claim == Claim::biased;
  gate.against = own_mean ? "own mean" : "reference";
  gate.group_of = ray_groups(*scene.rays);
  const int groups = rays < static_cast<std::size_t>(kRayGroups) ? 0 : kRayGroups;

  if (cell.quantity == Quantity::optical_depth || (!scene.bounding && range != SampleRange::binary))
    range = SampleRange::any_sign;
  if (range != SampleRange::any_sign) gate.low = 0;
  if (range == SampleRange::binary || range == SampleRange::unit) gate.high = 1;

  const bool analytic = !theory.ray_variance.empty();
  gate.variance_basis = analytic ? "analytic" : pilot ? "pilot" : "none";
  gate.shift.assign(rays * outputs, 0);
  if (own_mean && !theory.ray_shift.empty()) gate.shift = theory.ray_shift;
  if (!analytic && !pilot) return gate;

  const int most_per_sum = static_cast<int>(std::min<std::uint64_t>(64, largest_power_of_two_divisor(cell.samples_per_ray)));
  const bool bounded = std::isfinite(gate.low) && std::isfinite(gate.high);
  const bool distrusted = !analytic && !bounded && (theory.infinite_variance || pilot->variance_of_variance >= kTrustedVariance);
  std::vector<Pool> pools;
  const Real ulp = epsilon_of(cell.precision);
  const Real mean_lookups =
      theory.lookups.value_or(pilot && pilot->samples > 0 ? static_cast<Real>(pilot->lookups) / static_cast<Real>(pilot->samples)
                                                          : theory.majorant_depth);
  for (std::size_t o = 0; o < outputs; ++o) {
    std::vector<Pool> by_group(static_cast<std::size_t>(groups) + 1);
    for (std::size_t ray = 0; ray < rays; ++ray) {
      const std::size_t at = ray * outputs + o;
      const Real mean = targets.mean[at] + gate.shift[at];
      for (Pool* pool : {&by_group[0], groups ? &by_group[static_cast<std::size_t>(gate.group_of[ray]) + 1] : nullptr}) {
        if (!pool) continue;
        ++pool->rays;
        pool->mean += mean;
        pool->variance += analytic ? theory.ray_variance[at] : pilot->variance[at];
        pool->reference_error += targets.error[at];
        pool->least = std::min(pool->least, mean);
        pool->most = std::max(pool->most, mean);
      }
    }
    Real epsilon = 0;
    for (std::size_t g = 0; g < by_group.size(); ++g) {
      Pool& pool = by_group[g];
      const auto n = static_cast<Real>(pool.rays);
      pool.mean /= n;
      if (g == 0) epsilon = absolute_epsilon(cell, pool.mean);
      MeanTest test;
      test.channel = static_cast<int>(o);
      test.group = static_cast<int>(g) - 1;
      test.rays = pool.rays;
      test.epsilon = g == 0 ? epsilon : epsilon * kGroupMargin;
      test.reference_error = pool.reference_error / n + single_error(cell, pool.mean, mean_lookups);
      test.variance = pool.variance / n;
      const Real depth = pool.mean > 0 ? std::abs(std::log(pool.mean)) : 0;
      test.rounding = std::max(64 * ulp * (1 + mean_lookups + depth) * std::max(std::abs(pool.most), std::abs(pool.least)),
                               least_of(cell.precision));
      // Rare events that a pilot did not see are no proof of a zero variance.
      test.deterministic = analytic && !(test.variance > kSurely * test.rounding * test.rounding);
      if (!analytic && !(test.variance > 0)) test.variance = std::max<Real>(pool.mean * (1 - pool.mean), 1e-300);
      // Far below epsilon a variance decides nothing, and theory's may be rounding.
      if (!test.deterministic) test.variance = std::max(test.variance, test.epsilon * test.epsilon / 4);
      pools.push_back(pool);
      if (test.deterministic)
        test.basis = "deterministic";
      else
        set_bets(test, pool, gate.low, gate.high, analytic, most_per_sum);
      if (distrusted) drop_catoni(test);
      gate.tests.push_back(std::move(test));
    }
  }
  const std::uint64_t most = std::max(cell.samples_per_ray, cell.gate.max_samples_per_ray);
  gate.affordable = most;
  if (cell.gate.max_lookups_per_ray && mean_lookups > 0)
    gate.affordable = std::min(most, static_cast<std::uint64_t>(std::min(9e15, *cell.gate.max_lookups_per_ray / mean_lookups)));
  gate.affordable = std::max(gate.affordable, cell.samples_per_ray);

  std::optional<std::size_t> hardest;
  for (std::size_t i = 0; i < gate.tests.size(); ++i) {
    MeanTest& test = gate.tests[i];
    if (test.reference_error > 0.25 * test.epsilon)
      gate.undecidable =
          fmt::format("the reference's own error {:.2g} is too coarse for epsilon {:.2g}", test.reference_error, test.epsilon);
    if (test.deterministic || test.bets.empty()) continue;
    clip_rates(test, pools[i], gate.low, gate.high);
    test.planned = per_ray(samples_to_pass(test, levels.alpha_pass), test.rays);
    gate.planned = std::max(gate.planned, test.planned);
    if (!hardest || test.planned > gate.tests[*hardest].planned) hardest = i;
  }
  if (hardest && gate.undecidable.empty()) {
    const MeanTest& test = gate.tests[*hardest];
    // Relative to a mean that has underflowed nothing can be said.
    const Real mean = std::max(std::abs(pools[*hardest].mean), least_of(cell.precision));
    if (kPatience * test.planned > gate.affordable && test.planned > cell.samples_per_ray)
      gate.undecidable = fmt::format(
          "PASS at epsilon {:.2g} needs about {:.2g} samples a ray (relative variance {:.2g}) and room for {} times as many; {} "
          "are allowed",
          test.epsilon / mean, static_cast<double>(test.planned), test.variance / (mean * mean), kPatience, gate.affordable);
  }
  if (distrusted)
    gate.undecidable = theory.infinite_variance
                           ? "the variance is infinite: no number of samples decides the mean"
                           : fmt::format("no analytic variance, and a pilot's is not to be trusted (variance of variance {:.2g})",
                                         pilot->variance_of_variance);

  // The same machinery for what a sample costs.
  const bool known_cost = !theory.ray_lookups.empty();
  const bool known_spread = !theory.ray_lookups_variance.empty();
  if (known_cost && (known_spread || pilot)) {
    gate.lookups = theory.ray_lookups;
    Pool pool;
    for (std::size_t ray = 0; ray < rays; ++ray) {
      ++pool.rays;
      pool.mean += theory.ray_lookups[ray];
      pool.variance += known_spread ? theory.ray_lookups_variance[ray] : pilot->lookups_variance[ray];
      pool.least = std::min(pool.least, theory.ray_lookups[ray]);
      pool.most = std::max(pool.most, theory.ray_lookups[ray]);
    }
    const auto n = static_cast<Real>(rays);
    MeanTest test;
    test.channel = MeanTest::kLookups;
    test.rays = rays;
    constexpr Real kCostEpsilon = 0.01;
    // Expected lookups come from a quadrature as well.
    constexpr Real kTheoryError = 1e-6;
    // Below one lookup a sample a hundredth of a standard deviation is as much as anybody asks for.
    test.epsilon = kCostEpsilon * std::max(pool.mean / n, std::sqrt(pool.variance / n));
    test.reference_error = kTheoryError * pool.mean / n;
    test.variance = pool.variance / n;
    test.rounding = test.reference_error;
    const bool seen = known_spread || std::min(pilot->samples, pilot->lookups) >= kTellingLookups;
    test.deterministic = seen && !(test.variance > kSurely * test.rounding * test.rounding);
    // Numbers of lookups are whole: a mean between two of them varies by at least so much.
    if (!seen) test.variance = std::max(test.variance, pool.mean / n * (1 - std::min<Real>(1, pool.mean / n)));
    if (test.deterministic) {
      test.basis = "deterministic";
    } else {
      set_bets(test, pool, 0, kInfinity, known_spread, most_per_sum);
      if (!seen) drop_catoni(test);
      clip_rates(test, pool, 0, kInfinity);
      test.planned = per_ray(samples_to_pass(test, levels.alpha_pass), rays);
    }
    gate.tests.push_back(std::move(test));
  }
  return gate;
}

TestRecord test_record(const MeanTest& test, const Evidence& evidence) {
  TestRecord record;
  record.channel = test.channel;
  record.group = test.group;
  record.samples = evidence.sums * static_cast<std::uint64_t>(test.errors_per_sum);
  record.epsilon = test.epsilon;
  record.reference_error = test.reference_error;
  record.variance = test.variance;
  record.basis = test.basis;
  record.largest_error = evidence.largest_error;
  record.rounding = test.rounding;
  record.planned = test.planned;
  if (test.deterministic) return record;

  // By role and kind: kinds weigh the same, however many rates each has.
  std::map<std::pair<Role, Bet::Kind>, std::vector<Real>> wealth;
  std::size_t at = 0;
  for (const auto& [role, bet] : test.bets)
    for (const Real rate : bet.rates) {
      const Real log = at < evidence.logs.size() ? evidence.logs[at] : 0;
      wealth[{role, bet.kind}].push_back(log - log_denominator(bet, rate, evidence.sums, test.errors_per_sum));
      ++at;
    }
  const auto log_e = [&](Role role) {
    std::vector<Real> kinds;
    for (const auto& [key, logs] : wealth)
      if (key.first == role)
        kinds.push_back(log_mean_exp(logs));  // Rounded, so that the file tells as much as the decision used.
    constexpr Real kDigits = 1e4;
    return std::round(log_mean_exp(kinds) * kDigits) / kDigits;
  };
  record.log_e_fail = log_e(Role::fail);
  record.log_e_low = log_e(Role::low);
  record.log_e_high = log_e(Role::high);
  if (!test.bets.empty()) record.rates = test.bets.front().second.rates;
  return record;
}

std::uint64_t mean_family(const Plan& plan) {
  std::uint64_t tests = 0;
  for (const Cell& cell : plan.cells)
    if (cell.gate.enabled)
      tests += channels_of(plan.media[cell.medium]) * outputs_per_channel(cell.quantity) *
               (1 + possible_groups(plan.ray_sets[cell.rays]));
  return std::max<std::uint64_t>(1, tests);
}

std::uint64_t lookups_family(const Plan& plan) {
  std::uint64_t tests = 0;
  for (const Cell& cell : plan.cells) tests += cell.gate.enabled;
  return std::max<std::uint64_t>(1, tests);
}

std::uint64_t laws_family(const Plan& plan) { return kLaws * lookups_family(plan); }

}  // namespace nullmark
