#include "harness/sampling/margins.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nullmark {

Real least_of(Precision precision) {
  return precision == Precision::float64 ? std::numeric_limits<Real>::min() : Real{std::numeric_limits<float>::min()};
}

Real single_error(const Cell& cell, Real mean, Real lookups) {
  if (cell.precision == Precision::float64) return 0;
  return 2 * epsilon_of(cell.precision) * std::abs(mean) * (1 + lookups) + least_of(cell.precision);
}

namespace {

/// The relative margin where the configuration names none, wider where depth makes samples noisier.
Real default_epsilon(Real transmittance) {
  if (transmittance > std::exp(-2.)) return 0.01;
  if (transmittance > std::exp(-5.)) return 0.02;
  return transmittance > 1e-4 ? 0.05 : 0.5;
}

/// Absolute margin of the scores of a free path, of all flights, and the least of it.
constexpr Real kOfFlights = 2e-3, kRareScore = 1e-4;

/// Smaller where a score is rare, or nearly always given, or a tracker that never scores it would pass.  A weight's mean is 1.
Real score_epsilon(const Cell& cell, Real mean) {
  constexpr Real kOfScore = 0.25, kNever = 1e-9;
  const Real margin = cell.verdict.epsilon.value_or(kOfFlights), rare = std::min(mean, 1 - mean);
  return rare < kNever ? margin : std::max(std::min(margin, kOfScore * rare), kRareScore);
}

}  // namespace

Real absolute_epsilon(const Cell& cell, Real mean) {
  if (cell.quantity == Quantity::free_path) return score_epsilon(cell, mean);
  // A mean that has underflowed has no part of itself.
  const Real least = 16 * least_of(cell.precision);
  if (!(std::abs(mean) > least)) return least;
  if (cell.verdict.epsilon) return *cell.verdict.epsilon * mean;
  if (cell.quantity == Quantity::optical_depth || cell.quantity == Quantity::radiance) return 0.01 * std::abs(mean);
  const Real margin = default_epsilon(mean) * mean, absorbed = 1 - mean;
  constexpr Real kOfAbsorbed = 0.1;
  return absorbed > 1e-12 ? std::min(margin, kOfAbsorbed * absorbed) : margin;
}

}  // namespace nullmark
