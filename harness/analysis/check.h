#pragma once

#include <functional>
#include <string>
#include <vector>

#include "harness/analysis/claim_findings.h"
#include "harness/io/json_input.h"
#include "harness/model/exit_code.h"
#include "harness/model/record.h"
#include "harness/verdict/convergence_order.h"

namespace nullmark {

/// The conclusions of `check` about a run; every verdict is derived again from the figures in the record.
struct Summary {
  std::size_t pass = 0;
  std::size_t own_mean = 0;           ///< PASSes of the mean that a tracker predicts for itself
  std::size_t agree = 0, differ = 0;  ///< pairs of trackers
  std::size_t fail = 0, expected_open = 0, unexpected_open = 0, violated = 0, errors = 0, not_run = 0, untested = 0;
  std::size_t configured = 0;              ///< cells of the configuration
  std::size_t selected = 0;                ///< cells that the run was to cover: selected by `--filter`, regardless of `--shard`
  std::size_t never_started = 0;           ///< interrupted, out of time, or absent from the file though selected
  std::size_t drawn_in_part = 0;           ///< parts of the cell are in the file, and no verdict
  std::size_t undecided_claims = 0;        ///< cells that claim something and neither passed nor failed, including skipped ones
  bool strict = false;                     ///< each undecided claim then prevents success
  std::size_t altered = 0;                 ///< verdicts in the file that contradict its figures
  std::vector<std::string> disagreements;  ///< see disagreements.h
  /// Trackers whose claim no cell decides: "delta claims unbiased and no cell decides it".
  std::vector<std::string> undecided_trackers;
  /// Why the cells that passed are not enough for success; empty if they are.
  std::string nothing_proven;
  std::vector<OrderFit> orders;
  std::vector<ClaimFinding> findings;  ///< of the claims; a refuted one is a failure only if it is required
  ExitCode exit = ExitCode::ok;
};

/// Derives all verdicts again, in place, and counts them.  Sets the exit code, see harness/verdict/verdict.md.
Summary summarise(RunRecord& run, bool strict = false);

/// Number of cells of the configuration in the results for which `counts` is true, whatever a filter, a shard or a time budget
/// left out.
std::size_t configured_cells(const RunRecord& run, const std::function<bool(const Json&)>& counts);

}  // namespace nullmark
