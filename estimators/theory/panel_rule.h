#pragma once

#include <Eigen/LU>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/legendre.hpp>

#include "estimators/theory/ray_profile.h"

namespace nullmark {

/// Gauss-Legendre rule of a profile's panels on [0, 1] with matrices of partial integrals, exact to degree kNodes - 1:
/// int_0^{x_i} f = sum_j running_ij f(x_j), int_{x_i}^1 f = sum_j ahead_ij f(x_j).
struct PanelRule {
  static constexpr int kNodes = RayProfile::kNodes;
  using Square = Eigen::Matrix<Real, kNodes, kNodes>;
  using Nodes = std::array<Real, kNodes>;

  Nodes x{}, w{};
  Square running, ahead;

  PanelRule() {
    using Gauss = boost::math::quadrature::gauss<Real, kNodes>;
    constexpr std::size_t half = kNodes / 2;
    Nodes y{}, y_of_x{};  // on [-1, 1]; x rounds, and the last bit of recorded theories depends on which of the two is taken
    for (std::size_t i = 0; i < half; ++i) {
      y[half + i] = Gauss::abscissa()[i];
      y[half - 1 - i] = -y[half + i];
      w[half - 1 - i] = w[half + i] = Gauss::weights()[i] / 2;
    }
    for (std::size_t i = 0; i < kNodes; ++i) {
      x[i] = (1 + y[i]) / 2;
      y_of_x[i] = 2 * x[i] - 1;
    }
    running = partial_integrals(y_of_x, 1);
    ahead = partial_integrals(y, -1);
  }

 private:
  /// From the left end (`sign` 1) or to the right one (-1), in the Legendre basis: int_{-1}^y P_n = (P_{n+1}(y) - P_{n-1}(y)) /
  /// (2n + 1), of which int_y^1 P_n is the negative; P_0 has y + 1 and 1 - y.
  static Square partial_integrals(const Nodes& y, int sign) {
    Square values, integrals;
    for (int i = 0; i < kNodes; ++i) {
      const Real at = y[static_cast<std::size_t>(i)];
      for (int n = 0; n < kNodes; ++n) {
        values(i, n) = boost::math::legendre_p(n, at);
        const Real twice =
            n == 0 ? sign + at : (boost::math::legendre_p(n + 1, at) - boost::math::legendre_p(n - 1, at)) / (2 * n + 1);
        integrals(i, n) = sign * twice / 2;  // x is half of y
      }
    }
    return integrals * values.inverse();
  }
};

inline const PanelRule& panel_rule() {
  static const PanelRule rule;
  return rule;
}

}  // namespace nullmark
