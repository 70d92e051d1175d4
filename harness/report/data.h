#pragma once

#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/record.h"

namespace nullmark {

struct ReportData {
  Json json;
  std::vector<std::string> warnings;  ///< what could not be shown, and why
};

/// All that a report's page shows, every number computed: harness/report/report.md has the form.  `files` are the paths of the
/// runs' results, `command` the words that asked for the report.
ReportData report_data(std::vector<RunRecord> runs, const std::vector<std::string>& files, const std::string& baseline,
                       const std::string& command);

}  // namespace nullmark
