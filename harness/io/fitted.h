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

/// The columns of the table that the words name, in the order of the words; the first one is always there.  Throws InputError
/// with the list of them for a word that is no heading.
std::vector<std::vector<std::string>> chosen_columns(const std::vector<std::vector<std::string>>& lines,
                                                     const std::vector<std::string>& words);

/// Characters of a line of the terminal: the variable COLUMNS, else what standard output says of itself; 0 where it is no
/// terminal.
std::size_t terminal_width();

}  // namespace nullmark
