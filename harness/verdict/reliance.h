#pragma once

#include <functional>
#include <optional>

#include "harness/sampling/sampling.h"

namespace nullmark {

/// The share of an estimator's answer that follows the exact optical depth it is handed.  A tracker that answers exp(-depth) has
/// the right mean on every medium, and no test of the mean shows that it estimates nothing.
///
/// The same samples are drawn twice, X with the depth tau and X' with 1.01 tau:
///
///   reliance = mean(X' - X) / mean(T^1.01 - T), with .01 tau as the denominator for an optical depth
///
/// Sums run over channels and at most 64 evenly spaced rays.  1: the whole answer is that depth.  0: the mean is right for any
/// depth, as a control requires.  If an estimator has its own target, the target's part in X' - X is subtracted.
///
/// The number of samples doubles from 256 per ray until the standard error is below .005 and 140 T/(T - T^1.01) samples are
/// drawn. Then rare samples that carry .05 of the answer are among them.  Returns nothing if 2^26 lookups or 2^24 samples do not
/// suffice, if T^1.01 and T are equal, if the estimator is handed no depth, for other quantities, or if `stop` returned true.
/// Values beyond
/// +-10 are clamped.
std::optional<Real> measure_reliance(const Cell& cell, const Scene& scene, const Kernel& kernel,
                                     const std::function<bool()>& stop);

}  // namespace nullmark
