#pragma once

#include <string>
#include <vector>

#include "harness/model/record.h"

namespace nullmark {

/// Judges the split cells of merged results by the samples that their parts hold, as a run of the whole cell would.  A cell whose
/// verdict asks for samples that are missing stays as it is, with the reason.  Pictures go beside `output`, empty: nowhere.
/// Returns the names of the cells that stay.  Throws InputError for parts that do not fit the cell.
std::vector<std::string> judge_parts(RunRecord& merged, const std::string& file, const std::string& output);

}  // namespace nullmark
