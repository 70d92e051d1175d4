#pragma once

#include <string>

#include "harness/io/json_input.h"
#include "harness/model/record.h"

namespace nullmark {

/// A cell as the results file holds it.  One channel: numbers; more: lists.  null for what is not known or not finite.
Json cell_json(const CellRecord& record);

/// The inverse: complete but for the cell's indices into its plan's lists, which are 0; the record holds what they referred to.
/// Numbers come back bit for bit.  Throws InputError.
CellRecord read_cell(const JsonNode& node);

/// JSON Schema of a cell in the results file.
Json cell_schema();

/// The results file, one cell a line.
std::string results_text(const RunRecord& run);

/// Reads files of the same major schema number; keys it does not know are ignored.  Throws InputError.
RunRecord read_results(const std::string& text, const std::string& file);

/// Everything that the seed decides, one cell a line: no time, no provenance, no file names.  Equal texts mean equal statistics
/// to the last bit.
std::string statistics_text(const RunRecord& run);

}  // namespace nullmark
