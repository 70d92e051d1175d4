#pragma once

#include <string>

#include "harness/model/record.h"

namespace nullmark {

/// The cells of `nullmark prove` by experiment: how many passed, and the least bias that their PASSes exclude.
std::string scenes_text(const RunRecord& run);

/// The first failure and the first undecided cell of each experiment with its reason, the first untested cell of each reason, and
/// how many more there are.
std::string findings_text(const RunRecord& run);

}  // namespace nullmark
