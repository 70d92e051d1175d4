#pragma once

#include <array>
#include <boost/container/static_vector.hpp>
#include <cstdio>

#include "media/base/along_axis.h"

namespace nullmark {

/// f(s) = c_0 + c_1 s + c_2 s^2 + c_3 s^3, 1/length, >= 0 on [0,1].  With {0, 0, 1} the parabolic field of the canonical maps of
/// Novak et al. 2014.
struct PolynomialProfile {
  static constexpr const char* kName = "polynomial";
  static constexpr const char* kSummary = "polynomial of degree 3 or less along an axis";
  static constexpr const char* kSource = "Novak et al. 2014, canonical maps";

  std::vector<Real> coefficients = {0, 0, 1};

  std::array<Real, 4> c = {};

  void parameters(ParameterVisitor& visit) {
    visit.numbers("coefficients", coefficients, 1, 4, Range::any(), "1/length", "c_0, c_1, ... of c_0 + c_1 s + ..., s in [0,1]");
  }

  void prepare() {
    if (coefficients.empty() || coefficients.size() > c.size())
      throw ParameterError("coefficients", "expected 1 to 4 coefficients, found " + std::to_string(coefficients.size()));
    c = {};
    std::copy(coefficients.begin(), coefficients.end(), c.begin());
    const auto candidates = candidate_points(0, 1);
    const Real lowest =
        *std::min_element(candidates.begin(), candidates.end(), [this](Real a, Real b) { return horner(a) < horner(b); });
    // A double root, (s - 1/3)^2, dips below zero by rounding alone; `value` cuts that off.
    if (!(horner(lowest) >= -rounding())) {
      char message[200];
      std::snprintf(
          message, sizeof message,
          "polynomial is %.6g at s = %.6g; extinction must be >= 0 on [0,1]: raise the first coefficient by %.6g or more",
          horner(lowest), lowest, -horner(lowest));
      throw ParameterError("coefficients", message);
    }
  }

  template <class S>
  S value(const S& s) const {
    return larger(0, horner(s));
  }

  // Two-point Gauss is exact for cubics, and unlike a difference of antiderivatives it does not cancel as b -> a.
  Real integral(Real a, Real b) const {
    const Real middle = (a + b) / 2, node = (b - a) / 2 / std::sqrt(Real{3});
    return (b - a) * (horner(middle - node) + horner(middle + node)) / 2;
  }

  std::pair<Real, Real> extrema(Real a, Real b) const {
    Real minimum = kInfinity, maximum = 0;
    for (const Real s : candidate_points(a, b)) {
      minimum = std::min(minimum, value(s));
      maximum = std::max(maximum, value(s));
    }
    const Real slack = rounding();
    return {std::max<Real>(0, minimum - slack), maximum + slack};
  }

  int polynomial_degree() const { return static_cast<int>(coefficients.size()) - 1; }

 private:
  template <class S>
  S horner(const S& s) const {
    return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
  }

  /// Bound on what rounding adds to f; constants and lines are evaluated monotonically and need none.
  Real rounding() const {
    if (c[2] == 0 && c[3] == 0) return 0;
    return 4 * std::numeric_limits<Real>::epsilon() * (std::abs(c[0]) + std::abs(c[1]) + std::abs(c[2]) + std::abs(c[3]));
  }

  /// a, b and the zeros of f' between them: the extrema of f over [a, b] are among its values there.
  boost::container::static_vector<Real, 4> candidate_points(Real a, Real b) const {
    boost::container::static_vector<Real, 4> points = {a, b};
    const auto add = [&](Real s) {
      if (s > a && s < b) points.push_back(s);
    };
    const Real q2 = 3 * c[3], q1 = 2 * c[2], q0 = c[1];
    if (q2 == 0) {
      if (q1 != 0) add(-q0 / q1);
    } else if (const Real discriminant = q1 * q1 - 4 * q2 * q0; discriminant >= 0) {
      const Real q = -(q1 + std::copysign(std::sqrt(discriminant), q1)) / 2;
      add(q / q2);
      if (q != 0) add(q0 / q);
    }
    return points;
  }
};

using Polynomial = AlongAxis<PolynomialProfile>;

}  // namespace nullmark
