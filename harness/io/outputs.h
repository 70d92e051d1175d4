#pragma once

#include <string>
#include <vector>

namespace nullmark {

/// Throws InputError if an output of a command is also one of its inputs or another of its outputs, by any name or link.  Folders
/// among the inputs stand for their *.json files; "" and "-" are ignored.
void refuse_overwriting(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

}  // namespace nullmark
