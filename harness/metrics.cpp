#include "harness/metrics.h"

#include <cmath>

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
std::optional<Real> weight(const CellRecord& record, Field field) {
  for (std::size_t o = 0; o < record.outputs.size() && o < record.channel.size(); ++o)
    if (record.outputs[o].rfind("weight", 0) == 0) return record.channel[o].*field;
  return std::nullopt;
}

/// Lookups that a flight of effective weight 1 costs: N E[w^2] [Kutz et al. 2017, Sec. 4.3].
std::optional<Real> weighted_cost(const std::optional<Real>& lookups, const std::optional<Real>& variance) {
  return lookups && variance ? std::optional(*lookups * (1 + *variance)) : std::nullopt;
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
                                                  "variance_x_ns"};
  return kNames;
}

std::optional<Real> metric(const CellRecord& record, std::string_view name) {
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
