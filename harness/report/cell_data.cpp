#include "harness/report/cell_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <vector>

#include "harness/analysis/scaling.h"
#include "harness/config/cell_names.h"
#include "harness/io/transport_json.h"
#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/verdict/cell_word.h"
#include "harness/verdict/verdict.h"

namespace nullmark {

Json interval(const Interval& x) {
  return {{"value", number_or_null(x.value)}, {"low", number_or_null(x.low)}, {"high", number_or_null(x.high)}};
}

Json interval(const std::optional<Interval>& x) { return x ? interval(*x) : Json(nullptr); }

Json place(const std::optional<std::size_t>& at) { return at ? Json(*at) : Json(nullptr); }

namespace {

Json per_output(const CellRecord& record, std::optional<Real> ChannelRecord::*member) {
  Json list = Json::array();
  for (const ChannelRecord& channel : record.channel) list.push_back(number_or_null(channel.*member));
  return list;
}

Json time_row(const CellRecord& record) {
  if (!record.time) return nullptr;
  return {{"ns_per_sample", interval(median_interval(record.time->repetition_ns))},
          {"ns_per_sample_alone", number_or_null(metric(record, "ns_per_sample_alone"))},
          {"ns_per_lookup", number_or_null(record.time->ns_per_lookup)},
          {"floor_ratio", number_or_null(record.time->floor_ratio)},
          {"loop_ratio", number_or_null(record.time->loop_ratio)}};
}

Json verdict_json_of(const CellRecord& record) {
  if (!record.verdict) return nullptr;
  const VerdictRecord& verdict = *record.verdict;
  Real evidence = 0, epsilon = 0;
  for (const TestRecord& test : verdict.tests) {
    if (test.channel < 0) continue;
    evidence = std::max(evidence, test.log_e_fail);
    if (test.group < 0) epsilon = std::max(epsilon, test.epsilon);
  }
  return {{"epsilon", number_or_null(epsilon)},
          {"log_e_fail", number_or_null(evidence)},
          {"excludes", kind_of(record) == Kind::pass ? number_or_null(excluded_bias(verdict)) : Json(nullptr)},
          {"samples_per_ray", verdict.samples_per_ray}};
}

/// Nanoseconds of one of `samples` samples that share a traversal; nothing where fewer were timed together than that, or others.
std::optional<Interval> sample_time(const Cost& cost, std::uint64_t samples) {
  for (const auto& [size, ns] : cost.ns_by_batch)
    if (size == samples) return ns;
  if (!cost.ns_by_batch.empty() && samples > cost.ns_by_batch.back().first) return cost.ns_by_batch.back().second;
  return std::nullopt;
}

std::vector<std::string> output_names(const CellRecord& record) {
  if (!record.outputs.empty()) return record.outputs;
  if (record.channels == 1) return {""};
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(record.channels));
  for (int c = 0; c < record.channels; ++c) names.push_back(fmt::format("channel {}", c));
  return names;
}

std::vector<std::string> mark_names(const CellRecord& record) {
  std::vector<std::string> names;
  for (const Mark mark : marks_of(record)) names.emplace_back(mark_name(mark));
  return names;
}

}  // namespace

Json cost_json(const RankedCell& ranked) {
  if (!ranked.cost) return nullptr;
  const Cost& cost = *ranked.cost;
  Json seconds = Json::array();
  for (std::size_t i = 0; i < std::size(kTargets); ++i) {
    Json entry = ranked.seconds[i] ? interval(*ranked.seconds[i]) : Json{{"value", nullptr}, {"low", nullptr}, {"high", nullptr}};
    entry["error"] = kTargets[i];
    entry["amortised"] = ranked.amortised[i];
    entry["reached"] = ranked.seconds[i] && std::isfinite(ranked.seconds[i]->value);
    entry["proven"] = is_proven_to_reach(ranked, kTargets[i]);
    seconds.push_back(std::move(entry));
  }
  return {{"basis", cost.analytic ? "analytic" : "sample"},
          {"reference", number_or_null(cost.reference)},
          {"variance", interval(cost.variance)},
          {"variance_x_lookups", interval(cost.variance_x_lookups)},
          {"variance_x_ns", interval(cost.variance_x_ns)},
          {"variance_x_ns_alone", interval(cost.variance_x_ns_alone)},
          {"floor", interval(cost.floor)},
          {"seconds", std::move(seconds)},
          {"pareto", ranked.pareto}};
}

/// Digits enough for a plot: most of a large page is these numbers.
Real for_plots(Real x) { return std::isfinite(x) ? std::strtod(fmt::format("{:.6g}", x).c_str(), nullptr) : x; }

Json plotted(const Interval& x) { return interval({for_plots(x.value), for_plots(x.low), for_plots(x.high)}); }

/// Error and variance of means of 1, 2, 4, ... samples as measured, relative to the reference's root mean square; a mean square
/// over G groups has the relative error sqrt((kurtosis - 1) / G).
Json convergence_row(const CellRecord& record, const std::optional<Cost>& cost) {
  if (!cost || record.channel.empty()) return Json::array();
  Real excess = 0;
  for (const ChannelRecord& channel : record.channel) excess = std::max(excess, channel.kurtosis.value_or(3) - 3);
  Json list = Json::array();
  for (const ConvergenceRecord& step : record.convergence) {
    Real square = 0, variance = 0;
    bool known = step.channel.size() == record.channel.size();
    for (const ConvergenceRecord::Error& error : step.channel) {
      known = known && error.rmse && error.variance;
      if (!known) break;
      square += *error.rmse * *error.rmse / static_cast<Real>(step.channel.size());
      variance += *error.variance / static_cast<Real>(step.channel.size());
    }
    if (!known) continue;
    const auto n = static_cast<Real>(step.samples);
    const Real groups = static_cast<Real>(record.rays) * std::floor(static_cast<Real>(record.cell.samples_per_ray) / n);
    const Real scatter = groups > 0 ? std::sqrt(std::max<Real>(0, 2 + excess / n) / groups) : kInfinity;
    const std::optional<Interval> ns = sample_time(*cost, step.samples);
    list.push_back(
        {{"samples", step.samples},
         {"lookups",
          number_or_null(record.lookups_per_sample ? std::optional(for_plots(n * *record.lookups_per_sample)) : std::nullopt)},
         {"seconds", ns ? plotted(product(*ns, exactly(n * 1e-9))) : Json(nullptr)},
         {"rmse", plotted(relative(std::sqrt(square) / cost->reference, scatter / 2))},
         {"variance", plotted(relative(variance, scatter))}});
  }
  return list;
}

Json cell_json_of(const CellRecord& record, std::size_t run, ReportImages& images, const std::string& file) {
  const Cell& cell = record.cell;
  Json parameters = Json::object();
  for (const auto& [name, value] : numeric_parameters(record)) parameters[name] = number_or_null(value);
  return {{"run", run},
          {"scene", nullptr},
          {"id", cell.id},
          {"name", cell.name},
          {"experiment", cell.experiment},
          {"estimator", tracker_label(cell)},
          {"type", cell.estimator->type},
          {"claims", record.claims},
          {"unbiased", stands_unbiased(record)},
          {"precision", to_string(cell.precision)},
          {"medium", record.medium->label},
          {"majorant", record.majorant->label},
          {"rays", record.ray_set->label},
          {"quantity", to_string(cell.quantity)},
          {"light", transport_label(cell.transport)},
          {"parameters", std::move(parameters)},
          {"outputs", output_names(record)},
          {"status", to_string(record.status)},
          {"reason", record.reason},
          {"word", verdict_word(kind_of(record))},
          {"marked_word", marked_word(record)},
          {"marks", mark_names(record)},
          {"finding", finding_of(record)},
          {"n_rays", record.rays},
          {"samples_per_ray", cell.samples_per_ray},
          {"seed", cell.seed},
          {"mean", per_output(record, &ChannelRecord::mean)},
          {"reference", per_output(record, &ChannelRecord::reference)},
          {"bias", per_output(record, &ChannelRecord::bias)},
          {"rmse", per_output(record, &ChannelRecord::rmse)},
          {"rmse_theory", per_output(record, &ChannelRecord::rmse_theory)},
          {"variance", per_output(record, &ChannelRecord::variance)},
          {"variance_theory", per_output(record, &ChannelRecord::variance_theory)},
          {"lookups", number_or_null(record.lookups_per_sample)},
          {"lookups_theory", number_or_null(record.lookups_theory)},
          {"null_collisions", number_or_null(record.null_collisions_per_sample)},
          {"violations", record.majorant_violations},
          {"largest_violation", number_or_null(record.largest_violation)},
          {"draws", number_or_null(record.draws_per_sample)},
          {"time", time_row(record)},
          {"verdict", verdict_json_of(record)},
          {"cost", nullptr},
          {"convergence", Json::array()},
          {"images", images.add(record, file)}};
}

}  // namespace nullmark
