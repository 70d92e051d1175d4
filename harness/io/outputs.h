#pragma once

#include <string>
#include <vector>

namespace nullmark {

/// Throws InputError where an output of a command is one of its inputs or another of its outputs, by whatever name or link.  The
/// *.json of folders among the inputs count; "" and "-" do not.
void refuse_overwriting(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

}  // namespace nullmark
