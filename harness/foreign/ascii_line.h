#pragma once

#include <algorithm>
#include <string>
#include <string_view>

namespace nullmark {

/// Text from outside as one line for messages and records: printable ASCII, others as "?", at most 300 characters.
inline std::string ascii_line(std::string_view text) {
  constexpr std::size_t kMost = 300;
  std::string line(text.substr(0, kMost));
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text.size() > kMost ? line + "..." : line;
}

}  // namespace nullmark
