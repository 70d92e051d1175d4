#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/plan.h"

namespace nullmark {

/// What a run would do with a cell.
struct Prediction {
  std::size_t cell = 0;  ///< index in the plan
  std::uint64_t rays = 0, samples_per_ray = 0;
  std::optional<double> lookups_per_sample, relative_variance;
  std::uint64_t planned = 0;  ///< samples per ray for a PASS without bias
  std::string verdict;        ///< expected: "PASS", "open", "INCONCLUSIVE", "VIOLATED" or "not judged"
  std::string status;         ///< "ok" or the reason why it would be skipped
  double seconds = 0;         ///< of CPU, without timing
};

/// Of many cells a part is predicted, evenly from all trackers, and stands for all.
struct Forecast {
  std::vector<Prediction> cells;
  std::size_t selected = 0;
  double timing_seconds = 0;  ///< of CPU, of all selected cells

  /// Selected cells for each predicted one.
  double weight() const { return cells.empty() ? 0 : static_cast<double>(selected) / static_cast<double>(cells.size()); }
};

/// Theory tells lookups, variance and planned samples; a few samples of each predicted cell tell what they cost on this machine.
/// Of large pictures a part of the rays stands for all.
Forecast forecast(const Plan& plan, const std::vector<bool>& selected);

}  // namespace nullmark
