#include "harness/io/fitted.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "harness/io/json_input.h"
#include "harness/io/text.h"

namespace nullmark {
namespace {

using Lines = std::vector<std::vector<std::string>>;

constexpr std::size_t kBetween = 2;

std::size_t width_of(const Lines& lines, std::size_t column) {
  std::size_t width = 0;
  for (const std::vector<std::string>& line : lines) width = std::max(width, line[column].size());
  return width;
}

bool is_inside_character(const std::string& text, std::size_t at) {
  return at < text.size() && (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80;
}

constexpr const char* kDots = "...";
constexpr std::size_t kDotsWidth = 3;

/// Text of at most so many bytes, whose end is left out; no character is halved.
std::string without_end(const std::string& text, std::size_t width) {
  if (text.size() <= width) return text;
  std::size_t end = std::max(width, kDotsWidth) - kDotsWidth;
  while (is_inside_character(text, end)) --end;
  return text.substr(0, end) + kDots;
}

/// The same of names, which differ at their ends: the middle is left out.
std::string without_middle(const std::string& text, std::size_t width) {
  if (text.size() <= width) return text;
  const std::size_t kept = std::max(width, kDotsWidth) - kDotsWidth;
  std::size_t begin = kept / 3, end = text.size() - (kept - kept / 3);
  while (is_inside_character(text, begin)) --begin;
  while (is_inside_character(text, end)) ++end;
  return text.substr(0, begin) + kDots + text.substr(end);
}

}  // namespace

std::string fitted(Lines lines, std::size_t left, std::size_t width, std::vector<std::string>& left_out) {
  // A last column of text has room for this much at least, or it is left out.
  constexpr std::size_t kLeastText = 16;
  const std::size_t all = lines[0].size();
  std::size_t needed = 0;
  for (std::size_t i = 0; i < all; ++i) needed += width_of(lines, i) + (i > 0 ? kBetween : 0);
  if (width == 0 || needed <= width) return aligned(lines, left);
  for (std::vector<std::string>& line : lines) line[0] = without_middle(line[0], all > 1 ? width / 2 : width);
  std::size_t used = width_of(lines, 0), columns = 1;
  for (; columns < all; ++columns) {
    const std::size_t own = width_of(lines, columns) + kBetween;
    if (used + own > width) break;
    used += own;
  }
  if (columns + 1 == all && width >= used + kBetween + kLeastText) {
    for (std::vector<std::string>& line : lines) line.back() = without_end(line.back(), width - used - kBetween);
    columns = all;
  }
  for (std::size_t i = columns; i < all; ++i)
    if (std::find(left_out.begin(), left_out.end(), lines[0][i]) == left_out.end()) left_out.push_back(lines[0][i]);
  for (std::vector<std::string>& line : lines) line.resize(columns);
  return aligned(lines, left);
}

std::string shaped(const Lines& lines, std::size_t left, std::size_t kept, const TableShape& shape,
                   std::vector<std::string>& left_out) {
  if (shape.columns.empty()) return fitted(lines, left, shape.width, left_out);
  std::vector<std::size_t> places(kept);
  std::iota(places.begin(), places.end(), std::size_t{0});
  for (const std::string& word : shape.columns) {
    const auto place = static_cast<std::size_t>(std::find(lines[0].begin(), lines[0].end(), word) - lines[0].begin());
    if (place >= kept && place < lines[0].size()) places.push_back(place);
  }
  Lines chosen;
  for (const std::vector<std::string>& line : lines) {
    std::vector<std::string>& one = chosen.emplace_back();
    for (const std::size_t place : places) one.push_back(line[place]);
  }
  return fitted(std::move(chosen), kept, shape.width, left_out);
}

std::string left_out_line(const std::vector<std::string>& left_out) {
  return left_out.empty() ? "" : fmt::format("no room for columns: {}; --columns chooses some\n", fmt::join(left_out, ", "));
}

void expect_columns(const std::vector<std::string>& words, const std::vector<std::string>& headings) {
  for (const std::string& word : words)
    if (word != "estimator" && std::find(headings.begin(), headings.end(), word) == headings.end()) {
      const std::string near = nearest(word, headings);
      throw InputError(fmt::format("--columns: unknown column \"{}\"; {}", word,
                                   near.empty() ? fmt::format("expected some of {}", fmt::join(headings, ","))
                                                : fmt::format("did you mean \"{}\"?", near)));
    }
}

std::string wrapped(const std::string& text, std::size_t width) {
  constexpr const char* kIndent = "    ";
  constexpr std::size_t kLeastWidth = 20;
  if (width < kLeastWidth) return text;
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string line = text.substr(at, end - at);
    while (line.size() > width) {
      // A word that is too long stays whole.
      std::size_t space = line.rfind(' ', width);
      if (space == std::string::npos || line.find_first_not_of(' ') > space) space = line.find(' ', width);
      if (space == std::string::npos) break;
      result += line.substr(0, space) + "\n";
      line = kIndent + line.substr(space + 1);
    }
    result += line + (end < text.size() ? "\n" : "");
    at = end + 1;
  }
  return result;
}

std::size_t terminal_width() {
  if (const char* columns = std::getenv("COLUMNS"))
    if (const auto number = whole_number(columns)) return static_cast<std::size_t>(*number);
  winsize size{};
  if (isatty(STDOUT_FILENO) && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) return size.ws_col;
  return 0;
}

}  // namespace nullmark
