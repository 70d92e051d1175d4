#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// The kind of a cell in the totals of `check`.  `agree` and `differ` are what `pass` and `fail` are called of the difference of
/// two trackers: two that are biased alike agree.
enum class Kind { pass, fail, agree, differ, expected_open, unexpected_open, violated, error, not_run, untested };
Kind kind_of(const CellRecord& record);

/// The outcome of the mean, judged against the reference or the own mean.
Outcome mean_of(const VerdictRecord& verdict);

/// What a verdict rests on, or leaves untested.
///
///   pilot          the proof takes the variance that a pilot of the same tracker measured
///   own_mean       judged against the mean that the tracker predicts for itself
///   laws           the mean is undecided; laws of the walks were tested, and none is broken
///   bound          the majorant is not known to bound the extinction
///   depth          the tracker is handed the exact optical depth
///   part_of_depth  the same, and a measured share of its answer follows that depth (CellRecord::reliance)
///   law            the claims rest on a law that was not tested
enum class Mark { pilot, own_mean, laws, bound, depth, part_of_depth, law };

/// The marks of a cell whose mean passed, failed or is undecided, in the order of the enumeration; none for other cells.
std::vector<Mark> marks_of(const CellRecord& record);

/// The name of a mark, as in totals: "by pilot".
const char* mark_name(Mark mark);

/// What a mark says of the cell: "replay not tested", with numbers where it has some.
std::string mark_text(Mark mark, const CellRecord& record);

/// The marks of a cell, with figures: "leans on the exact depth (0.25 of its answer)".
std::vector<std::string> mark_texts(const CellRecord& record);

/// "PASS", "INCONCLUSIVE (as planned)".
const char* verdict_word(Kind kind);

/// "PASS (by pilot, own mean)".
std::string with_marks(const std::string& word, const std::vector<std::string>& marks);

/// The word for a cell with its marks, the same in every output: "PASS (by pilot, own mean)".  Without a verdict it says what the
/// tracker claims: "not tested (claims unbiased)".
std::string marked_word(const CellRecord& record);

/// Why a cell is not PASS: from its status, verdict, lookups above the bound, and laws.  What fails comes first.
std::string reason_of(const CellRecord& record);

/// The text beside the word: what a PASS proves, or the reason of any other word.
std::string finding_of(const CellRecord& record);

}  // namespace nullmark
