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

/// What a file holds, if no page, table or report begins like it; else empty.
std::string data_in(const std::string& path) {
  constexpr std::size_t kBeginning = 4096;
  std::string text(kBeginning, '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  const bool object = first != std::string::npos && text[first] == '{';
  for (const char* key : {"\"nullmark\":", "\"nullmark_journal\":", "\"nullmark_baseline\":"})
    if (object && text.find(key) != std::string::npos) return "a configuration or results";
  for (const auto& [magic, what] :
       {std::pair{"\x1f\x8b", "packed data"}, {" BDV", "a volume"}, {"\x93NUMPY", "samples"}, {"\x76\x2f\x31\x01", "an image"}})
    if (text.starts_with(magic)) return what;
  return "";
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

void refuse_overwriting_data(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs) {
  refuse_overwriting(inputs, outputs);
  for (const std::string& output : outputs) {
    std::error_code error;
    if (!is_file(output) || !fs::is_regular_file(output, error)) continue;
    if (const std::string data = data_in(output); !data.empty())
      throw InputError(fmt::format("{}: holds {}, which this output would replace; give the output another path", output, data));
  }
}

void expect_new(const std::string& output, bool force) {
  if (is_file(output) && !force && fs::exists(output)) throw InputError(output + ": exists; --force replaces it");
}

}  // namespace nullmark
