#include "estimators/theory/march_theory.h"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>

namespace nullmark {
namespace {

using Rule = boost::math::quadrature::gauss<Real, 10>;

/// Nodes and weights of a 10-point rule over [a, b], appended.
void append_rule(Real a, Real b, std::vector<Real>& x, std::vector<Real>& w) {
  const auto& abscissa = Rule::abscissa();
  const auto& weight = Rule::weights();
  for (std::size_t i = 0; i < abscissa.size(); ++i) {
    for (const Real sign : {-1., 1.}) {
      x.push_back((a + b) / 2 + sign * abscissa[i] * (b - a) / 2);
      w.push_back(weight[i] * (b - a) / 2);
    }
  }
}

}  // namespace

std::vector<Real> extinction_at(const RayProfile& profile, int c, const std::vector<Real>& t) {
  const auto channels = static_cast<std::size_t>(profile.channels());
  std::vector<Real> all(t.size() * channels);
  profile.extinction(t.data(), t.size(), all.data());
  if (channels == 1) return all;
  std::vector<Real> mu(t.size());
  for (std::size_t i = 0; i < t.size(); ++i) mu[i] = all[i * channels + static_cast<std::size_t>(c)];
  return mu;
}

Nodes stratum_nodes(const RayProfile& profile, int steps) {
  const Real h = (profile.end() - profile.begin()) / steps;
  Nodes nodes;
  std::size_t cut = 0;
  const auto cuts = profile.cuts();
  for (int j = 0; j < steps; ++j) {
    nodes.first.push_back(nodes.x.size());
    Real a = profile.begin() + j * h;
    const Real end = j + 1 == steps ? profile.end() : profile.begin() + (j + 1) * h;
    while (a < end) {
      while (cut < cuts.size() && cuts[cut] <= a) ++cut;
      const Real b = cut < cuts.size() ? std::min(end, cuts[cut]) : end;
      append_rule(a, b, nodes.x, nodes.w);
      a = b;
    }
  }
  nodes.first.push_back(nodes.x.size());
  return nodes;
}

std::optional<Nodes> offset_nodes(const RayProfile& profile, Real steps, int parts) {
  const Real h = (profile.end() - profile.begin()) / steps;
  std::vector<Real> offsets{0, 1};
  for (const Real cut : profile.cuts()) {
    const Real in_steps = (cut - profile.begin()) / h;
    offsets.push_back(in_steps - std::floor(in_steps));
  }
  std::sort(offsets.begin(), offsets.end());
  offsets.erase(std::unique(offsets.begin(), offsets.end(), [](Real a, Real b) { return b - a < 1e-12; }), offsets.end());
  constexpr Real kMostLookups = 200'000;
  if (static_cast<Real>(offsets.size() * 10) * parts * steps > kMostLookups) return std::nullopt;
  Nodes nodes;
  for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
    const Real width = offsets[i + 1] - offsets[i];
    for (int part = 0; part < parts; ++part)
      append_rule(offsets[i] + width * part / parts, part + 1 == parts ? offsets[i + 1] : offsets[i] + width * (part + 1) / parts,
                  nodes.x, nodes.w);
  }
  return nodes;
}

Theory fixed_march(const RayProfile& profile, int c, int steps, Real offset, Quantity quantity) {
  const Real h = (profile.end() - profile.begin()) / steps;
  std::vector<Real> t(static_cast<std::size_t>(steps));
  for (std::size_t j = 0; j < t.size(); ++j) t[j] = profile.begin() + (static_cast<Real>(j) + offset) * h;
  Real sum = 0;
  for (const Real mu : extinction_at(profile, c, t)) sum += mu;
  return {.mean = quantity == Quantity::transmittance ? std::exp(-h * sum) : h * sum, .variance = 0};
}

Theory stratified_march(const RayProfile& profile, int c, int steps, Quantity quantity) {
  const Real h = (profile.end() - profile.begin()) / steps;
  const auto [t, w, first] = stratum_nodes(profile, steps);
  const std::vector<Real> mu = extinction_at(profile, c, t);

  // Var prod Y_j = prod E[Y_j]^2 (prod (1 + v_j) - 1), v_j the relative variance of one factor, in a form that does not cancel.
  Real log_mean = 0, log_growth = 0, tau = 0, tau_variance = 0;
  for (std::size_t j = 0; j + 1 < first.size(); ++j) {
    Real mean = 0, depth = 0;
    for (std::size_t i = first[j]; i < first[j + 1]; ++i) {
      mean += w[i] / h * std::exp(-h * mu[i]);
      depth += w[i] * mu[i];
    }
    Real spread = 0, depth_spread = 0;
    for (std::size_t i = first[j]; i < first[j + 1]; ++i) {
      const Real deviation = mean > 0 ? std::exp(-h * mu[i]) / mean - 1 : 0;
      spread += w[i] / h * deviation * deviation;
      depth_spread += w[i] / h * (h * mu[i] - depth) * (h * mu[i] - depth);
    }
    log_mean += std::log(mean);
    log_growth += std::log1p(spread);
    tau += depth;
    tau_variance += depth_spread;
  }
  if (quantity == Quantity::optical_depth) return {.mean = tau, .variance = tau_variance};
  return {.mean = std::exp(log_mean), .variance = product_variance(log_mean, log_growth)};
}

Theory uniform_march(const RayProfile& profile, int c, int steps, Quantity quantity) {
  const Real h = (profile.end() - profile.begin()) / steps;
  const auto nodes = offset_nodes(profile, steps);
  if (!nodes) return {};
  const std::vector<Real>&u = nodes->x, &w = nodes->w;
  std::vector<Real> t;
  for (const Real o : u)
    for (int j = 0; j < steps; ++j) t.push_back(profile.begin() + (j + o) * h);
  const std::vector<Real> mu = extinction_at(profile, c, t);
  std::vector<Real> x(u.size());
  Real mean = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    Real sum = 0;
    for (std::size_t j = 0; j < static_cast<std::size_t>(steps); ++j) sum += mu[i * static_cast<std::size_t>(steps) + j];
    x[i] = quantity == Quantity::transmittance ? std::exp(-h * sum) : h * sum;
    mean += w[i] * x[i];
  }
  Real variance = 0;
  for (std::size_t i = 0; i < u.size(); ++i) variance += w[i] * (x[i] - mean) * (x[i] - mean);
  return {.mean = mean, .variance = variance};
}

}  // namespace nullmark
