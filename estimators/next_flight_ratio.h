#pragma once

#include "estimators/estimator.h"

namespace nullmark {

/// Next-flight ratio tracking [Novák et al. 2018, STAR; Georgiev et al. 2019]: every tentative collision adds the chance that the
/// flight from there escapes the majorant.  Unbiased for any rate; (0, inf) where it bounds.  Lookups int mub.
template <class Value>
struct NextFlightRatioTracking {
  static constexpr const char* kName = "next_flight_ratio";
  static constexpr const char* kSummary = "next-flight ratio tracking: expected escape from every tentative collision, weighted";
  static constexpr const char* kSource = "Novak, Georgiev, Hanika, Jarosz 2018; Georgiev et al. 2019";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kLanes = true;

  Claim claim(Quantity) const { return Claim::unbiased; }

  struct Walk {
    Value weight, sum;
  };

  void init(Walk& walk, const auto& ray, auto& flight, auto&) const {
    walk.weight = ray.value(1);
    walk.sum = walk.weight * exponential(-flight.depth_left());
  }

  auto propose(Walk&, const auto&, auto& flight, auto& rng) const { return flight.next(rng); }

  void consume(Walk& walk, const auto&, const auto& at, const Value& extinction, auto&) const {
    walk.weight *= (at.rate() - extinction) / at.rate();
    walk.sum += walk.weight * exponential(-at.depth_left());
  }

  Value result(const Walk& walk, const auto&) const { return walk.sum; }

  /// M2 = G(0) + int_0^d mub a^2 k G dy over local majorants, with v(y) = exp(-int_y^d mub), a = 1 - mu/mub, G = 2 v T(y,d) - v^2
  /// and k(y) = exp(-int_0^y (2 mu - mu^2/mub)).  Nothing where the panels do not resolve v.
  Theory theory(const Passage<Value>& ray, const RayProfile& profile, int c, Quantity) const {
    Theory theory{.lookups = ray.majorant.total_depth(), .lookups_variance = ray.majorant.total_depth()};
    if (!profile.resolved()) return theory;
    const Real tau = profile.optical_depth(c), total = ray.majorant.total_depth();
    const auto square = [&](Real depth_left, Real tau_left) {
      const Real v = std::exp(-depth_left);
      return v * (2 * std::exp(-tau_left) - v);
    };
    const auto rate = [&](const RayProfile::Node& at) { return ray.majorant.rate(at.piece); };
    const auto lost = profile.running(c, [&](const RayProfile::Node& at) {
      return at.extinction > 0 ? 2 * at.extinction - at.extinction * at.extinction / rate(at) : 0;
    });
    const auto ahead = profile.running(c, rate);
    std::size_t j = 0;
    const Real rest = profile.integrate(c, [&](const RayProfile::Node& at) {
      const Real k = std::exp(-lost[j]), depth_left = total - ahead[j];
      ++j;
      if (!(rate(at) > 0)) return Real{0};
      const Real a = (rate(at) - at.extinction) / rate(at);
      return rate(at) * a * a * k * square(depth_left, tau - at.depth);
    });
    theory.variance = std::max<Real>(0, square(total, tau) + rest - std::exp(-2 * tau));
    return theory;
  }
};

}  // namespace nullmark
