#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// Lines with the same number of words, as aligned columns; the first line is the heading.  The first `left` columns and the last
/// one are left-aligned, the others right-aligned.
std::string aligned(const std::vector<std::vector<std::string>>& lines, std::size_t left);

/// The same as a markdown table.
std::string markdown_table(const std::vector<std::vector<std::string>>& lines);

/// Text as LaTeX prints it: what it would read is escaped, letters beyond ASCII are question marks.
std::string latex(const std::string& text);

/// Such lines as a LaTeX table of the packages booktabs and graphicx, with a caption; the first `left` columns are left-aligned.
std::string latex_table(const std::vector<std::vector<std::string>>& lines, std::size_t left, const std::string& caption);

/// Text for a cell of a markdown table, or for a line: no cell ends in it and no HTML begins.
std::string markdown_cell(const std::string& text);

/// The same as code that can be copied.
std::string markdown_code(const std::string& text);

/// Text for people: control characters other than line breaks and tabs, which a terminal would obey, are shown as \x1b, and those
/// that change the direction of the text as \u202e.
std::string plain_text(std::string_view text);

/// A name: plain text whose line breaks and tabs are shown as \x0a as well.
std::string printable(std::string_view text);

/// A message: one line of plain text.  Of more than 2000 bytes, as where it quotes a long name, the middle is left out.
std::string one_line(std::string_view text);

/// The whole number >= 0 that a text is; none where it is another or too large.
std::optional<std::uint64_t> whole_number(std::string_view text);

/// Four significant digits, or "-" if there is no number.
std::string short_number(const std::optional<Real>& number);

/// Text escaped for XML, including attributes.  What XML cannot hold is replaced.
std::string xml(const std::string& text);

/// Text quoted as one word of a shell command.
std::string shell_quoted(const std::string& text);

}  // namespace nullmark
