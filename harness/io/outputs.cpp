#include "harness/io/outputs.h"

#include <fmt/format.h>

#include <filesystem>

#include "harness/io/json_input.h"

namespace nullmark {

namespace fs = std::filesystem;

namespace {

/// Where a file of this path will be: a link that leads to nothing yet is followed as well.
fs::path destination(fs::path path) {
  std::error_code error;
  constexpr int kMostLinks = 40;
  for (int i = 0; i < kMostLinks && fs::is_symlink(path, error); ++i) path = path.parent_path() / fs::read_symlink(path, error);
  return fs::weakly_canonical(fs::absolute(path, error), error);
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  // A path that leads nowhere has no destination.
  const fs::path leads = destination(a);
  return fs::equivalent(a, b, error) || (!leads.empty() && leads == destination(b));
}

}  // namespace

void refuse_overwriting(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs) {
  const auto is_file = [](const std::string& path) { return !path.empty() && path != "-"; };
  std::vector<std::string> read;
  for (const std::string& input : inputs) {
    std::error_code error;
    if (is_file(input)) read.push_back(input);
    for (const fs::directory_entry& entry : fs::directory_iterator(input, error))
      if (entry.path().extension() == ".json") read.push_back(entry.path().string());
  }
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (!is_file(outputs[i])) continue;
    for (const std::string& input : read)
      if (same_file(outputs[i], input))
        throw InputError(
            fmt::format("{}: would overwrite {}, which the command reads; give the output another path", outputs[i], input));
    for (std::size_t j = 0; j < i; ++j)
      if (is_file(outputs[j]) && same_file(outputs[i], outputs[j]))
        throw InputError(
            fmt::format("{}: two outputs of the command would be written to this file; give each its own path", outputs[i]));
  }
}

}  // namespace nullmark
