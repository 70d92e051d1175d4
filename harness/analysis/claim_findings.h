#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/model/record.h"
#include "harness/statistics/interval.h"

namespace nullmark {

/// What the results say of a published claim.
enum class ClaimOutcome { reproduced, refuted, cannot_tell };
const char* to_string(ClaimOutcome outcome);

/// One cell's metric, or the slope over all cells, beside what it is compared with.
struct ComparedCell {
  std::string cell;                            ///< name; empty for a slope over several
  std::string with;                            ///< name of the cell that it is compared with, if any
  std::optional<Interval> measured, expected;  ///< at the level of kFindingsLevel, not 95 %
  std::string reason;                          ///< why one of them is absent
  ClaimOutcome outcome = ClaimOutcome::cannot_tell;
};

struct PartFinding {
  const ClaimPart* part = nullptr;
  ClaimOutcome outcome = ClaimOutcome::cannot_tell;
  std::vector<ComparedCell> compared;
};

struct ClaimFinding {
  const PublishedClaim* claim = nullptr;
  ClaimOutcome outcome = ClaimOutcome::cannot_tell;
  std::vector<PartFinding> parts;
};

/// Chance that even one of a run's comparisons ends in a word that is false, where sums of samples are normal.
inline constexpr Real kFindingsLevel = 1e-3;

/// Puts every claim of a run to the test, in the order of their ids.  Measured numbers have intervals so wide that all of them
/// hold together with probability 1 - kFindingsLevel (Bonferroni); a comparison is reproduced where both whole intervals bear it
/// out, refuted where none of them does, and open otherwise.  A part is reproduced where all its cells are, refuted where one is;
/// a claim likewise by its parts. `unbiased` parts go by the verdicts of cells, which summarise() derives.  Intervals of measured
/// variances rest on the sample kurtosis; where it says that the variance is not known to a quarter, nothing is concluded.
/// Intervals of slopes are Student's at 95 %, widened by the ratio of normal quantiles, which is less than the level asks of few
/// points.
std::vector<ClaimFinding> findings(const RunRecord& run);

}  // namespace nullmark
