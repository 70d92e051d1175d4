#include "harness/verdict/convergence_order.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "harness/model/metrics.h"
#include "harness/model/names.h"
#include "harness/registry/components.h"

namespace nullmark {
namespace {

constexpr Real kTolerance = 0.25;
constexpr Real kResolved = 4, kBeyondReference = 10;
/// Two-sided 1e-4.
constexpr Real kQuantile = 3.89;
constexpr std::size_t kFewestSteps = 3;
/// A power law that misses a bias by so many of its standard errors is none: an order is claimed of small steps only, not of
/// steps that skip a medium's detail.
constexpr Real kPowerLaw = 5;

std::string without_steps(const CellRecord& record) {
  std::string label = record.cell.estimator->type;
  for (const auto& [name, value] : record.cell.estimator->values)
    if (name != "steps") label += fmt::format("/{}:{}", name, to_text(value));
  return fmt::format("{}/{}/{}/{}", label, record.medium->label, to_string(record.cell.quantity), record.ray_set->label);
}

struct Point {
  Real bias, error;
};

OrderFit fit(const std::string& name, Real claimed, const std::map<int, Point>& points) {
  OrderFit result;
  result.name = name;
  result.claimed = claimed;
  struct Term {
    Real x, y, sigma;
    bool positive;
  };
  std::vector<Term> terms;
  Real w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
  for (const auto& [steps, p] : points) {
    if (!(std::abs(p.bias) > kResolved * p.error)) continue;
    result.steps.push_back(steps);
    const Real x = -std::log(steps), y = std::log(std::abs(p.bias));
    // Finite steps are not the limit yet: no point counts as better than 1 %.
    const Real sigma = std::max<Real>(0.01, p.error / std::abs(p.bias)), weight = 1 / (sigma * sigma);
    terms.push_back({x, y, sigma, p.bias > 0});
    w += weight;
    wx += weight * x;
    wy += weight * y;
    wxx += weight * x * x;
    wxy += weight * x * y;
  }
  if (result.steps.size() < kFewestSteps) {
    result.reason =
        fmt::format("order not resolved: the bias stands out of its noise at {} of {} numbers of steps; take more samples",
                    result.steps.size(), points.size());
    return result;
  }
  const Real spread = w * wxx - wx * wx;
  result.order = (w * wxy - wx * wy) / spread;
  result.half_width = kQuantile * std::sqrt(w / spread);
  const Real start = (wy - result.order * wx) / w;
  const Term &last = terms.back(), &before = terms[terms.size() - 2];
  const Real finest = (last.y - before.y) / (last.x - before.x);
  const Real finest_half_width = kQuantile * std::hypot(last.sigma, before.sigma) / (before.x - last.x);
  if (std::any_of(terms.begin(), terms.end(), [&](const Term& term) { return term.positive != last.positive; }))
    result.reason = "order not resolved: the bias changes its sign; take finer steps";
  else if (std::any_of(terms.begin(), terms.end(), [&](const Term& term) {
             return std::abs(term.y - start - result.order * term.x) > kPowerLaw * term.sigma;
           }))
    result.reason = "order not resolved: the biases follow no power of the step; take finer steps";
  else if (result.order + result.half_width >= claimed - kTolerance)
    if (result.order - result.half_width > claimed - kTolerance)
      result.outcome = Outcome::pass;
    else
      result.reason = "order not resolved: its interval holds the claim and less; take more samples";
  else if (finest + finest_half_width < claimed - kTolerance && finest <= result.order + kTolerance)
    result.outcome = Outcome::fail;
  else
    result.reason = fmt::format("order not resolved: it is {:.3f} +- {:.3f} between the two finest steps; take finer ones",
                                finest, finest_half_width);
  return result;
}

}  // namespace

std::vector<OrderFit> fit_orders(const std::vector<CellRecord>& cells) {
  struct Series {
    Real claimed;
    std::map<int, Point> points;  ///< by numbers of steps
  };
  std::map<std::string, Series> series;
  for (const CellRecord& record : cells) {
    const auto steps = record.cell.estimator->values.find("steps");
    // What is done to samples has a bias of its own.
    if (record.cell.measurement != Measurement{} || !record.outputs.empty()) continue;
    // Rounding cannot be told from a bias.
    if (record.cell.precision != Precision::float64) continue;
    if (record.status != Status::ok || record.claims != "consistent" || !record.order || record.channel.empty() ||
        steps == record.cell.estimator->values.end() || !std::holds_alternative<int>(steps->second))
      continue;
    const ChannelRecord& channel = record.channel.front();
    const std::optional<Real>& variance = best_variance(channel);
    if (!channel.bias || !variance) continue;
    const Real noise = std::sqrt(*variance / static_cast<Real>(record.samples));
    const Real error = std::max({noise, kBeyondReference / kResolved * channel.reference_error.value_or(0), 1e-14});
    // Of T the error of the optical depth, -log(mean/T), which follows its power law however deep the medium is.
    Real bias = *channel.bias, slope = 1;
    if (record.cell.quantity == Quantity::transmittance) {
      const Real reference = channel.reference.value_or(0);
      slope = reference + bias;
      bias = std::log1p(bias / reference);
      if (!(reference > 0 && slope > 0)) continue;
    }
    auto& [claimed, points] = series.try_emplace(without_steps(record), Series{*record.order, {}}).first->second;
    const Point point{bias, error / slope};
    const auto [at, is_new] = points.try_emplace(std::get<int>(steps->second), point);
    if (!is_new && point.error < at->second.error) at->second = point;
  }
  std::vector<OrderFit> fits;
  for (const auto& [name, one] : series)
    if (one.points.size() >= kFewestSteps) fits.push_back(fit(name, one.claimed, one.points));
  return fits;
}

}  // namespace nullmark
