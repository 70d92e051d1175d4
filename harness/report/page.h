#pragma once

#include <string>

#include "harness/io/json_input.h"

namespace nullmark {

/// What every page begins with.
std::string page_beginning();

/// One self-contained HTML page that shows the data (harness/report/report.md), with style, scripts, and plotly.js and its
/// licence.
std::string report_page(const Json& data);

}  // namespace nullmark
