#pragma once

#include <string>
#include <vector>

namespace nullmark {

/// Throws InputError if an output of a command is also one of its inputs or another of its outputs, by any name or link.  Folders
/// among the inputs stand for their *.json files; "" and "-" are ignored.
void refuse_overwriting(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

/// The same of pages, tables and reports, which a command makes again at any time and which replace earlier ones.  Throws
/// InputError as well if an output would replace a file of another kind: a configuration, results, samples or a volume.
void refuse_overwriting_data(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

/// Throws InputError if a file that holds measurements exists and `force` is false.  "" and "-" are ignored.
void expect_new(const std::string& output, bool force);

}  // namespace nullmark
