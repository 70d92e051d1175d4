#pragma once

#include <string>
#include <vector>

namespace nullmark {

/// Throws InputError if an output of a command is also one of its inputs or another of its outputs, by any name or link.  Folders
/// among the inputs stand for their *.json files; "" and "-" are ignored.
void refuse_overwriting(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

/// A page, table or report: a command makes it again at any time, so it replaces an earlier one.
struct TextOutput {
  std::string path, beginning;  ///< what every such text begins with
};

/// The same, and throws InputError as well if an output would replace a file that does not begin like it.
void refuse_overwriting_others(const std::vector<std::string>& inputs, const std::vector<TextOutput>& outputs);

/// Throws InputError if a file exists and `force` is false, or if it does not begin like those that `force` replaces.  "" and "-"
/// are ignored.
void expect_new(const std::string& output, bool force, const std::string& beginning);

}  // namespace nullmark
