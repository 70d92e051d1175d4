#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "harness/kernel/kernel.h"
#include "media/base/registry.h"

namespace nullmark {

/// Properties of a registered estimator for commands and tests; estimator.h explains them.
struct EstimatorEntry {
  std::string name, summary, source;
  SampleRange range = SampleRange::any_sign;
  bool needs_bound = false;
  bool in_lanes = false;  ///< grey walks run side by side in registers, in double and in float
  bool ignores_majorant = false, heavy_samples = false, heavy_lookups = false;
  /// The optional members of estimator.h, and whether the tracker has them.  A misspelt one has no effect and is not found.
  std::vector<std::pair<const char*, bool>> members;
  std::vector<Quantity> quantities;  ///< quantities that it answers on grey media
  std::unique_ptr<EstimatorSource> (*make)() = nullptr;
  bool foreign = false;   ///< runs code from outside of nullmark, and says nothing of itself before that is opened
  bool planted = false;   ///< deliberately wrong, for tests; runs if named, is never listed
  std::string caught_by;  ///< planted: the check that must catch it
};

}  // namespace nullmark
