#pragma once

#include <string>

#include "harness/model/record.h"

namespace nullmark {

/// The cells of `nullmark prove` by experiment: how many passed, and the least bias that their PASSes exclude.
std::string scenes_text(const RunRecord& run);

/// The first failure, the first undecided and the first untested cell of each experiment with its reason, and how many more there
/// are.
std::string findings_text(const RunRecord& run);

}  // namespace nullmark
