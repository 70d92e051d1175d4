#pragma once

#include <optional>
#include <string>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// Lines of equally many words as aligned columns, the first line being the heading; the first `left` columns and the last one
/// are set flush left, the others flush right.
std::string aligned(const std::vector<std::vector<std::string>>& lines, std::size_t left);

/// The same as a table of markdown, and text for one of its cells.
std::string markdown_table(const std::vector<std::vector<std::string>>& lines);
std::string markdown_cell(const std::string& text);

/// Four significant digits, "-" where there is no number.
std::string short_number(const std::optional<Real>& number);

/// Text as XML writes it, in attributes too.
std::string xml(const std::string& text);

/// One word of a shell command.
std::string shell_quoted(const std::string& text);

}  // namespace nullmark
