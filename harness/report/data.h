#pragma once

#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/record.h"

namespace nullmark {

struct ReportData {
  Json json;
  std::vector<std::string> warnings;  ///< what cannot be shown, and why
};

/// All data of a report's page; report.md describes the format.  `files` are the paths of the results, `command` is the command
/// line of the report.
ReportData report_data(std::vector<RunRecord> runs, const std::vector<std::string>& files, const std::string& baseline,
                       const std::string& command);

}  // namespace nullmark
