#pragma once

#include <numbers>

#include "estimators/estimator.h"
#include "estimators/theory/debiased_theory.h"

namespace nullmark {

/// Transmittance from two optical depths X_0, X_1 that are normal with mean tau and standard deviation s, whatever the medium:
/// the case for which the jackknife is made [Peters 2025; Gray et al. 1973].  tau is the ray's own, and nothing is looked up.
///
///   jackknife   cos((X_0 - X_1)/2) e^{-(X_0 + X_1)/2}: unbiased, Var = e^{-2 tau} (e^{s^2} - 1)/2
///   naive       e^{-(X_0 + X_1)/2}: mean e^{-tau + s^2/4}, Var = e^{-2 tau} (e^{s^2} - e^{s^2/2})
template <class Value>
struct JackknifeNormal {
  static constexpr const char* kName = "jackknife_normal";
  static constexpr const char* kSummary = "jackknife transmittance of two optical depths that are normally distributed";
  static constexpr const char* kSource = "Peters 2025; Gray, Watkins, Schucany 1973";
  static constexpr SampleRange kRange = SampleRange::any_sign;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kIgnoresMajorant = true;
  static constexpr bool kGreyOnly = true;
  static constexpr bool kNeedsOpticalDepth = true;

  Real deviation = 0.3;
  std::string mean = "jackknife";

  void parameters(ParameterVisitor& visit) {
    visit.number("deviation", deviation, Range::between(0, 5), "", "standard deviation s of an optical depth");
    visit.choice("mean", mean, {"jackknife", "naive"}, "jackknife transmittance, or e^{-mean}");
  }

  Guarantee claim(Quantity) const { return mean == "naive" ? Guarantee::biased : Guarantee::unbiased; }

  struct Walk {
    Real x = 0, y = 0;  ///< standard normal numbers
  };

  void init(Walk& walk, const MediumRay<Value>&, Flight&, auto& rng) const {
    const Real radius = std::sqrt(2 * rng.exponential()), angle = 2 * std::numbers::pi * rng.uniform();
    walk = {radius * std::cos(angle), radius * std::sin(angle)};
  }

  bool propose(Walk&, const MediumRay<Value>&, Flight&, auto&) const { return false; }
  void consume(Walk&, const MediumRay<Value>&, const Flight&, const Value&, auto&) const {}

  Value result(const Walk& walk, const MediumRay<Value>& ray) const {
    if (!(ray.length() > 0)) return ray.value(1);
    const Value naive = exponential(Value(-*ray.exact_depth)) * std::exp(-deviation * (walk.x + walk.y) / 2);
    return mean == "naive" ? naive : naive * jackknife_factor(2, deviation * std::abs(walk.x - walk.y) / 2);
  }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    if (!(ray.length() > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    const Real square = deviation * deviation, transmittance = std::exp(-profile.optical_depth(c));
    Theory theory{.lookups = 0, .lookups_variance = 0};
    if (mean == "naive") {
      theory.mean = transmittance * std::exp(square / 4);
      theory.variance = *theory.mean * *theory.mean * std::expm1(square / 2);
    } else {
      theory.variance = transmittance * transmittance * std::expm1(square) / 2;
    }
    return theory;
  }
};

}  // namespace nullmark
