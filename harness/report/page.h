#pragma once

#include <string>

#include "harness/io/json_input.h"

namespace nullmark {

/// One HTML page that shows the data (harness/report/report.md) and needs nothing beside it: style, scripts and plotly.js with
/// its licence are part of it.
std::string report_page(const Json& data);

}  // namespace nullmark
