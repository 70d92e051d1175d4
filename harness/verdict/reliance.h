#pragma once

#include <functional>
#include <optional>

#include "harness/sampling/sampling.h"

namespace nullmark {

/// How much of an estimator's answer is the exact optical depth that it is handed.  A tracker that answers exp(-depth) has the
/// right mean on every medium, and no test of the mean sees that it estimates nothing.
///
/// The same samples are drawn twice, X with the depth tau and X' with 1.01 tau:
///
///   reliance = mean(X' - X) / mean(T^1.01 - T), with .01 tau below the line for an optical depth
///
/// Sums run over channels and at most 64 evenly spaced rays.  1: the whole answer is that depth.  0: the mean is right whatever
/// depth is told, as a control needs.  Of estimators with a target of their own the target's part in X' - X is taken away.
///
/// Samples are doubled from 256 a ray until the standard error is below .005 and 140 T/(T - T^1.01) samples are drawn, so that
/// rare ones that carry .05 of the answer are among them.  Nothing where 2^26 lookups or 2^24 samples do not reach that, where
/// T^1.01 and T are equal, where the estimator is handed no depth, for other quantities, or where `stop` answered true.  Values
/// beyond
/// +-10 are cut off there.
std::optional<Real> measure_reliance(const Cell& cell, const Scene& scene, const Kernel& kernel,
                                     const std::function<bool()>& stop);

}  // namespace nullmark
