#pragma once

#include "estimators/power_series.h"

namespace nullmark {

/// Power-series cumulative estimator [Georgiev et al. 2019]: terms are summed while they grow, and from where one falls below 1
/// the walk goes on to it with its own size as the chance, c = min(1, |W|), which divides it.  Channels share the walk, and c is
/// that of the largest |W|: what the future is multiplied by is common, so each channel stays unbiased, for any rate; (0, inf)
/// where it bounds.
///
/// P_i depends on the points, so there is no closed form but in two cases.  (1) M |a| <= 1 on all of the ray, a = 1 - mu/mub:
/// then c = |W| from the first term on.  With A = int max_c |mub - mu_c|, M = int mub, and A_c = int (mub - mu_c)^2 / max_c |mub
/// - mu_c|, E[W_i^2/P_i] = A_c^i/i!; lookups e^A, their second moment (2A + 1) e^A.  Grey: Var = e^{-2M} ((2A + 1) e^A - e^{2A}).
/// (2) a constant: the walk is the same up to its end, and E[W_i^2/P_i] = (m^i/i!)^2/P_i, m = M a.  Lookups 1 + sum_{i>0} P_i.
template <class Value>
struct PowerSeriesCumulative {
  static constexpr const char* kName = "p_series_cumulative";
  static constexpr const char* kSummary = "power series: sums terms while they grow, then by Russian roulette on their size";
  static constexpr const char* kSource = "Georgiev et al. 2019, p-series cumulative";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kOwnFlights = true;
  static constexpr bool kLanes = true;

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  struct Walk {
    SeriesSum<Value> series;
    Distance<Value> u;  ///< uniform, given that the walk has come so far
    Truth<Value> done;
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    walk.series.start(ray);
    walk.u = uniform_above_zero<Value>(rng);
    walk.done = !(flight.total_depth() > 0);
  }

  auto propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    const auto goes_on = !walk.done;
    if (none(goes_on)) return goes_on;
    land_anywhere(ray, flight, rng, goes_on);
    return goes_on;
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto&) const {
    walk.series.multiply(ray, ray.majorant.total_depth() / at.lookups() * null_ratio(at, extinction));
    const Distance<Value> chance = walk.series.magnitude_to_one();
    const auto goes_on = walk.u < chance;
    walk.done = !goes_on;
    walk.u = walk.u / chance;
    walk.series.at.weight = walk.series.at.weight / select(goes_on, chance, Distance<Value>(1));
    walk.series.add(select(goes_on, Distance<Value>(1), Distance<Value>(kInfinity)));  // nothing for a walk that ends
  }

  Value result(const Walk& walk, const auto&) const { return walk.series.total; }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    if (!(ray.majorant.total_depth() > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    const Ratios ratios = ratios_of(ray);
    if (ratios.constant) return theory_of_constant(ray, profile, c);
    if (ratios.largest * ray.majorant.total_depth() <= 1) return theory_of_roulette_throughout(ray, profile, c);
    return {};
  }

 private:
  /// Bounds of the null ratio along the ray.
  struct Ratios {
    Real largest = 0;      ///< of |a|
    bool constant = true;  ///< every channel's
  };

  static Ratios ratios_of(const MediumRay<Value>& ray) {
    constexpr Real kRounding = 1e-12;
    Ratios ratios;
    std::optional<Spectrum> found;
    for (const Segment& segment : ray.bounds.segments()) {
      if (!(segment.majorant > 0)) continue;
      const Spectrum high = (segment.majorant - segment.extinction.minimum) / segment.majorant;
      const Spectrum low = (segment.majorant - segment.extinction.maximum) / segment.majorant;
      if (!found) found = low;
      ratios.largest = std::max({ratios.largest, high.abs().maxCoeff(), low.abs().maxCoeff()});
      const Real differs = std::max((high - *found).abs().maxCoeff(), (low - *found).abs().maxCoeff());
      ratios.constant = ratios.constant && differs <= kRounding * (1 + found->abs().maxCoeff());
    }
    return ratios;
  }

  static Theory theory_of_constant(const MediumRay<Value>& ray, const RayProfile& profile, int c) {
    const Real depth = ray.majorant.total_depth();
    const auto first = [&](int k) { return series_moments(ray, profile, k).first; };
    std::vector<Real> log_first, log_weight(static_cast<std::size_t>(ray.channels), 0), log_chances{0};
    for (int k = 0; k < ray.channels; ++k) {
      log_first.push_back(std::log(std::abs(first(k))));
      if (log_first.back() == kInfinity) return {};
    }
    constexpr Real kRare = -100;
    Theory theory{.lookups = 1};
    Real squares = 1;
    for (Real i = 1; log_chances.back() > kRare; ++i) {
      Real most = -kInfinity;
      for (std::size_t k = 0; k < log_weight.size(); ++k) most = std::max(most, log_weight[k] += log_first[k] - std::log(i));
      const Real log_chance = std::min<Real>(0, most);
      for (Real& weight : log_weight) weight -= log_chance;
      log_chances.push_back(log_chances.back() + log_chance);
      *theory.lookups += std::exp(log_chances.back());
      squares += (2 * i + 1) * std::exp(log_chances.back());
    }
    const auto log_growth = [&](std::int64_t i) { return -log_chances[static_cast<std::size_t>(i)]; };
    const Real last = static_cast<Real>(log_chances.size()) - 1;
    theory.lookups_variance = std::max<Real>(0, squares - *theory.lookups * *theory.lookups);
    theory.variance = series_variance(depth, first(c), log_growth, last);
    return theory;
  }

  static Theory theory_of_roulette_throughout(const MediumRay<Value>& ray, const RayProfile& profile, int c) {
    const std::vector<RayProfile::Node>& nodes = profile.nodes(c);
    Real all = 0, own = 0;  // A, A_c
    for (std::size_t j = 0; j < nodes.size(); ++j) {
      const Real rate = ray.majorant.rate(nodes[j].piece), null = rate - nodes[j].extinction;
      Real most = 0;
      for (int k = 0; k < ray.channels; ++k) most = std::max(most, std::abs(rate - profile.nodes(k)[j].extinction));
      all += nodes[j].weight * most;
      if (most > 0) own += nodes[j].weight * null * null / most;
    }
    const SeriesMoments moments = series_moments(ray, profile, c);
    const auto log_growth = [&](std::int64_t n) {
      const auto i = static_cast<Real>(n);
      return i * std::log(own / (moments.first * moments.first)) + log_factorial(i);
    };
    constexpr Real kLast = 60;
    return {.variance = series_variance(moments.depth, moments.first, log_growth, kLast),
            .lookups = std::exp(all),
            .lookups_variance = (2 * all + 1) * std::exp(all) - std::exp(2 * all)};
  }
};

}  // namespace nullmark
