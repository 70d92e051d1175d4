#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// "google-benchmark", "csv", "jsonl", "junit".
const std::vector<std::string>& export_formats();

/// What exports in a format begin with.
std::string export_beginning(const std::string& format);

/// Results in the format of another program; `file` is the path of the results, for messages and reproduction commands.
///
///   google-benchmark  one row per timed repetition, names estimator/medium/param:value; for compare.py
///   csv               one row per cell and channel, RFC 4180
///   jsonl             one cell of the results file per line, with its word, its marks and its reason
///   junit             one test case per cell: see junit.h
std::string export_results(const RunRecord& run, const std::string& format, const std::string& file);

}  // namespace nullmark
