#pragma once

#include <string>

#include "harness/model/record.h"

namespace nullmark {

/// The shell command that runs a cell again from the configuration in its results file.
std::string reproduction(const CellRecord& record, const std::string& file);

/// What every JUnit report begins with.
inline constexpr const char* kJunitBeginning = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites ";

/// A run as a JUnit report.  FAIL is a failure.  Non-finite samples and crashes are errors.  INCONCLUSIVE, VIOLATED, cells that
/// did not run and cells without a verdict are skipped, with the reason.  A PASS says what it proves.  Bodies hold the command
/// that reproduces the cell.  `file` is the path of the results file.
std::string junit(const RunRecord& run, const std::string& file);

}  // namespace nullmark
