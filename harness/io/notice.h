#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace nullmark {

/// Writes the text to standard error.  What cannot be written is lost: no run ends because nobody listens.
void write_notice(std::string_view text) noexcept;

/// Formats and writes a line, or part of one, for people.  Never throws for what becomes of the text.
template <class... Arguments>
void notice(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write_notice(fmt::format(format, std::forward<Arguments>(arguments)...));
}

}  // namespace nullmark
