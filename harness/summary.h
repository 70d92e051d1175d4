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

/// For the terminal: every cell that did not pass or has a mark, with its reason or what it proves, then counts.
std::string summary_text(const RunRecord& run, const Summary& summary);

/// The same for a pull request.
std::string summary_markdown(const RunRecord& run, const Summary& summary, const std::string& file);

}  // namespace nullmark
