#pragma once

#include <string>
#include <utility>
#include <vector>

#include "harness/io/fitted.h"
#include "harness/model/record.h"

namespace nullmark {

/// One line that counts the verdicts; then the tables of a run: one table per experiment, medium, majorant and quantity, with one
/// line per estimator and channel; then the tables of the configuration, with the published numbers.  `*` marks a value from
/// theory, shown instead of the sample variance if the tail is too heavy (relative variance above kHeavyTail).
std::string results_tables(const RunRecord& run, const TableShape& shape = {});

/// The headings of these tables that `--columns` may name.
const std::vector<std::string>& results_columns();

/// Only the tables of the configuration: title and lines; the first line is the heading.
std::vector<std::pair<std::string, std::vector<std::vector<std::string>>>> configured_tables(const RunRecord& run);

}  // namespace nullmark
