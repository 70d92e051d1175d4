#pragma once

#include <string>

#include "harness/exit_code.h"
#include "harness/expectation.h"
#include "harness/findings.h"
#include "harness/order.h"
#include "harness/record.h"

namespace nullmark {

/// What `check` concludes of a run, every verdict derived anew from the figures in the record.
struct Summary {
  std::size_t pass = 0, fail = 0, expected_open = 0, unexpected_open = 0, violated = 0, errors = 0, not_run = 0, unclaimed = 0;
  std::size_t never_started = 0;  ///< interrupted, out of time, or absent from the file though the configuration has them
  std::size_t altered = 0;        ///< verdicts in the file that its own figures do not bear out
  std::vector<OrderFit> orders;
  std::vector<Expectation> expectations;  ///< numbers that the configuration expects of its cells
  std::vector<ClaimFinding> findings;     ///< published claims; a refuted one is a result, no failure
  ExitCode exit = ExitCode::ok;
};

/// Decides all verdicts again, in place, and counts them.  Exit code: FAIL or an expectation that was measured and not met 3;
/// else errors 1; else nothing judged and no claim decided 5; else verdicts that are open although the plan foresaw a decision,
/// cells never started, or neither a cell that passed nor a claim that is decided 77; else 0.
Summary summarise(RunRecord& run);

/// The word that `check` counts a cell by: "PASS", "INCONCLUSIVE (as planned)".
std::string verdict_word(const CellRecord& record);

/// Why a cell is not PASS: of its status, its verdict, lookups above the bound and laws.
std::string reason_of(const CellRecord& record);

/// For the terminal: counts, then every cell that did not pass with its reason.
std::string summary_text(const RunRecord& run, const Summary& summary);

/// The same for a pull request.
std::string summary_markdown(const RunRecord& run, const Summary& summary, const std::string& file);

}  // namespace nullmark
