#pragma once

#include <string>

#include "harness/io/json_input.h"

namespace nullmark {

/// One self-contained HTML page that shows the data (harness/report/report.md), with style, scripts, and plotly.js and its
/// licence.
std::string report_page(const Json& data);

}  // namespace nullmark
