#include "harness/model/metrics.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace nullmark {
namespace {

using Field = std::optional<Real> ChannelRecord::*;

std::optional<Real> channel_average(const CellRecord& record, Field field) {
  Real sum = 0;
  for (const ChannelRecord& channel : record.channel) {
    if (!(channel.*field)) return std::nullopt;
    sum += *(channel.*field);
  }
  if (record.channel.empty()) return std::nullopt;
  return sum / static_cast<Real>(record.channel.size());
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
  if (record.convergence.empty() || record.convergence[0].samples != 1 || record.convergence[0].rmse.empty()) return std::nullopt;
  Real sum = 0;
  for (const std::optional<Real>& rmse : record.convergence[0].rmse) {
    if (!rmse) return std::nullopt;
    sum += *rmse * *rmse;
  }
  return std::sqrt(sum / static_cast<Real>(record.convergence[0].rmse.size()));
}

/// The variance that a mean of n samples loses, put back.
std::optional<Real> sample_rmse_theory(const CellRecord& record) {
  const std::optional<Real> rmse = channel_root_mean_square(record, &ChannelRecord::rmse_theory),
                            variance = channel_average(record, &ChannelRecord::variance_theory);
  if (!rmse || !variance) return std::nullopt;
  return std::sqrt(*rmse * *rmse + *variance * (1 - 1 / static_cast<Real>(record.cell.samples_per_ray)));
}

/// What a metric that is theory's predicts: "variance" of "variance_theory".
std::string_view predicted_metric(std::string_view name) {
  if (name == "lookups_theory") return "lookups_per_sample";
  constexpr std::string_view kEnd = "_theory";
  return name.ends_with(kEnd) ? name.substr(0, name.size() - kEnd.size()) : std::string_view();
}

}  // namespace

const std::vector<std::string>& metric_names() {
  static const std::vector<std::string> kNames = {"mean",
                                                  "bias",
                                                  "rmse",
                                                  "variance",
                                                  "kurtosis",
                                                  "relative_variance",
                                                  "ns_per_sample",
                                                  "ns_per_lookup",
                                                  "lookups_per_sample",
                                                  "weight_mean",
                                                  "weight_variance",
                                                  "weighted_cost",
                                                  "draws_per_sample",
                                                  "variance_x_ns",
                                                  "variance_x_lookups",
                                                  "sample_rmse",
                                                  "samples_per_ray",
                                                  "largest_sample",
                                                  "majorant_violations",
                                                  "majorant_cells",
                                                  "variance_theory",
                                                  "lookups_theory",
                                                  "bias_theory",
                                                  "variance_x_lookups_theory",
                                                  "sample_rmse_theory",
                                                  "weighted_cost_theory"};
  return kNames;
}

const std::vector<std::string>& claimable_metric_names() {
  static const std::vector<std::string> kNames = [] {
    const std::set<std::string_view> without_error = {"kurtosis",      "relative_variance", "ns_per_sample", "ns_per_lookup",
                                                      "weighted_cost", "draws_per_sample",  "variance_x_ns"};
    std::vector<std::string> names = metric_names();
    std::erase_if(names, [&](const std::string& name) { return without_error.count(name) > 0; });
    return names;
  }();
  return kNames;
}

std::optional<Real> metric(const CellRecord& record, std::string_view name) {
  if (const std::string_view of = predicted_metric(name); !of.empty()) return metric_theory(record, of);
  if (name == "mean") return channel_average(record, &ChannelRecord::mean);
  if (name == "bias") return channel_average(record, &ChannelRecord::bias);
  if (name == "rmse") return channel_root_mean_square(record, &ChannelRecord::rmse);
  if (name == "variance") return channel_average(record, &ChannelRecord::variance);
  if (name == "kurtosis") return channel_average(record, &ChannelRecord::kurtosis);
  if (name == "relative_variance") return channel_average(record, &ChannelRecord::relative_variance);
  if (name == "lookups_per_sample") return record.lookups_per_sample;
  if (name == "weight_mean") return weight(record, &ChannelRecord::mean);
  if (name == "weight_variance") return weight(record, &ChannelRecord::variance);
  if (name == "weighted_cost") return weighted_cost(record.lookups_per_sample, weight(record, &ChannelRecord::variance));
  if (name == "variance_x_ns") {
    const std::optional<Real> variance = channel_average(record, &ChannelRecord::variance);
    return variance && record.time ? std::optional(*variance * record.time->ns_per_sample) : std::nullopt;
  }
  if (name == "variance_x_lookups") {
    const std::optional<Real> variance = channel_average(record, &ChannelRecord::variance);
    return variance && record.lookups_per_sample ? std::optional(*variance * *record.lookups_per_sample) : std::nullopt;
  }
  if (name == "sample_rmse") return sample_rmse(record);
  if (name == "samples_per_ray" && record.status == Status::ok) return static_cast<Real>(record.cell.samples_per_ray);
  if (name == "largest_sample") return record.largest_sample;
  if (name == "majorant_violations" && record.status == Status::ok) return static_cast<Real>(record.majorant_violations);
  if (name == "majorant_cells" && record.structure) return static_cast<Real>(record.structure->cells);
  if (name == "draws_per_sample") return record.draws_per_sample;
  if (name == "ns_per_sample" && record.time) return record.time->ns_per_sample;
  if (name == "ns_per_lookup" && record.time) return record.time->ns_per_lookup;
  return std::nullopt;
}

std::optional<Real> metric_theory(const CellRecord& record, std::string_view name) {
  if (name == "mean") return channel_average(record, &ChannelRecord::reference);
  if (name == "rmse") return channel_root_mean_square(record, &ChannelRecord::rmse_theory);
  if (name == "variance") return channel_average(record, &ChannelRecord::variance_theory);
  if (name == "weight_mean") return weight(record, &ChannelRecord::reference);
  if (name == "weight_variance") return weight(record, &ChannelRecord::variance_theory);
  if (name == "weighted_cost") return weighted_cost(record.lookups_theory, weight(record, &ChannelRecord::variance_theory));
  if (name == "lookups_per_sample") return record.lookups_theory;
  if (name == "bias") return channel_average(record, &ChannelRecord::bias_theory);
  if (name == "sample_rmse") return sample_rmse_theory(record);
  if (name == "variance_x_lookups") {
    const std::optional<Real> variance = channel_average(record, &ChannelRecord::variance_theory);
    return variance && record.lookups_theory ? std::optional(*variance * *record.lookups_theory) : std::nullopt;
  }
  return std::nullopt;
}

std::optional<Real> standard_error(const CellRecord& record, std::string_view name) {
  const auto samples = static_cast<Real>(record.samples);
  if (record.status != Status::ok || !(samples > 0)) return std::nullopt;
  if (!predicted_metric(name).empty()) return 0;
  // Errors of channels on one walk go together: the average's is at most their average.
  const auto average = [&](auto&& of_channel) -> std::optional<Real> {
    Real sum = 0;
    for (const ChannelRecord& channel : record.channel) {
      const std::optional<Real> one = of_channel(channel);
      if (!one) return std::nullopt;
      sum += *one;
    }
    return record.channel.empty() ? std::nullopt : std::optional(sum / static_cast<Real>(record.channel.size()));
  };
  const auto of_mean = [&](const ChannelRecord& channel) -> std::optional<Real> {
    const std::optional<Real> variance = channel.variance ? channel.variance : channel.variance_theory;
    return variance ? std::optional(std::sqrt(*variance / samples)) : std::nullopt;
  };
  // Pooled over rays that differ, the kurtosis is larger than that of any law with the rays' mean variance.
  const auto relative_of_variance = [&](const ChannelRecord& channel) -> std::optional<Real> {
    if (channel.variance == Real{0}) return 0;
    return channel.kurtosis ? std::optional(std::sqrt(std::max<Real>(0, *channel.kurtosis - 1) / samples)) : std::nullopt;
  };
  const auto of_variance = [&](const ChannelRecord& channel) -> std::optional<Real> {
    const std::optional<Real> relative = relative_of_variance(channel);
    return relative && channel.variance ? std::optional(*relative * *channel.variance) : std::nullopt;
  };
  const auto of_lookups = [&]() -> std::optional<Real> {
    return record.lookups_variance ? std::optional(std::sqrt(*record.lookups_variance / samples)) : std::nullopt;
  };
  if (name == "mean" || name == "bias") return average(of_mean);
  if (name == "variance") return average(of_variance);
  if (name == "weight_mean") return weight(record) ? of_mean(*weight(record)) : std::nullopt;
  if (name == "weight_variance") return weight(record) ? of_variance(*weight(record)) : std::nullopt;
  if (name == "lookups_per_sample") return of_lookups();
  if (name == "variance_x_lookups") {
    const std::optional<Real> variance = average(of_variance), lookups = of_lookups();
    const std::optional<Real> v = metric(record, "variance"), n = record.lookups_per_sample;
    return variance && lookups && v && n ? std::optional(std::hypot(*variance * *n, *lookups * *v)) : std::nullopt;
  }
  if (name == "sample_rmse") {
    const std::optional<Real> rmse = sample_rmse(record), relative = average(relative_of_variance);
    return rmse && relative ? std::optional(*rmse * *relative / 2) : std::nullopt;
  }
  if (name == "rmse") {
    // Of R squared normal errors whose variances differ: sum of sigma^4 <= R kurtosis (mean sigma^2)^2.
    const std::optional<Real> rmse = metric(record, "rmse");
    if (rmse == Real{0}) return 0;
    const std::optional<Real> factor = average([](const ChannelRecord& channel) { return channel.kurtosis; });
    return rmse && factor ? std::optional(*rmse * std::sqrt(std::max<Real>(1, *factor) / (2 * static_cast<Real>(record.rays))))
                          : std::nullopt;
  }
  if (name == "samples_per_ray" || name == "largest_sample" || name == "majorant_violations" || name == "majorant_cells")
    return 0;
  return std::nullopt;
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
