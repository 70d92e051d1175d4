#pragma once

#include "harness/io/json_input.h"
#include "harness/model/record.h"

namespace nullmark {

/// Throws InputError where the numbers of a cell contradict each other, as in a file that was changed by hand or is damaged.
/// Figures that no other figure determines can be changed unseen.
void expect_consistent(const CellRecord& record, const JsonNode& cell);

}  // namespace nullmark
