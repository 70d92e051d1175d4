#include "harness/model/cost.h"

#include <algorithm>
#include <cmath>

#include "harness/model/metrics.h"

namespace nullmark {
namespace {

Real square(Real x) { return x * x; }

/// The floor b = sqrt(rmse^2 - V / n) over R.  rmse^2 is the mean over r rays of squares of normal numbers of mean b and
/// variance V / n.
Interval floor_of(const CellRecord& record, Real mean_square_error, Real variance, Real reference) {
  const auto rays = static_cast<Real>(std::max<std::uint64_t>(1, record.rays));
  const Real noise = variance / static_cast<Real>(record.cell.samples_per_ray);
  const Real bias_square = std::max<Real>(0, mean_square_error - noise);
  const Real half = kNormal975 * std::sqrt(2 * square(noise) / rays + 4 * bias_square * noise / rays);
  const auto root = [&](Real x) { return std::sqrt(std::max<Real>(0, x)) / reference; };
  const Interval floor{root(bias_square), root(mean_square_error - noise - half), root(bias_square + half)};
  return floor.high <= kRounding ? Interval{} : floor;
}

std::vector<std::pair<std::uint64_t, Interval>> times_by_batch(const TimeRecord& time, const Interval& main) {
  std::vector<std::pair<std::uint64_t, Interval>> times;
  for (const BatchTime& batch : time.batches)
    if (batch.samples_per_traversal < time.samples_per_traversal && batch.ns_per_sample > 0)
      // Median absolute deviation to standard error of a median, for normal scatter.
      times.emplace_back(
          batch.samples_per_traversal,
          relative(batch.ns_per_sample, 1.4826 * 1.2533 * batch.mad / batch.ns_per_sample / std::sqrt(time.repetitions)));
  times.emplace_back(time.samples_per_traversal, main);
  return times;
}

}  // namespace

bool stands_unbiased(const CellRecord& record) {
  // Samples that are clamped or rounded are biased, whatever their tracker is.
  if (!(record.cell.measurement == Measurement{}) || (record.claims != "unbiased" && record.claims != "exact")) return false;
  if (!record.verdict) return true;
  const VerdictRecord& verdict = *record.verdict;
  return verdict.unbiased != Outcome::fail && verdict.unbiased != Outcome::violated && verdict.lookups != Outcome::fail &&
         verdict.lawful != Outcome::fail;
}

bool variance_is_uncertain(const CellRecord& record, const ChannelRecord& channel) {
  if (channel.variance_theory || !channel.variance || record.samples == 0) return false;
  const auto samples = static_cast<Real>(record.samples);
  if (channel.kurtosis && std::sqrt(std::max<Real>(0, *channel.kurtosis - 1) / samples) > 0.5) return true;
  // A bias that is proven needs no unseen samples, even where the verdict tolerates it.
  const bool biased = record.verdict && record.verdict->biased;
  if (record.claims != "unbiased" || !stands_unbiased(record) || biased || !channel.bias) return false;
  const Real rounding = kRounding * channel.reference_rms.value_or(0) + channel.reference_error.value_or(0);
  return std::abs(*channel.bias) > 5 * std::sqrt(*channel.variance / samples) + rounding;
}

std::optional<Cost> cost_of(const CellRecord& record) {
  if (record.status != Status::ok || record.channel.empty() || !record.outputs.empty()) return std::nullopt;
  Real variance = 0, mean_square_error = 0, reference = 0, relative_error = 0;
  bool analytic = true, errors_known = true;
  for (const ChannelRecord& channel : record.channel) {
    const std::optional<Real>& best = best_variance(channel);
    const std::optional<Real>& mean = channel.reference ? channel.reference : channel.mean;
    if (!best || !mean) return std::nullopt;
    variance += *best;
    reference += square(channel.reference_rms.value_or(std::abs(*mean)));
    errors_known = errors_known && channel.rmse;
    mean_square_error += square(channel.rmse.value_or(0));
    if (channel.variance_theory) continue;
    analytic = false;
    // A factor of 50 either way.
    if (variance_is_uncertain(record, channel)) relative_error = std::max<Real>(relative_error, 2);
    if (channel.kurtosis)
      relative_error = std::max(relative_error, std::sqrt(std::max<Real>(0, *channel.kurtosis - 1) /
                                                          static_cast<Real>(std::max<std::uint64_t>(1, record.samples))));
  }
  if (!(reference > 0)) return std::nullopt;
  const auto channels = static_cast<Real>(record.channel.size());
  Cost cost;
  cost.analytic = analytic;
  cost.reference = std::sqrt(reference / channels);
  variance /= channels;
  if (variance <= square(kRounding * cost.reference)) variance = 0;
  cost.variance = relative(variance, relative_error);
  if (record.lookups_per_sample) cost.variance_x_lookups = product(cost.variance, exactly(*record.lookups_per_sample));
  if (record.time) cost.ns_per_sample = median_interval(record.time->repetition_ns);
  if (cost.ns_per_sample) cost.ns_by_batch = times_by_batch(*record.time, *cost.ns_per_sample);
  if (cost.ns_per_sample) {
    cost.variance_x_ns = product(cost.variance, *cost.ns_per_sample);
    if (const auto& [samples, ns] = cost.ns_by_batch.front(); samples == 1) cost.variance_x_ns_alone = product(cost.variance, ns);
  }
  if (!stands_unbiased(record) && errors_known)
    cost.floor = floor_of(record, mean_square_error / channels, cost.variance.value, cost.reference);
  return cost;
}

Interval samples_to(const Cost& cost, Real target) {
  const auto samples = [&](Real variance, Real floor) {
    const Real room = (square(target) - square(floor)) * square(cost.reference);
    return room > 0 ? std::max<Real>(1, variance / room) : kInfinity;
  };
  const Interval floor = cost.floor.value_or(Interval{});
  return {samples(cost.variance.value, floor.value), samples(cost.variance.low, floor.low),
          samples(cost.variance.high, floor.high)};
}

namespace {

/// Nanoseconds of one of n samples that share a walk through the majorant structure.  Between two numbers that were timed, the
/// time of all of them grows linearly: the walk once, and so much a sample.
Interval sample_time(const Cost& cost, Real n) {
  const auto& batches = cost.ns_by_batch;
  std::size_t next = 0;
  while (next < batches.size() && static_cast<Real>(batches[next].first) <= n) ++next;
  if (next == 0 || next == batches.size()) return batches[next == 0 ? 0 : next - 1].second;
  const auto fewer = static_cast<Real>(batches[next - 1].first), more = static_cast<Real>(batches[next].first);
  const Real of_fewer = fewer * (more - n) / ((more - fewer) * n), of_more = more * (n - fewer) / ((more - fewer) * n);
  const Interval &a = batches[next - 1].second, &b = batches[next].second;
  return {of_fewer * a.value + of_more * b.value, of_fewer * a.low + of_more * b.low, of_fewer * a.high + of_more * b.high};
}

}  // namespace

std::optional<Interval> seconds_to(const Cost& cost, Real target) {
  if (!cost.ns_per_sample) return std::nullopt;
  const Interval samples = samples_to(cost, target);
  if (!std::isfinite(samples.value)) return samples;
  return product(product(samples, sample_time(cost, samples.value)), exactly(1e-9));
}

bool is_amortised(const Cost& cost, Real target) {
  return cost.ns_per_sample && samples_to(cost, target).value < static_cast<Real>(cost.ns_by_batch.front().first);
}

Interval mean_square_error(const Cost& cost, std::uint64_t samples) {
  const Interval floor = cost.floor.value_or(Interval{});
  const auto n = static_cast<Real>(samples);
  const auto error = [&](Real variance, Real bias) { return variance / n + square(bias * cost.reference); };
  return {error(cost.variance.value, floor.value), error(cost.variance.low, floor.low), error(cost.variance.high, floor.high)};
}

const char* to_string(BreakEven::Kind kind) {
  switch (kind) {
    case BreakEven::Kind::first_sample:
      return "the first unbiased sample";
    case BreakEven::Kind::never_cheaper:
      return "never cheaper";
    case BreakEven::Kind::no_floor_seen:
      return "no floor seen";
    case BreakEven::Kind::exact:
      return "exact but for rounding";
    case BreakEven::Kind::at:
      break;
  }
  return "at";
}

std::optional<BreakEven> break_even(const Cost& biased, const Cost& unbiased) {
  if (!biased.floor || !biased.variance_x_ns || !unbiased.variance_x_ns) return std::nullopt;
  constexpr Real kSeconds = 1e-9;
  const auto time = [&](Real of_unbiased, Real of_biased, Real floor) {
    return std::max<Real>(0, of_unbiased - of_biased) * kSeconds / square(floor * biased.reference);
  };
  const Interval &u = *unbiased.variance_x_ns, &b = *biased.variance_x_ns, &floor = *biased.floor;
  BreakEven result;
  if (floor.high == 0) {
    result.kind = BreakEven::Kind::exact;
    return result;
  }
  if (!(floor.low > 0)) {
    result.kind = BreakEven::Kind::no_floor_seen;
    return result;
  }
  result.seconds = {time(u.value, b.value, floor.value), time(u.low, b.high, floor.high), time(u.high, b.low, floor.low)};
  // Either has no answer before its first sample.
  const Real first = biased.ns_per_sample->value * kSeconds, first_of_unbiased = unbiased.ns_per_sample->value * kSeconds;
  if (result.seconds.value < std::max(first, first_of_unbiased)) {
    result.kind = first < first_of_unbiased ? BreakEven::Kind::first_sample : BreakEven::Kind::never_cheaper;
    return result;
  }
  const auto error = [&](Real of_unbiased, Real seconds) {
    return seconds > 0 ? std::sqrt(of_unbiased * kSeconds / seconds) / unbiased.reference : kInfinity;
  };
  result.error = {error(u.value, result.seconds.value), error(u.low, result.seconds.high), error(u.high, result.seconds.low)};
  return result;
}

}  // namespace nullmark
