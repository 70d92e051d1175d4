#pragma once

#include <string>
#include <type_traits>
#include <vector>

#include "estimators/estimator.h"

namespace nullmark {

/// What decomposition trackers ask of `control_albedo`, the share of the control that scatters.  Its collisions look nothing up,
/// so they cannot tell an albedo that varies.
inline void expect_control_albedo(const MatterBounds& medium, const std::vector<Real>& control_albedo) {
  if (medium.albedo_varies && control_albedo.empty())
    throw ParameterError("control_albedo",
                         "the medium's albedo varies, and the control looks nothing up; expected the share of "
                         "the control that scatters");
}

/// How a walk of decomposition tracking ended.  Without a control_albedo the scene's albedo chooses.
EventKind decomposed_end(const auto& walk, const std::vector<Real>& control_albedo) {
  if (!walk.done) return EventKind::escape;
  if (control_albedo.empty()) return EventKind::collision;
  return walk.scatters ? EventKind::scatter : EventKind::absorb;
}

/// mu_s / mu of a grey medium at a distance, or at those of many walks.
auto grey_albedo(const auto& ray, const auto& t) {
  return one_by_one(t, [&](Real distance) { return channel(ray.albedo_at(distance), 0); });
}

/// The control extinction mu_c(t) of residual tracking along a ray, with tau_c in closed form and the rate that goes with it.
///
///   minimum, average, middle, maximum   of the segment's bounds (one segment: of the medium; a grid: of each super-voxel)
///   medium_average                      over the whole medium
///   ray_average                         tau/d, from the medium's own closed form or exact traversal
///   gamma                               min + mubr (gamma^{1/(D mubr)} - 1), cut to [min, average], with the super-voxel's
///                                       diagonal D and mubr = max(max - min, floor) [Novák et al. 2014, Sec. 5.1; derived
///                                       from its purpose]
///   given                               `value`
///   linear, exponential                 from `value` at the ray's begin to `value_end` at its end
struct ControlChoice {
  std::string kind = "minimum";
  Real value = 0, value_end = 0, gamma = 2;
  std::string rate = "deviation";
  Real rate_scale = 1;

  static constexpr Real kGammaRateFloor = 0.1;

  void rate_parameters(ParameterVisitor& visit) {
    visit.choice("rate", rate, {"deviation", "majorant"},
                 "residual rate mubr: max |mu - mu_c| from the segment's bounds, or the segment's majorant");
    visit.number("rate_scale", rate_scale, Range::positive(), "", "factor on the residual rate");
  }

  void parameters(ParameterVisitor& visit) {
    visit.choice(
        "control", kind,
        {"minimum", "average", "middle", "maximum", "medium_average", "ray_average", "gamma", "given", "linear", "exponential"},
        "control extinction: from the segment's bounds, the medium or the ray, by the gamma rule, or given");
    visit.number("value", value, Range::non_negative(), "1/length",
                 "control extinction (given), or at the ray's begin (linear, exponential)");
    visit.number("value_end", value_end, Range::non_negative(), "1/length",
                 "control extinction at the ray's end (linear, exponential)");
    visit.number("gamma", gamma, {1, 1e6, true}, "",
                 "bound of the residual estimate at the expected number of collisions (gamma)");
    rate_parameters(visit);
  }

  bool is_profile() const { return kind == "linear" || kind == "exponential"; }
};

/// The control as one ray sees it.
template <class Value>
struct Control {
  std::vector<Value> of_segment;    ///< constant in each segment; unused for profiles
  std::vector<Value> depth_before;  ///< tau_c from the ray's begin to each segment
  std::vector<Real> segment_begin;
  bool linear = false, exponential_profile = false;
  Real begin = 0, length = 0, first = 0,
       growth = 0;  ///< profile: first + growth s, or first e^{growth s}, s = (t - begin)/length
  int channels = 1;
  Value depth;  ///< tau_c over the ray
  /// int max(mu_c, mu_max - mu_c - 2 mubr), at most its largest channel's: with |w| = |1 - (mu - mu_c)/mubr| the residual's
  /// weight has E|W| <= e^growth_depth [Poisson product].
  Real growth_depth = 0;

  template <class Distance>
  Distance profile(const Distance& t) const {
    const Distance s = (t - begin) / length;
    return linear ? Distance(first + growth * s) : Distance(first * exponential(growth * s));
  }

  /// tau_c from the ray's begin to a distance t on it, in closed form; 0 on a ray that misses the medium.
  Value depth_to(Real t) const {
    if (!(length > 0)) return uniform_value<Value>(channels, 0);
    const Real s = (t - begin) / length;
    if (linear) return uniform_value<Value>(channels, length * s * (first + growth * s / 2));
    if (exponential_profile)
      return uniform_value<Value>(channels, length * first * (growth == 0 ? s : std::expm1(growth * s) / growth));
    const auto after = std::upper_bound(segment_begin.begin() + 1, segment_begin.end(), t);
    const auto segment = static_cast<std::size_t>(after - segment_begin.begin()) - 1;
    return depth_before[segment] + of_segment[segment] * (t - segment_begin[segment]);
  }

  /// At a distance on a segment; many of both give as many.
  template <class Distance, class Segment>
  auto at(const Distance& t, const Segment& segment) const -> std::remove_cvref_t<decltype(entry(of_segment, segment))> {
    using Result = std::remove_cvref_t<decltype(entry(of_segment, segment))>;
    if (!linear && !exponential_profile) return entry(of_segment, segment);
    if constexpr (std::is_same_v<Distance, Real>)
      return uniform_value<Result>(channels, profile(t));
    else
      return Result(profile(t));
  }
};

/// What a control that is no profile is in a segment.
template <class Value>
Value constant_control(const ControlChoice& choice, const MediumRay<Value>& ray, const Segment& segment, const Value& low,
                       const Value& high, const Value& average) {
  if (choice.kind == "average") return average;
  if (choice.kind == "middle") return (low + high) / 2;
  if (choice.kind == "maximum") return high;
  if (choice.kind == "medium_average") return load<Value>(ray.medium->average.data(), ray.channels);
  if (choice.kind == "ray_average") return *ray.exact_depth / ray.length();
  if (choice.kind == "given") return ray.value(choice.value);
  if (choice.kind != "gamma") return low;
  Value constant = low;
  for (int c = 0; c < ray.channels; ++c) {
    const Real rate = std::max(channel(high, c) - channel(low, c), ControlChoice::kGammaRateFloor);
    const Real raised = channel(low, c) + rate * std::expm1(std::log(choice.gamma) / (segment.diagonal * rate));
    channel(constant, c) = std::clamp(raised, channel(low, c), std::max(channel(low, c), channel(average, c)));
  }
  return constant;
}

/// Control and residual rate of every segment of a ray.
template <class Value>
void prepare_control(const ControlChoice& choice, const MediumRay<Value>& ray, Control<Value>& control, Rates& residual) {
  const auto value = [](const Spectrum& x) { return load<Value>(x.data(), static_cast<int>(x.size())); };
  control.of_segment.clear();
  control.depth_before.clear();
  control.segment_begin.clear();
  control.linear = choice.kind == "linear";
  control.exponential_profile = choice.kind == "exponential";
  control.channels = ray.channels;
  control.begin = ray.begin;
  control.length = ray.length();
  control.first = choice.value;
  control.depth = ray.value(0);
  control.growth_depth = 0;
  residual.start(ray.begin, ray.bounds.crossing());
  if (!(ray.length() > 0)) return;
  if (control.linear) {
    control.growth = choice.value_end - choice.value;
    control.depth = ray.value((choice.value + choice.value_end) / 2 * ray.length());
  } else if (control.exponential_profile) {
    control.growth = std::log(choice.value_end / choice.value);
    const Real mean = control.growth == 0 ? 1 : std::expm1(control.growth) / control.growth;
    control.depth = ray.value(choice.value * mean * ray.length());
  }
  for (const Segment& segment : ray.bounds.segments()) {
    const Value low = value(segment.extinction.minimum), high = value(segment.extinction.maximum),
                average = value(segment.extinction.average);
    Value least = low, most = low;  // of the control inside the segment
    if (choice.is_profile()) {
      const Value a = control.at(segment.begin, 0), b = control.at(segment.end, 0);
      for (int c = 0; c < ray.channels; ++c) {
        channel(least, c) = std::min(channel(a, c), channel(b, c));
        channel(most, c) = std::max(channel(a, c), channel(b, c));
      }
    } else {
      const Value constant = constant_control(choice, ray, segment, low, high, average);
      least = most = constant;
      control.of_segment.push_back(constant);
      control.depth_before.push_back(control.depth);
      control.segment_begin.push_back(segment.begin);
      control.depth += constant * (segment.end - segment.begin);
    }
    Real deviation = 0;
    for (int c = 0; c < ray.channels; ++c)
      deviation = std::max({deviation, channel(high, c) - channel(least, c), channel(most, c) - channel(low, c)});
    const Real rate = choice.rate_scale * (choice.rate == "majorant" ? segment.majorant : deviation);
    residual.append(segment.end, rate);
    Real growth = 0;
    for (int c = 0; c < ray.channels; ++c)
      growth = std::max({growth, channel(most, c), channel(high, c) - channel(least, c) - 2 * rate});
    control.growth_depth += growth * (segment.end - segment.begin);
  }
}

}  // namespace nullmark
