#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/model/record.h"
#include "harness/statistics/interval.h"

namespace nullmark {

/// The verdict of the results on a published claim.
enum class ClaimOutcome { reproduced, refuted, cannot_tell };
const char* to_string(ClaimOutcome outcome);

/// The metric of one cell, or the slope over all cells, and what it is compared with.
struct ComparedCell {
  std::string cell;                            ///< name; empty for a slope over several
  std::string with;                            ///< name of the cell compared with, if any
  std::optional<Interval> measured, expected;  ///< intervals at kFindingsLevel, not 95 %
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

/// Chance that even one comparison of a run has a false outcome, if sums of samples are normal.
inline constexpr Real kFindingsLevel = 1e-3;

/// Tests every claim of a run, in the order of their ids.  All intervals of measured numbers hold together with probability 1 -
/// kFindingsLevel (Bonferroni).  A comparison is reproduced if the whole intervals agree with it, refuted if no part of them
/// does, and otherwise undecided.  A part is reproduced if all its cells are, and refuted if one is; the same holds for a claim
/// and its parts.  `unbiased` parts use the verdicts that summarise() derives.  Intervals of measured variances come from the
/// sample kurtosis; if the variance is not known to a quarter, nothing is concluded.  Intervals of slopes are Student's at 95 %,
/// widened by the ratio of normal quantiles, which is too little for few points.
std::vector<ClaimFinding> findings(const RunRecord& run);

}  // namespace nullmark
