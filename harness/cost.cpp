#include "harness/cost.h"

#include <algorithm>
#include <cmath>

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
  return {root(bias_square), root(mean_square_error - noise - half), root(bias_square + half)};
}

}  // namespace

std::optional<Cost> cost_of(const CellRecord& record) {
  if (record.status != Status::ok || record.channel.empty() || !record.outputs.empty()) return std::nullopt;
  Real variance = 0, mean_square_error = 0, reference = 0, relative_error = 0;
  bool analytic = true, errors_known = true;
  for (const ChannelRecord& channel : record.channel) {
    const auto& best = channel.variance_theory ? channel.variance_theory : channel.variance;
    if (!best || !channel.reference) return std::nullopt;
    variance += *best;
    reference += square(channel.reference_rms.value_or(std::abs(*channel.reference)));
    errors_known = errors_known && channel.rmse;
    mean_square_error += square(channel.rmse.value_or(0));
    if (channel.variance_theory) continue;
    analytic = false;
    if (channel.kurtosis)
      relative_error = std::max(relative_error, std::sqrt(std::max<Real>(0, *channel.kurtosis - 1) /
                                                          static_cast<Real>(std::max<std::uint64_t>(1, record.samples))));
  }
  if (!(reference > 0)) return std::nullopt;
  const auto channels = static_cast<Real>(record.channel.size());
  Cost cost;
  cost.analytic = analytic;
  cost.reference = std::sqrt(reference / channels);
  cost.variance = relative(variance / channels, relative_error);
  if (record.lookups_per_sample) cost.variance_x_lookups = product(cost.variance, exactly(*record.lookups_per_sample));
  if (record.time) cost.ns_per_sample = median_interval(record.time->repetition_ns);
  if (cost.ns_per_sample) cost.variance_x_ns = product(cost.variance, *cost.ns_per_sample);
  if ((record.claims == "consistent" || record.claims == "biased") && errors_known)
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

std::optional<Interval> seconds_to(const Cost& cost, Real target) {
  if (!cost.ns_per_sample) return std::nullopt;
  const Interval samples = samples_to(cost, target);
  if (!std::isfinite(samples.value)) return samples;
  return product(product(samples, *cost.ns_per_sample), exactly(1e-9));
}

std::optional<BreakEven> break_even(const Cost& biased, const Cost& unbiased) {
  if (!biased.floor || !biased.variance_x_ns || !unbiased.variance_x_ns) return std::nullopt;
  constexpr Real kSeconds = 1e-9;
  const auto time = [&](Real of_unbiased, Real of_biased, Real floor) {
    return std::max<Real>(0, of_unbiased - of_biased) * kSeconds / square(floor * biased.reference);
  };
  const Interval &u = *unbiased.variance_x_ns, &b = *biased.variance_x_ns, &floor = *biased.floor;
  BreakEven result;
  if (!(floor.low > 0)) {
    result.kind = BreakEven::Kind::no_floor_seen;
    return result;
  }
  result.seconds = {time(u.value, b.value, floor.value), time(u.low, b.high, floor.high), time(u.high, b.low, floor.low)};
  // It must have drawn one sample to have been cheaper.
  if (result.seconds.value < biased.ns_per_sample->value * kSeconds) {
    result.kind = BreakEven::Kind::never_cheaper;
    return result;
  }
  const auto error = [&](Real of_unbiased, Real seconds) {
    return seconds > 0 ? std::sqrt(of_unbiased * kSeconds / seconds) / unbiased.reference : kInfinity;
  };
  result.error = {error(u.value, result.seconds.value), error(u.low, result.seconds.high), error(u.high, result.seconds.low)};
  return result;
}

}  // namespace nullmark
