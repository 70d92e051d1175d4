#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace nullmark {

/// Lines as `aligned` writes them, in at most `width` characters; 0: any width.  Columns that have no room are left out from the
/// right.  The first column is cut in its middle, to half of the width, and the last one at its end.  The headings of what was
/// left out are added to `left_out`, each once.
std::string fitted(std::vector<std::vector<std::string>> lines, std::size_t left, std::size_t width,
                   std::vector<std::string>& left_out);

/// What a table may show: `columns` by their headings, empty for all, in at most `width` characters.
struct TableShape {
  std::size_t width = 0;
  std::vector<std::string> columns;
};

/// The table in that shape.  The first `kept` columns are always there, and the first `left` are left-aligned.  Words that are no
/// heading are left out.
std::string shaped(const std::vector<std::vector<std::string>>& lines, std::size_t left, std::size_t kept,
                   const TableShape& shape, std::vector<std::string>& left_out);

/// "no room for columns: ..." and how to choose them; empty where all had room.
std::string left_out_line(const std::vector<std::string>& left_out);

/// Throws InputError for a word that is no heading, with the nearest one, else with all of them.  "estimator" is always shown.
void expect_columns(const std::vector<std::string>& words, const std::vector<std::string>& headings);

/// Text whose lines are broken at spaces where they are longer; 0: as it is.
std::string wrapped(const std::string& text, std::size_t width);

/// Characters of a line of the terminal: the variable COLUMNS, else what standard output says of itself; 0 where it is no
/// terminal.
std::size_t terminal_width();

}  // namespace nullmark
