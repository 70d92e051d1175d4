#pragma once

#include <array>

#include "estimators/estimator.h"

namespace nullmark {

/// Transmittance through pink noise, g(tau) = (1 + tau C^2)^{-1/C^2}, of which e^{-tau} is the limit C = 0, by its Taylor series
/// about the majorant's depth M [Misso, Bitterli, Georgiev, Jarosz 2022]:
///
///   g(tau) = g(M) sum_j A_j ((M - tau)/(1 + M C^2))^j,   A_j = prod_{i<=j} (1 + (i - 1) C^2)/i.
///
/// Term j has the chance A_j, one acceptance after the other, and one more factor w = M (1 - mu/mub)(x)/(1 + M C^2), x uniform in
/// majorant depth, so that sums of w products are unbiased.  The series converges for tau < 2 M + 1/C^2: any bound, and lower
/// ones as well.  Non-negative and unbounded.  With m1 = E w, m2 = E w^2 and G(z) = sum_j A_j z^j = (1 - C^2 z)^{-1/C^2}:
///
///   E X^2 = g(M)^2 (G(m2) + 2 m1 (G(m1) - G(m2))/(m1 - m2)), infinite from C^2 m2 = 1 on; lookups G(1) - 1 in any medium.
template <class Value>
struct TaylorPinkNoise {
  static constexpr const char* kName = "taylor_pink_noise";
  static constexpr const char* kSummary = "Taylor series about the majorant for the transmittance of pink noise";
  static constexpr const char* kSource = "Misso, Bitterli, Georgiev, Jarosz 2022, Sec. 6";
  static constexpr SampleRange kRange = SampleRange::non_negative;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kOwnFlights = true;
  static constexpr bool kHeavySamples = true;

  Real c = 0.3;

  void parameters(ParameterVisitor& visit) {
    visit.number("c", c, {0, 0.99, true}, "", "relative deviation C of the noise; T = (1 + tau C^2)^{-1/C^2}");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  Value expected(const Value& tau, const MediumRay<Value>& ray) const {
    Value target = tau;
    for (int i = 0; i < ray.channels; ++i) channel(target, i) = attenuation(channel(tau, i));
    return target;
  }

  struct Walk {
    Value product, sum;
    Real order = 0;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto&) const { walk = {ray.value(1), ray.value(1), 0}; }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto& rng) const {
    const Real depth = ray.majorant.total_depth();
    ++walk.order;
    if (!(depth > 0) || !(rng.uniform() * walk.order < 1 + (walk.order - 1) * c * c)) return false;
    return flight.land(rng.uniform() * depth);
  }

  void consume(Walk& walk, const MediumRay<Value>& ray, const Flight& at, const Value& extinction, auto&) const {
    walk.product *= null_ratio(at, extinction) * scale(ray);
    walk.sum += walk.product;
  }

  Value result(const Walk& walk, const MediumRay<Value>& ray) const { return walk.sum * attenuation(ray.majorant.total_depth()); }

  Theory theory(const MediumRay<Value>& ray, const RayProfile& profile, int i, Quantity) const {
    const Real depth = ray.majorant.total_depth();
    if (!(depth > 0)) return {.variance = 0, .lookups = 0, .lookups_variance = 0};
    // E[(factor - from)^power]
    const auto moment = [&](int power, Real from) {
      return profile.integrate(i, [&](const RayProfile::Node& at) {
        const Real rate = ray.majorant.rate(at.piece);
        return rate > 0 ? rate * std::pow((rate - at.extinction) / rate * scale(ray) - from, power) : 0;
      }) / depth;
    };
    const Real m1 = moment(1, 0), m2 = moment(2, 0), square = c * c;
    // A_j r^j summed in closed form, and its derivative at 1.
    const auto sum = [&](Real z) { return std::exp(-std::log1p(-square * z) / square); };
    const Real terms = sum(1), slope = terms / (1 - square);
    Theory theory{.lookups = terms - 1, .lookups_variance = 2 * slope - (terms - 1) - (terms - 1) * (terms - 1)};
    if (!(square * m2 < 1)) {
      theory.variance = kInfinity;
      return theory;
    }
    // (G(m1) - G(m2))/(m1 - m2) of equal arguments is G'.
    const Real apart = m1 - m2, quotient = std::abs(apart) > 1e-8 ? (sum(m1) - sum(m2)) / apart : sum(m1) / (1 - square * m1);
    const Real start = attenuation(depth), mean = attenuation(profile.optical_depth(i));
    theory.variance = start * start * (sum(m2) + 2 * m1 * quotient) - mean * mean;
    // Where that is a difference of large numbers the factors are small.
    if (*theory.variance < 1e-6 * mean * mean) theory.variance = start * start * variance_of_few(m1, m2, moment(2, m1));
    return theory;
  }

 private:
  /// sum_i (A_i m2^i - A_i^2 m1^2i) (2 B_i - 1), B_i = sum_{j>=i} A_j m1^(j-i) / A_i, of small factors of variance `centred`.
  Real variance_of_few(Real m1, Real m2, Real centred) const {
    constexpr int kTerms = 16;
    std::array<Real, kTerms + 1> chance = {1}, ahead;  // A_i, B_i
    const auto survival = [&](int i) { return (1 + (i - 1) * c * c) / i; };
    for (int i = 1; i <= kTerms; ++i) chance[i] = chance[i - 1] * survival(i);
    ahead[kTerms] = 1;
    for (int i = kTerms; i > 1; --i) ahead[i - 1] = 1 + m1 * survival(i) * ahead[i];
    Real sum = centred * (2 * ahead[1] - 1);
    for (int i = 2; i <= kTerms; ++i) sum += chance[i] * (std::pow(m2, i) - chance[i] * std::pow(m1, 2 * i)) * (2 * ahead[i] - 1);
    return sum;
  }

  Real attenuation(Real tau) const { return std::exp(-std::log1p(tau * c * c) / (c * c)); }
  Real scale(const MediumRay<Value>& ray) const {
    const Real depth = ray.majorant.total_depth();
    return depth / (1 + depth * c * c);
  }
};

}  // namespace nullmark
