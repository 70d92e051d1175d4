#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "harness/io/text.h"

namespace nullmark {

/// Writes the text to standard error as it is.  What cannot be written is lost: no run ends because nobody listens.
void write_notice(std::string_view text) noexcept;

/// Formats and writes a line, or part of one, for people.  Never throws for what becomes of the text.
template <class... Arguments>
void notice(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  write_notice(plain_text(fmt::format(format, std::forward<Arguments>(arguments)...)));
}

/// Formats and prints text for people to standard output.  Throws std::system_error where it cannot be written.
template <class... Arguments>
void tell(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  fmt::print("{}", plain_text(fmt::format(format, std::forward<Arguments>(arguments)...)));
}

}  // namespace nullmark
