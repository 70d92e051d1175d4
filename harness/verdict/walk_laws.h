#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/sampling/sampling.h"
#include "harness/sampling/test_plan.h"

namespace nullmark {

/// Tests properties of walks other than their mean, for optical depths at which no affordable number of samples decides a mean.
/// Walks are drawn by the kernel of the cell, with their own streams, and recorded.
///
///   count         collisions against the majorant depth that was flown through: a Poisson process of rate 1 up to the stopping
///                 of each walk, so (1 + d)^N e^{-d Lambda} has mean 1 for every d, whatever ends a walk
///   first         depth of the first collision, given one: uniform in 1 - e^{-depth} [Dvoretzky-Kiefer-Wolfowitz, Massart 1990]
///   positions     depths of all collisions of walks that do not end early: uniform given their number
///   mapping       the integral of the majorant from the ray's begin to each lookup is the depth that the flight states
///   conditional   E[X | K = k] and its variance, of products (CountLaw)
///   independence  first flights of consecutive samples, and of neighbouring rays, are uncorrelated
///   variance      (X - mu0)^2 has the mean that theory states; tested with the samples of the run, see test_plan.h
///   replay        samples drawn again in another order are the same bit for bit, see replay_law.h
///   kolmogorov_smirnov, chi_square   the law of free paths, see free_path_law.h
///   segments      the ray cut into pieces shallow enough for mean tests of their own
///
/// Depths are those of the majorant.  Flights that are rewound at the ends of cells follow the same laws: if an exponential is
/// cut at a depth and drawn anew from there, the collisions are still a Poisson process of rate 1 in depth.
///
/// Returns log E (or -log p) of each law that applies; a law that holds exceeds log(1/a) with probability at most a.  Nothing
/// where walks take more lookups than a recording holds, or the run stops.
struct LawBudget {
  Real lookups = 2e5;                 ///< approximate total over all walks
  std::uint64_t most_per_ray = 4096;  ///< samples
  Real each = 1;                      ///< lookups per sample, if theory does not state them
};
std::optional<std::vector<LawRecord>> test_laws(const Cell& cell, const Scene& scene, const Kernel& kernel,
                                                const Targets& targets, SampleRange range, const CellTheory& theory,
                                                const LawBudget& budget, const std::function<bool()>& stop);

}  // namespace nullmark
