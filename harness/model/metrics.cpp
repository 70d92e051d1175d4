#include "harness/model/metrics.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace nullmark {
namespace {

using Field = std::optional<Real> ChannelRecord::*;

template <class F>
std::optional<Real> channel_average_of(const CellRecord& record, const F& of_channel) {
  Real sum = 0;
  for (const ChannelRecord& channel : record.channel) {
    const std::optional<Real> one = of_channel(channel);
    if (!one) return std::nullopt;
    sum += *one;
  }
  if (record.channel.empty()) return std::nullopt;
  return sum / static_cast<Real>(record.channel.size());
}

std::optional<Real> channel_average(const CellRecord& record, Field field) {
  return channel_average_of(record, [&](const ChannelRecord& channel) { return channel.*field; });
}

std::optional<Real> channel_root_mean_square(const CellRecord& record, Field field) {
  Real sum = 0;
  for (const ChannelRecord& channel : record.channel) {
    if (!(channel.*field)) return std::nullopt;
    sum += *(channel.*field) * *(channel.*field);
  }
  if (record.channel.empty()) return std::nullopt;
  return std::sqrt(sum / static_cast<Real>(record.channel.size()));
}

/// The weight of a free path at its end, in the first channel.
const ChannelRecord* weight(const CellRecord& record) {
  for (std::size_t o = 0; o < record.outputs.size() && o < record.channel.size(); ++o)
    if (record.outputs[o].rfind("weight", 0) == 0) return &record.channel[o];
  return nullptr;
}

std::optional<Real> weight(const CellRecord& record, Field field) {
  const ChannelRecord* of = weight(record);
  return of ? of->*field : std::nullopt;
}

/// Lookups that a flight of effective weight 1 costs: N E[w^2] [Kutz et al. 2017, Sec. 4.3].
std::optional<Real> weighted_cost(const std::optional<Real>& lookups, const std::optional<Real>& variance) {
  return lookups && variance ? std::optional(*lookups * (1 + *variance)) : std::nullopt;
}

/// Root mean square error of one sample, over rays, samples and channels.
std::optional<Real> sample_rmse(const CellRecord& record) {
  if (record.convergence.empty()) return std::nullopt;
  const ConvergenceRecord& single = record.convergence[0];
  if (single.samples != 1 || single.channel.empty()) return std::nullopt;
  Real sum = 0;
  for (const ConvergenceRecord::Error& error : single.channel) {
    if (!error.rmse) return std::nullopt;
    sum += *error.rmse * *error.rmse;
  }
  return std::sqrt(sum / static_cast<Real>(single.channel.size()));
}

/// The variance that a mean of n samples loses, put back.
std::optional<Real> sample_rmse_theory(const CellRecord& record) {
  const std::optional<Real> rmse = channel_root_mean_square(record, &ChannelRecord::rmse_theory),
                            variance = channel_average(record, &ChannelRecord::variance_theory);
  if (!rmse || !variance) return std::nullopt;
  return std::sqrt(*rmse * *rmse + *variance * (1 - 1 / static_cast<Real>(record.cell.samples_per_ray)));
}

using Maybe = std::optional<Real>;

Maybe product(const Maybe& a, const Maybe& b) { return a && b ? Maybe(*a * *b) : std::nullopt; }

/// Of counts that only cells which ran have.
Maybe if_run(const CellRecord& record, Real value) { return record.status == Status::ok ? Maybe(value) : std::nullopt; }

Real samples_of(const CellRecord& record) { return static_cast<Real>(record.samples); }

Maybe error_of_mean(const CellRecord& record, const ChannelRecord& channel) {
  const Maybe variance = channel.variance ? channel.variance : channel.variance_theory;
  return variance ? Maybe(std::sqrt(*variance / samples_of(record))) : std::nullopt;
}

/// Pooled over rays that differ, the kurtosis is larger than that of any law with the rays' mean variance.
Maybe relative_error_of_variance(const CellRecord& record, const ChannelRecord& channel) {
  if (channel.variance == Real{0}) return 0;
  return channel.kurtosis ? Maybe(std::sqrt(std::max<Real>(0, *channel.kurtosis - 1) / samples_of(record))) : std::nullopt;
}

Maybe error_of_variance(const CellRecord& record, const ChannelRecord& channel) {
  return product(relative_error_of_variance(record, channel), channel.variance);
}

/// Errors of channels on one walk go together: the average's is at most their average.
Maybe mean_error(const CellRecord& record) {
  return channel_average_of(record, [&](const ChannelRecord& channel) { return error_of_mean(record, channel); });
}
Maybe variance_error(const CellRecord& record) {
  return channel_average_of(record, [&](const ChannelRecord& channel) { return error_of_variance(record, channel); });
}
Maybe lookups_error(const CellRecord& record) {
  return record.lookups_variance ? Maybe(std::sqrt(*record.lookups_variance / samples_of(record))) : std::nullopt;
}
Maybe variance_x_lookups_error(const CellRecord& record) {
  const Maybe variance = variance_error(record), lookups = lookups_error(record);
  const Maybe v = channel_average(record, &ChannelRecord::variance), n = record.lookups_per_sample;
  return variance && lookups && v && n ? Maybe(std::hypot(*variance * *n, *lookups * *v)) : std::nullopt;
}
/// Lookups and weights are of the same walks: their errors may add up.
Maybe weighted_cost_error(const CellRecord& record) {
  const ChannelRecord* of = weight(record);
  const Maybe lookups = lookups_error(record), variance = of ? error_of_variance(record, *of) : std::nullopt;
  const Maybe n = record.lookups_per_sample;
  return lookups && variance && n ? Maybe(*lookups * (1 + *of->variance) + *n * *variance) : std::nullopt;
}
Maybe sample_rmse_error(const CellRecord& record) {
  const Maybe rmse = sample_rmse(record), relative = channel_average_of(record, [&](const ChannelRecord&channel) {
                                            return relative_error_of_variance(record, channel);
                                          });
  return rmse && relative ? Maybe(*rmse * *relative / 2) : std::nullopt;
}
/// Of R squared normal errors whose variances differ: sum of sigma^4 <= R kurtosis (mean sigma^2)^2.
Maybe rmse_error(const CellRecord& record) {
  const Maybe rmse = channel_root_mean_square(record, &ChannelRecord::rmse);
  if (rmse == Real{0}) return 0;
  const Maybe factor = channel_average_of(record, [](const ChannelRecord& channel) { return channel.kurtosis; });
  return rmse && factor ? Maybe(*rmse * std::sqrt(std::max<Real>(1, *factor) / (2 * static_cast<Real>(record.rays))))
                        : std::nullopt;
}
Maybe exact(const CellRecord&) { return 0; }

Maybe ns_per_sample_alone(const CellRecord& record) {
  if (!record.time) return std::nullopt;
  if (record.time->samples_per_traversal == 1) return record.time->ns_per_sample;
  for (const BatchTime& batch : record.time->batches)
    if (batch.samples_per_traversal == 1) return batch.ns_per_sample;
  return std::nullopt;
}

/// A metric: its value in a record, what theory says of it, and its standard error; null where there is none.
struct Metric {
  using Value = Maybe (*)(const CellRecord&);
  std::string name;
  Value measured = nullptr, theory = nullptr, error = nullptr;
  std::string theory_name{};  ///< of a metric of its own that is the theory; empty: none is offered
};

const std::vector<Metric>& metrics() {
  using Record = const CellRecord&;
  using Channel = ChannelRecord;
  static const std::vector<Metric> kMetrics = {
      {"mean", [](Record r) { return channel_average(r, &Channel::mean); },
       [](Record r) { return channel_average(r, &Channel::reference); }, mean_error},
      {"bias", [](Record r) { return channel_average(r, &Channel::bias); },
       [](Record r) { return channel_average(r, &Channel::bias_theory); }, mean_error, "bias_theory"},
      {"rmse", [](Record r) { return channel_root_mean_square(r, &Channel::rmse); },
       [](Record r) { return channel_root_mean_square(r, &Channel::rmse_theory); }, rmse_error},
      {"variance", [](Record r) { return channel_average(r, &Channel::variance); },
       [](Record r) { return channel_average(r, &Channel::variance_theory); }, variance_error, "variance_theory"},
      {"kurtosis", [](Record r) { return channel_average(r, &Channel::kurtosis); }},
      {"relative_variance", [](Record r) { return channel_average(r, &Channel::relative_variance); }},
      {"ns_per_sample", [](Record r) { return r.time ? Maybe(r.time->ns_per_sample) : std::nullopt; }},
      {"ns_per_sample_alone", ns_per_sample_alone},
      {"ns_per_lookup", [](Record r) -> Maybe { return r.time ? Maybe(r.time->ns_per_lookup) : std::nullopt; }},
      {"lookups_per_sample", [](Record r) -> Maybe { return r.lookups_per_sample; },
       [](Record r) -> Maybe { return r.lookups_theory; }, lookups_error, "lookups_theory"},
      {"weight_mean", [](Record r) { return weight(r, &Channel::mean); }, [](Record r) { return weight(r, &Channel::reference); },
       [](Record r) { return weight(r) ? error_of_mean(r, *weight(r)) : std::nullopt; }},
      {"weight_variance", [](Record r) { return weight(r, &Channel::variance); },
       [](Record r) { return weight(r, &Channel::variance_theory); },
       [](Record r) { return weight(r) ? error_of_variance(r, *weight(r)) : std::nullopt; }},
      {"weighted_cost", [](Record r) { return weighted_cost(r.lookups_per_sample, weight(r, &Channel::variance)); },
       [](Record r) { return weighted_cost(r.lookups_theory, weight(r, &Channel::variance_theory)); }, weighted_cost_error,
       "weighted_cost_theory"},
      {"draws_per_sample", [](Record r) -> Maybe { return r.draws_per_sample; }},
      {"variance_x_ns",
       [](Record r) {
         return product(channel_average(r, &Channel::variance), r.time ? Maybe(r.time->ns_per_sample) : std::nullopt);
       }},
      {"variance_x_lookups", [](Record r) { return product(channel_average(r, &Channel::variance), r.lookups_per_sample); },
       [](Record r) { return product(channel_average(r, &Channel::variance_theory), r.lookups_theory); },
       variance_x_lookups_error, "variance_x_lookups_theory"},
      {"sample_rmse", sample_rmse, sample_rmse_theory, sample_rmse_error, "sample_rmse_theory"},
      {"samples_per_ray", [](Record r) { return if_run(r, static_cast<Real>(r.cell.samples_per_ray)); }, nullptr, exact},
      {"largest_sample", [](Record r) -> Maybe { return r.largest_sample; }, nullptr, exact},
      {"majorant_violations", [](Record r) { return if_run(r, static_cast<Real>(r.majorant_violations)); }, nullptr, exact},
      {"majorant_cells", [](Record r) { return r.structure ? Maybe(static_cast<Real>(r.structure->cells)) : std::nullopt; },
       nullptr, exact},
  };
  return kMetrics;
}

const Metric* metric_named(std::string_view name) {
  for (const Metric& one : metrics())
    if (one.name == name) return &one;
  return nullptr;
}

/// The metric of which a name is the theory; null where it is none's.
const Metric* predicted_metric(std::string_view name) {
  for (const Metric& one : metrics())
    if (!one.theory_name.empty() && one.theory_name == name) return &one;
  return nullptr;
}

/// Names of metrics that fit, then of their theories.
template <class Fits>
std::vector<std::string> names_of(const Fits& fits) {
  std::vector<std::string> names;
  for (const Metric& one : metrics())
    if (fits(one)) names.push_back(one.name);
  for (const Metric& one : metrics())
    if (!one.theory_name.empty()) names.push_back(one.theory_name);
  return names;
}

}  // namespace

int outputs_of(const CellRecord& record) {
  return record.outputs.empty() ? record.channels : static_cast<int>(record.outputs.size());
}

const std::vector<std::string>& metric_names() {
  static const std::vector<std::string> kNames = names_of([](const Metric&) { return true; });
  return kNames;
}

const std::vector<std::string>& claimable_metric_names() {
  static const std::vector<std::string> kNames = names_of([](const Metric& one) { return one.error != nullptr; });
  return kNames;
}

std::optional<Real> metric(const CellRecord& record, std::string_view name) {
  if (const Metric* of = predicted_metric(name)) return of->theory(record);
  const Metric* one = metric_named(name);
  return one ? one->measured(record) : std::nullopt;
}

std::optional<Real> metric_theory(const CellRecord& record, std::string_view name) {
  const Metric* one = metric_named(name);
  return one && one->theory ? one->theory(record) : std::nullopt;
}

std::optional<Real> standard_error(const CellRecord& record, std::string_view name) {
  if (record.status != Status::ok || record.samples == 0) return std::nullopt;
  if (predicted_metric(name)) return 0;
  const Metric* one = metric_named(name);
  return one && one->error ? one->error(record) : std::nullopt;
}

const std::optional<Real>& best_variance(const ChannelRecord& channel) {
  return channel.variance_theory ? channel.variance_theory : channel.variance;
}

std::optional<Real> variance_x_lookups(const CellRecord& record, std::size_t channel) {
  const std::optional<Real>& variance = best_variance(record.channel[channel]);
  if (!variance || !record.lookups_per_sample) return std::nullopt;
  return *variance * *record.lookups_per_sample;
}

std::optional<Real> variance_x_ns(const CellRecord& record, std::size_t channel) {
  const std::optional<Real>& variance = best_variance(record.channel[channel]);
  if (!variance || !record.time) return std::nullopt;
  return *variance * record.time->ns_per_sample;
}

}  // namespace nullmark
