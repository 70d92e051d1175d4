#pragma once

#include <functional>
#include <string>
#include <vector>

#include "harness/analysis/claim_findings.h"
#include "harness/analysis/expectation.h"
#include "harness/io/json_input.h"
#include "harness/model/exit_code.h"
#include "harness/model/record.h"
#include "harness/verdict/convergence_order.h"

namespace nullmark {

/// What `check` concludes of a run, every verdict derived anew from the figures in the record.
struct Summary {
  std::size_t pass = 0;
  std::size_t own_mean = 0;  ///< of the PASSes, those of the mean that a tracker predicts of itself
  std::size_t fail = 0, expected_open = 0, unexpected_open = 0, violated = 0, errors = 0, not_run = 0, unclaimed = 0;
  std::size_t configured = 0;        ///< cells of the configuration
  std::size_t selected = 0;          ///< of these, those that the run was asked for: by `--filter`, not by `--shard`
  std::size_t never_started = 0;     ///< interrupted, out of time, or absent from the file though selected
  std::size_t undecided_claims = 0;  ///< cells that claim something and neither passed nor failed, skipped ones among them
  bool strict = false;               ///< each of those keeps the run from being a success
  std::size_t altered = 0;           ///< verdicts in the file that its own figures do not bear out
  /// Trackers that claim something which no cell decides: "delta claims unbiased and no cell decides it".
  std::vector<std::string> undecided_trackers;
  /// Why the cells that passed do not make the run a success; empty where they do.
  std::string nothing_proven;
  std::vector<OrderFit> orders;
  std::vector<Expectation> expectations;  ///< numbers that the configuration expects of its cells
  std::vector<ClaimFinding> findings;     ///< published claims; a refuted one is a result, no failure
  ExitCode exit = ExitCode::ok;
};

/// Decides all verdicts again, in place, and counts them.  Exit code: FAIL or an expectation that was measured and not met 3;
/// else errors 1; else nothing judged and no claim decided 5; else 77 for
///   verdicts that are open although the plan foresaw a decision,
///   cells never started,
///   neither a cell that passed nor a claim that is decided,
///   PASSes of own means alone, with no convergence order and no published claim that is decided,
///   a tracker that claims to be exact, unbiased or consistent and has verdicts, none of which decides a mean,
///   and if `strict` any cell that claims something and neither passed nor failed;
/// else 0.
Summary summarise(RunRecord& run, bool strict = false);

/// Cells of the configuration, as the results hold it, for which `counts` is true: whatever a filter, a shard or a time budget
/// left of them.
std::size_t configured_cells(const RunRecord& run, const std::function<bool(const Json&)>& counts);

}  // namespace nullmark
