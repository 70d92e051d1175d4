#include "harness/analysis/scaling.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <boost/math/statistics/linear_regression.hpp>
#include <boost/math/statistics/univariate_statistics.hpp>
#include <cmath>
#include <functional>
#include <set>

#include "harness/config/cell_names.h"
#include "harness/io/transport_json.h"
#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/registry/components.h"

namespace nullmark {
namespace {

/// The number that a parameter is; a list of one number is one.
std::optional<Real> number_of(const ParameterValue& value) {
  if (const Real* real = std::get_if<Real>(&value)) return *real;
  if (const int* whole = std::get_if<int>(&value)) return *whole;
  if (const auto* list = std::get_if<std::vector<Real>>(&value); list && list->size() == 1) return list->front();
  return std::nullopt;
}

void add_numbers(const std::string& prefix, const Component& component, std::map<std::string, Real>& numbers) {
  for (const auto& [name, value] : component.values)
    if (const std::optional<Real> number = number_of(value)) numbers[prefix + name] = *number;
}

/// All that a cell is but one of its parameters.
std::string without(const CellRecord& record, const std::map<std::string, Real>& numbers, const std::string& axis) {
  std::string key =
      fmt::format("{}|{}|{}|{}|{}|{}|{}|{}|{}", record.cell.experiment, record.cell.estimator->type, record.medium->field.type,
                  record.majorant->type, record.ray_set->type, to_string(record.cell.quantity), to_string(record.cell.precision),
                  record.cell.seed, transport_label(record.cell.transport));
  // Text and lists stand in the labels alone; numbers do as well, but would tell the points of a series apart.
  for (const auto* component : {&*record.cell.estimator, &record.medium->field, &*record.majorant, &*record.ray_set})
    for (const auto& [name, value] : component->values)
      if (!number_of(value)) key += "|" + name + ":" + to_text(value);
  for (const MediumSpec& channel : record.medium->per_channel) key += "|" + channel.label;
  if (axis != "channels")
    for (const Real factor : record.medium->spectrum) key += fmt::format("|{}", factor);
  for (const auto& [name, number] : numbers)
    if (name != axis) key += fmt::format("|{}:{}", name, number);
  return key;
}

std::optional<Interval> exponent(const ScalingSeries& series, std::size_t from,
                                 const std::function<std::optional<Real>(const CellRecord&)>& value) {
  std::vector<std::pair<Real, Real>> points;
  for (std::size_t i = from; i < series.cells.size(); ++i)
    if (const std::optional<Real> y = value(*series.cells[i]); y && *y > 0) points.emplace_back(series.x[i], *y);
  return power_law(points);
}

}  // namespace

std::map<std::string, Real> numeric_parameters(const CellRecord& record) {
  std::map<std::string, Real> numbers{{"channels", record.channels}};
  add_numbers("estimator.", *record.cell.estimator, numbers);
  add_numbers("medium.", record.medium->field, numbers);
  add_numbers("majorant.", *record.majorant, numbers);
  add_numbers("rays.", *record.ray_set, numbers);
  return numbers;
}

std::optional<Interval> power_law(const std::vector<std::pair<Real, Real>>& points) {
  std::vector<Real> x, y;
  for (const auto& [work, cost] : points) {
    x.push_back(std::log(work));
    y.push_back(std::log(cost));
  }
  if (x.size() < 3 || std::set<Real>(x.begin(), x.end()).size() < 2) return std::nullopt;
  const auto [intercept, slope] = boost::math::statistics::simple_ordinary_least_squares(x, y);
  Real squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) squares += std::pow(y[i] - intercept - slope * x[i], 2);
  const auto freedom = static_cast<Real>(x.size() - 2);
  const Real scatter = std::sqrt(squares / freedom / (boost::math::statistics::variance(x) * static_cast<Real>(x.size())));
  const Real half = boost::math::quantile(boost::math::students_t(freedom), 0.975) * scatter;
  return Interval{slope, slope - half, slope + half};
}

std::optional<Real> scaled_variance(const CellRecord& record) {
  if (record.outputs.empty()) return metric(record, "relative_variance");
  const std::optional<Real> theory = metric_theory(record, "weight_variance");
  return theory ? theory : metric(record, "weight_variance");
}

std::vector<ScalingSeries> scaling_series(const RunRecord& run) {
  std::vector<ScalingSeries> all;
  std::map<std::string, std::vector<std::pair<Real, const CellRecord*>>> families;
  std::map<std::string, std::string> axes;
  for (const CellRecord& record : run.cells) {
    const bool one_number = record.outputs.empty() || record.cell.quantity == Quantity::free_path;
    if (record.status != Status::ok || !one_number || record.cell.minus) continue;
    const std::map<std::string, Real> numbers = numeric_parameters(record);
    for (const auto& [axis, x] : numbers) {
      if (!(x > 0) || !std::isfinite(x)) continue;
      const std::string key = axis + "|" + without(record, numbers, axis);
      families[key].emplace_back(x, &record);
      axes[key] = axis;
    }
  }
  for (auto& [key, members] : families) {
    if (members.size() < 3) continue;
    std::sort(members.begin(), members.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    const auto same_x = [](const auto& a, const auto& b) { return a.first == b.first; };
    if (std::adjacent_find(members.begin(), members.end(), same_x) != members.end()) continue;
    ScalingSeries series;
    series.axis = axes[key];
    for (const auto& [x, record] : members) {
      series.x.push_back(x);
      series.cells.push_back(record);
    }
    const CellRecord& first = *series.cells.front();
    series.tracker = series.axis.rfind("estimator.", 0) == 0 ? first.cell.estimator->type : tracker_label(first.cell);
    const auto label = [&](const char* prefix, const std::string& whole, const std::string& type) {
      return series.axis.rfind(prefix, 0) == 0 || (series.axis == "channels" && std::string(prefix) == "medium.") ? type : whole;
    };
    series.rest = fmt::format("{} | {} | {} | {} | {}", first.cell.experiment, to_string(first.cell.quantity),
                              label("medium.", first.medium->label, first.medium->field.type),
                              label("majorant.", first.majorant->label, first.majorant->type),
                              label("rays.", first.ray_set->label, first.ray_set->type));
    const auto time = [](const CellRecord& record) {
      return record.time ? std::optional(record.time->ns_per_sample) : std::nullopt;
    };
    series.time = exponent(series, 0, time);
    series.time_upper = exponent(series, series.cells.size() / 2, time);
    series.lookups = exponent(series, 0, [](const CellRecord& record) { return record.lookups_per_sample; });
    series.variance = exponent(series, 0, scaled_variance);
    all.push_back(std::move(series));
  }
  return all;
}

}  // namespace nullmark
