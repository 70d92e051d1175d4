#pragma once

#include <array>
#include <boost/math/special_functions/legendre.hpp>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// Gauss-Legendre rule on [0,1].
struct GaussRule {
  std::vector<Real> point, weight;

  int size() const { return static_cast<int>(point.size()); }
};

/// The rule with the fewest points that is exact for a polynomial of the degree (up to kMostDegree): degree/2 + 1, so 1 up to
/// linear and 2 up to cubic.
inline constexpr int kMostDegree = 159;

inline const GaussRule& gauss_rule(int degree) {
  static const auto rules = [] {
    std::array<GaussRule, kMostDegree / 2 + 1> all;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const int n = static_cast<int>(i) + 1;
      const auto add = [&](Real x) {
        const Real slope = boost::math::legendre_p_prime(n, x);
        all[i].point.push_back((1 + x) / 2);
        all[i].weight.push_back(1 / ((1 - x * x) * slope * slope));
      };
      for (const Real x : boost::math::legendre_p_zeros<Real>(n)) {
        add(x);
        if (x != 0) add(-x);
      }
    }
    return all;
  }();
  return rules.at(static_cast<std::size_t>(degree / 2));
}

}  // namespace nullmark
