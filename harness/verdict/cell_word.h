#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// What a cell amounts to, as `check` counts it.
enum class Kind { pass, fail, expected_open, unexpected_open, violated, error, not_run, unclaimed };
Kind kind_of(const CellRecord& record);

/// The outcome of the mean, against whatever it was judged.
Outcome mean_of(const VerdictRecord& verdict);

/// What a verdict rests on or leaves open.
///
///   pilot          the proof takes the variance that a pilot of the same tracker measured
///   own_mean       judged against the mean that the tracker predicts of itself
///   laws           the mean is undecided; laws of the walks were tested, and none is broken
///   bound          the majorant is not known to bound the extinction
///   depth          the tracker is handed the exact optical depth
///   part_of_depth  the same, and so much of its answer follows that depth (CellRecord::reliance)
///   law            the claims rest on a law that was not tested
enum class Mark { pilot, own_mean, laws, bound, depth, part_of_depth, law };

/// The marks of a cell whose mean passed, failed or is undecided, in the order of the enumeration; of others none.
std::vector<Mark> marks_of(const CellRecord& record);

/// A mark as totals count it: "by pilot".
const char* mark_name(Mark mark);

/// The marks as a cell shows them, figures included: "leans on the exact depth (0.25 of its answer)".
std::vector<std::string> mark_texts(const CellRecord& record);

/// "PASS", "INCONCLUSIVE (as planned)".
const char* verdict_word(Kind kind);

/// The word for a cell with its marks, the same in every output: "PASS (by pilot, own mean)".
std::string marked_word(const CellRecord& record);

/// Why a cell is not PASS: of its status, its verdict, lookups above the bound and laws; what fails comes first.
std::string reason_of(const CellRecord& record);

/// What stands beside the word: of a PASS what it proves, of others the reason.
std::string finding_of(const CellRecord& record);

}  // namespace nullmark
