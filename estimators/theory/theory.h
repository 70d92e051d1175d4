#pragma once

#include <optional>

#include "media/base/types.h"

namespace nullmark {

/// Exact moments of one sample, where known; lookups are their expectation.
struct Theory {
  std::optional<Real> mean{};  ///< left out: the quantity itself
  std::optional<Real> variance{};
  std::optional<Real> lookups{};
  std::optional<Real> lookups_variance{};  ///< of one sample
};

/// Moments of a product estimator given its number K of collisions: with rate m, weights w(x) and collision depth M = int m,
/// E[X | K = k] = factor (int m w / M)^k and E[X^2 | K = k] = factor^2 (int m w^2 / M)^k; K is Poisson of mean M.
struct CountLaw {
  Real depth = 0;  ///< M
  Real factor = 1;
  Real first = 0;   ///< int m w / M
  Real second = 0;  ///< int m w^2 / M
};

}  // namespace nullmark
