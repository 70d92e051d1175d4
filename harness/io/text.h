#pragma once

#include <optional>
#include <string>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// Lines with the same number of words, as aligned columns; the first line is the heading.  The first `left` columns and the last
/// one are left-aligned, the others right-aligned.
std::string aligned(const std::vector<std::vector<std::string>>& lines, std::size_t left);

/// The same as a markdown table; escaped text for one of its cells.
std::string markdown_table(const std::vector<std::vector<std::string>>& lines);
std::string markdown_cell(const std::string& text);

/// Four significant digits, or "-" if there is no number.
std::string short_number(const std::optional<Real>& number);

/// Text escaped for XML, including attributes.
std::string xml(const std::string& text);

/// Text quoted as one word of a shell command.
std::string shell_quoted(const std::string& text);

}  // namespace nullmark
