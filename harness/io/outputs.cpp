#include "harness/io/outputs.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

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

bool is_file(const std::string& path) { return !path.empty() && path != "-"; }

/// Whether a file is empty or begins so.
bool begins_with(const std::string& path, const std::string& beginning) {
  std::string text(beginning.size(), '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  return in.gcount() == 0 || text == beginning;
}

}  // namespace

void refuse_overwriting(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs) {
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

void refuse_overwriting_others(const std::vector<std::string>& inputs, const std::vector<TextOutput>& outputs) {
  std::vector<std::string> paths;
  for (const TextOutput& output : outputs) paths.push_back(output.path);
  refuse_overwriting(inputs, paths);
  for (const auto& [path, beginning] : outputs) {
    std::error_code error;
    if (is_file(path) && fs::is_regular_file(path, error) && !begins_with(path, beginning))
      throw InputError(path + ": exists and is no earlier output of this kind; remove it, or give the output another path");
  }
}

void expect_new(const std::string& output, bool force, const std::string& beginning) {
  std::error_code error;
  if (!is_file(output) || !fs::exists(output, error)) return;
  if (!force) throw InputError(output + ": exists; --force replaces it");
  if (fs::is_regular_file(output, error) && !begins_with(output, beginning))
    throw InputError(output + ": exists and is nothing that --force replaces here; remove it, or give the output another path");
}

}  // namespace nullmark
