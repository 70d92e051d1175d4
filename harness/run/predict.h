#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/plan.h"

namespace nullmark {

/// What a run would do, without sampling: for each selected cell the predicted lookups per sample (from theory), if known.
struct Prediction {
  std::uint64_t rays = 0, samples_per_ray = 0;
  std::optional<double> lookups_per_sample, relative_variance;
  std::uint64_t planned = 0, most = 0;  ///< samples per ray: for a PASS without bias, and the most that may be drawn
  std::string verdict;                  ///< expected verdict: "PASS", "INCONCLUSIVE", "exact", "not judged", ...
  std::string status;                   ///< "ok" or the reason why it would be skipped
};
std::vector<Prediction> predict(const Plan& plan, const std::vector<bool>& selected);

}  // namespace nullmark
