#pragma once

#include <memory>
#include <string>
#include <vector>

#include "harness/kernel/kernel.h"
#include "media/base/registry.h"

namespace nullmark {

/// What commands and tests know of an estimator by its name; the facts are those of estimator.h.
struct EstimatorEntry {
  std::string name, summary, source;
  SampleRange range = SampleRange::any_sign;
  bool needs_bound = false;
  bool in_lanes = false;  ///< grey walks run side by side in registers, in double and in float
  bool ignores_majorant = false, heavy_samples = false, heavy_lookups = false;
  std::vector<Quantity> quantities;  ///< that it answers on grey media
  std::unique_ptr<EstimatorSource> (*make)() = nullptr;
  bool planted = false;   ///< a deliberately wrong tracker that the tests must catch; runs when named, is never listed
  std::string caught_by;  ///< planted: the check that must see it
};

}  // namespace nullmark
