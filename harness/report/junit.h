#pragma once

#include <string>

#include "harness/model/record.h"

namespace nullmark {

/// The shell command that runs a cell again from the configuration that its results file holds.
std::string reproduction(const CellRecord& record, const std::string& file);

/// A run as a JUnit report.  FAIL is a failure, non-finite samples and crashes are errors, INCONCLUSIVE, VIOLATED, cells that did
/// not run and cells without a verdict are skipped, with the reason; bodies hold the command that reproduces the cell.  A PASS
/// says what it proves.  `file` is the results file's path.
std::string junit(const RunRecord& run, const std::string& file);

}  // namespace nullmark
