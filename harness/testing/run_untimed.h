#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "harness/run/run.h"

namespace nullmark {

/// Samples and judges the selected cells of a plan, all of them unless told otherwise, and times nothing: for tests.
inline std::vector<CellRecord> run_untimed(const Plan& plan, std::vector<bool> selected = {}, int threads = 0) {
  if (selected.empty()) selected.assign(plan.cells.size(), true);
  RunOptions options;
  options.threads = threads;
  options.timing = false;
  return unshared(run_plan(plan, selected, {}, options, {}));
}

inline std::vector<CellRecord> run_untimed(const Plan& plan, const std::function<bool(const Cell&)>& wanted) {
  std::vector<bool> selected;
  for (const Cell& cell : plan.cells) selected.push_back(wanted(cell));
  return run_untimed(plan, selected);
}

}  // namespace nullmark
