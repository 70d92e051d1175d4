#pragma once

#include <string>

namespace nullmark {

/// Opens the file with OpenVDB, on one thread, and writes what flat_volume.h describes to the open file `answer`.  Damaged files
/// may end the process.  Returns false where the answer cannot be written.
bool answer_volume(const std::string& file, const std::string& grid, int answer);

}  // namespace nullmark
