#pragma once

#include <string>
#include <utility>
#include <vector>

#include "harness/record.h"

namespace nullmark {

/// The readable tables of a run: cells of one experiment, medium, majorant and quantity together, one line per estimator and
/// channel, then the configuration's own tables beside the numbers they answer.  `*` marks theory shown in place of a sample
/// value where the distribution has too heavy a tail for that to mean much (relative variance above kHeavyTail).
std::string results_tables(const RunRecord& run);

/// The configuration's own tables alone: title and lines, the first being the heading.
std::vector<std::pair<std::string, std::vector<std::vector<std::string>>>> configured_tables(const RunRecord& run);

/// Lines of equally many words as aligned columns, the first line being the heading; the first `left` columns and the last one
/// are set flush left, the others flush right.
std::string aligned(const std::vector<std::vector<std::string>>& lines, std::size_t left);

/// The same as a table of markdown, and text for one of its cells.
std::string markdown_table(const std::vector<std::vector<std::string>>& lines);
std::string escaped(const std::string& text);

/// Four significant digits, "-" where there is no number.
std::string short_number(const std::optional<Real>& number);

}  // namespace nullmark
