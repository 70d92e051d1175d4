#include <algorithm>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/bessel.hpp>
#include <cmath>
#include <complex>
#include <numbers>

#include "estimators/theory/debiased_theory.h"
#include "estimators/theory/march_law.h"
#include "media/base/lanes.h"

namespace nullmark {
namespace {

using Complex = std::complex<Real>;

/// Optical depth of one march as a sum of independent parts, each less its mean.
struct MarchLaw {
  std::vector<Law> parts;
  Real mean = 0, variance = 0;
  Real reach = 0;  ///< bound on |X - E X|

  void add(Law law) {
    const Real m = law.mean();
    mean += m;
    for (Real& x : law.x) x -= m;
    variance += law.variance();
    Real farthest = 0;
    for (const Real x : law.x) farthest = std::max(farthest, std::abs(x));
    reach += farthest;
    parts.push_back(std::move(law));
  }

  /// log E e^{s (X - E X)}, in a form that does not cancel.
  Complex log_characteristic(Complex s) const;
};

/// e^s - 1 without cancellation.
Complex complex_expm1(Complex s) {
  const Real half = std::sin(s.imag() / 2);
  return {std::expm1(s.real()) * std::cos(s.imag()) - 2 * half * half, std::exp(s.real()) * std::sin(s.imag())};
}

Complex complex_log1p(Complex z) { return {std::log1p(2 * z.real() + std::norm(z)) / 2, std::arg(Real{1} + z)}; }

Complex MarchLaw::log_characteristic(Complex s) const {
  Complex sum = 0;
  for (const Law& law : parts) {
    // The mean of e^{s x} - 1, as in complex_expm1.
    const auto [real, imaginary] = sum_in_lanes<Real>(law.x.size(), [&](std::size_t i, auto pack) {
      using Pack = decltype(pack);
      const Pack x = Pack::load(&law.x[i]), w = Pack::load(&law.w[i]), growth = Pack(s.real()) * x, turn = Pack(s.imag()) * x;
      const Pack half = sine(turn * Pack(.5)), less = one_minus_exponential(growth);
      return std::array{-w * (less * cosine(turn) + Pack(2) * half * half), w * (Pack(1) - less) * sine(turn)};
    });
    sum += complex_log1p({real, imaginary});
  }
  return sum;
}

/// phi(real + i u) - 1 of a march for |u| <= 1, by its Chebyshev interpolant: phi is entire, and the march is asked for it often.
/// n points are off by (reach/2)^n/n! of phi(real), relatively: 24 by 3e-17 up to a reach of 4.
class Characteristic {
 public:
  Characteristic(const MarchLaw& march, Real real) : points_(march.reach <= 4 ? kMostPoints / 2 : kMostPoints) {
    for (std::size_t k = 0; k < points_; ++k) {
      const Real angle = std::numbers::pi * (static_cast<Real>(k) + .5) / static_cast<Real>(points_);
      u_[k] = std::cos(angle);
      weight_[k] = (k % 2 == 0 ? 1 : -1) * std::sin(angle);
      const std::size_t opposite = points_ - 1 - k;
      const Complex value = k < points_ / 2 ? complex_expm1(march.log_characteristic({real, u_[k]}))
                                            : Complex(real_[opposite], -imaginary_[opposite]);
      real_[k] = value.real();
      imaginary_[k] = value.imag();
    }
  }

  Complex operator()(Real u) const {
    const auto [real, imaginary, below] = sum_in_lanes<Real>(points_, [&](std::size_t k, auto pack) {
      using Pack = decltype(pack);
      const Pack w = Pack::load(&weight_[k]) / (Pack(u) - Pack::load(&u_[k]));
      return std::array{w * Pack::load(&real_[k]), w * Pack::load(&imaginary_[k]), w};
    });
    if (std::isfinite(below)) return Complex(real, imaginary) / below;
    const auto k =
        static_cast<std::size_t>(std::find(u_.begin(), u_.begin() + static_cast<std::ptrdiff_t>(points_), u) - u_.begin());
    return {real_[k], imaginary_[k]};
  }

 private:
  static constexpr std::size_t kMostPoints = 48;
  std::size_t points_;
  std::array<Real, kMostPoints> u_, weight_, real_, imaginary_;
};

/// Nodes on [0, 1] of a Gauss-Legendre rule.
Law legendre() {
  using Rule = boost::math::quadrature::gauss<Real, 12>;
  Law rule;
  for (std::size_t i = 0; i < Rule::abscissa().size(); ++i)
    for (const int side : {-1, 1}) {
      rule.x.push_back((1 + side * Rule::abscissa()[i]) / 2);
      rule.w.push_back(Rule::weights()[i] / 2);
    }
  return rule;
}

/// Mean of f(w) over the unit vectors of sum 0 in R^m.
template <class F>
Real over_directions(int m, int points, const F& f) {
  const auto combined = [&](Real a, Real b, Real c) {
    // Orthonormal: (1, -1, 0, 0)/sqrt 2, (1, 1, -2, 0)/sqrt 6, (1, 1, 1, -3)/sqrt 12.
    const Real p = a / std::sqrt(2.), q = b / std::sqrt(6.), r = c / std::sqrt(12.);
    return f(std::array<Real, 4>{p + q + r, -p + q + r, -2 * q + r, -3 * r});
  };
  if (m == 2) return combined(1, 0, 0);  // the other one is conjugate
  Real sum = 0;
  const Law rule = legendre();
  // Opposite vectors are conjugate: half a turn does.
  for (int i = 0; i < points; ++i) {
    const Real turn = std::numbers::pi * (i + .5) / points;
    if (m == 3) {
      sum += combined(std::cos(turn), std::sin(turn), 0) / points;
      continue;
    }
    for (std::size_t j = 0; j < rule.x.size(); ++j) {
      const Real height = 2 * rule.x[j] - 1, around = std::sqrt(1 - height * height);
      sum += rule.w[j] / points * combined(around * std::cos(turn), around * std::sin(turn), height);
    }
  }
  return sum;
}

/// Length of the sum of two unit vectors: 0 or 2; 2 |cos| of a uniform angle; its square uniform.
Law sum_lengths(int m, int points) {
  if (m == 2) return {{0, 2}, {.5, .5}};
  Law law;
  if (m == 3)
    for (int i = 0; i < points; ++i) {
      law.x.push_back(2 * std::cos(std::numbers::pi / 2 * (i + .5) / points));
      law.w.push_back(Real{1} / points);
    }
  else {
    law = legendre();
    for (Real& x : law.x) x = 2 * std::sqrt(x);
  }
  return law;
}

}  // namespace

Real jackknife_factor(int m, Real s) {
  if (m == 2) return std::cos(s);
  if (m == 4) return s > 0 ? std::sin(s) / s : 1;
  return std::isfinite(s) ? boost::math::cyl_bessel_j(0, s) : s;
}

Theory jackknife_march(const RayProfile& profile, int c, int m, int steps, bool stratified, bool naive) {
  MarchLaw march;
  const Real h = (profile.end() - profile.begin()) / steps;
  if (stratified) {
    const auto [t, w, first] = stratum_nodes(profile, steps);
    const std::vector<Real> mu = extinction_at(profile, c, t);
    for (std::size_t j = 0; j + 1 < first.size(); ++j) {
      Law law;
      for (std::size_t i = first[j]; i < first[j + 1]; ++i) {
        law.x.push_back(h * mu[i]);
        law.w.push_back(w[i] / h);
      }
      march.add(std::move(law));
    }
  } else {
    std::optional<Law> law = uniform_law(profile, c, steps);
    if (!law) return {};
    march.add(std::move(*law));
  }
  const Real transmittance = std::exp(-march.mean);
  if (has_constant_extinction(profile, c)) return {.mean = transmittance, .variance = 0};
  Real first = 0, second = 0;  // E X/e^{-tau} - 1, and of X^2
  if (naive) {
    first = std::expm1(m * march.log_characteristic(-Real{1} / m).real());
    second = std::expm1(m * march.log_characteristic(-Real{2} / m).real());
  } else {
    constexpr Real kWidest = 3;
    const Real width = std::sqrt(march.variance);
    if (!(width < kWidest)) return {};
    const int points = 4 + static_cast<int>(std::ceil(8 * width));
    const auto moment = [&](const Characteristic& phi, Real length) {
      return over_directions(m, points, [&](const std::array<Real, 4>& w) {
        Complex sum = 0;
        for (int j = 0; j < m; ++j)
          sum += complex_log1p(phi(length * w[static_cast<std::size_t>(j)] / std::sqrt(static_cast<Real>(m))));
        return complex_expm1(sum).real();
      });
    };
    const Characteristic once(march, -Real{1} / m), twice(march, -Real{2} / m);
    first = moment(once, 1);
    const Law lengths = sum_lengths(m, points);
    for (std::size_t i = 0; i < lengths.x.size(); ++i) second += lengths.w[i] * moment(twice, lengths.x[i]);
  }
  const Real mean = transmittance * (1 + first);
  const Real variance = transmittance * transmittance * std::max<Real>(0, second - 2 * first - first * first);
  if (!std::isfinite(mean) || !std::isfinite(variance)) return {};
  return {.mean = mean, .variance = variance};
}

}  // namespace nullmark
