#pragma once

#include <string>

#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/model/record.h"

namespace nullmark {

/// The JSON of a cell in the results file.  Numbers for one channel, lists for more; null if unknown or not finite.
Json cell_json(const CellRecord& record);

/// The inverse, complete except for the indices into the plan's lists, which are 0; the record holds the specifications
/// themselves.  Numbers are restored bit for bit.  Throws InputError.
CellRecord read_cell(const JsonNode& node);

/// JSON Schema of a cell in the results file.
Json cell_schema();

/// The text of a results file, one cell per line.
void write_results(const RunRecord& run, const TextSink& to);

/// What results files begin with, of whatever version of their keys.
inline constexpr const char* kResultsBeginning = "{\n\"nullmark\": \"results/";
/// The same to a file, atomically.  Throws InputError if it cannot be written.
void write_results(const RunRecord& run, const std::string& path);
std::string results_text(const RunRecord& run);

/// Reads files of the same major schema number; ignores unknown keys.  Throws InputError.
RunRecord read_results(const std::string& text, const std::string& file);
RunRecord read_results_file(const std::string& file);

/// Everything that the seed determines, one cell per line, without times, provenance and file names.  Equal texts mean
/// bit-identical statistics.
std::string statistics_text(const RunRecord& run);

}  // namespace nullmark
