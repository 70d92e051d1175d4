#pragma once

#include <functional>
#include <memory>

#include "harness/model/record.h"
#include "harness/run/run.h"
#include "harness/sampling/cell_preparation.h"
#include "harness/verdict/judge.h"

namespace nullmark {

struct CellOutcome {
  std::shared_ptr<CellRecord> record;
  Effort effort;
};

/// What a run asks of one cell.
struct CellTask {
  PreparedCell& prepared;
  CellShare share;                    ///< more than one part: only this one is drawn, and nothing judged
  const CellRecord* drawn = nullptr;  ///< parts that were drawn before, whose samples are taken from there; null: none
  bool may_draw = true;               ///< false: samples that are missing leave the cell as it is
};

/// Samples and judges a cell, or draws a part of it.  What a tracker throws makes an error of its cell alone.
CellOutcome run_cell(const Plan& plan, const CellTask& task, const Families& families, const std::function<bool()>& late,
                     const RunOptions& options, const RunObserver& observer, const std::function<bool()>& given_up);

}  // namespace nullmark
