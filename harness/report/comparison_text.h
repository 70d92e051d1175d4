#pragma once

#include <string>
#include <vector>

#include "harness/io/fitted.h"
#include "harness/model/record.h"

namespace nullmark {

/// One line with the fastest trackers; then a table per comparison (harness/analysis/comparison.h): trackers by time to 1 %
/// relative error, each number with its 95 % interval, compared with the baseline (default: the first that claims to be
/// unbiased).  With `paired` also ratios of mean squared errors on common streams.  Empty if no cell was sampled.  Throws
/// InputError if the results hold no such baseline.
std::string compare_text(const std::vector<RunRecord>& runs, const std::string& baseline, bool paired,
                         const TableShape& shape = {});

/// The headings of these tables that `--columns` may name.
const std::vector<std::string>& comparison_columns();

inline constexpr const char* kLatexBeginning = "% nullmark compare";

/// The same as LaTeX tables with captions, for a paper; they need the packages booktabs and graphicx.
std::string compare_latex(const std::vector<RunRecord>& runs, const std::string& baseline);

/// The same for a pull request.
std::string compare_markdown(const std::vector<RunRecord>& runs, const std::string& baseline, bool paired);

}  // namespace nullmark
