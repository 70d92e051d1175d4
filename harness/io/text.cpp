#include "harness/io/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "harness/io/json_input.h"

namespace nullmark {

std::string short_number(const std::optional<Real>& number) { return number ? fmt::format("{:.4g}", *number) : "-"; }

std::string aligned(const std::vector<std::vector<std::string>>& lines, std::size_t left) {
  std::vector<std::size_t> width(lines[0].size(), 0);
  for (const std::vector<std::string>& line : lines)
    for (std::size_t i = 0; i < line.size(); ++i) width[i] = std::max(width[i], line[i].size());
  std::string text;
  for (const std::vector<std::string>& line : lines) {
    std::string row;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (i > 0) row += "  ";
      row +=
          i < left || i + 1 == line.size() ? fmt::format("{:<{}}", line[i], width[i]) : fmt::format("{:>{}}", line[i], width[i]);
    }
    row.erase(row.find_last_not_of(' ') + 1);
    text += row + "\n";
  }
  return text;
}

namespace {

/// Text that ends neither a cell nor a line of a table.
std::string within_cell(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '|' ? "\\|" : c == '\n' ? " " : std::string(1, c);
  return plain_text(result);
}

}  // namespace

std::string markdown_cell(const std::string& text) {
  const auto begins_html = [&](std::size_t i) {
    const char next = i + 1 < text.size() ? text[i + 1] : ' ';
    return text[i] == '<' && (std::isalpha(static_cast<unsigned char>(next)) || next == '/' || next == '!' || next == '?');
  };
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) result += begins_html(i) ? "&lt;" : std::string(1, text[i]);
  return within_cell(result);
}

std::string markdown_code(const std::string& text) {
  // Code ends where as many backticks follow each other as it began with.
  std::size_t longest = 0, run = 0;
  for (const char c : text) longest = std::max(longest, run = c == '`' ? run + 1 : 0);
  const std::string fence(longest + 1, '`'), space(longest > 0 ? 1 : 0, ' ');
  return fence + space + within_cell(text) + space + fence;
}

std::string plain_text(std::string_view text) {
  const auto byte_at = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0; };
  // The second block of control characters is two bytes each in UTF-8.
  const auto second_block = [&](std::size_t i) { return byte_at(i) == 0xc2 && byte_at(i + 1) >= 0x80 && byte_at(i + 1) <= 0x9f; };
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = byte_at(i);
    if ((byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7f)
      result += fmt::format("\\x{:02x}", byte);
    else if (second_block(i))
      result += fmt::format("\\x{:02x}", byte_at(++i));
    else
      result += text[i];
  }
  return result;
}

std::string markdown_table(const std::vector<std::vector<std::string>>& lines) {
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (const std::string& word : lines[i]) text += fmt::format("| {} ", markdown_cell(word));
    text += "|\n";
    if (i > 0) continue;
    for (std::size_t c = 0; c < lines[0].size(); ++c) text += "|---";
    text += "|\n";
  }
  return text;
}

namespace {

/// Bytes that are no UTF-8, and the two characters that XML excludes, as U+FFFD.
std::string characters_of_xml(const std::string& text) {
  std::string valid = known_json(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
  for (const char* excluded : {"\xef\xbf\xbe", "\xef\xbf\xbf"})
    for (std::size_t at = valid.find(excluded); at != std::string::npos; at = valid.find(excluded, at))
      valid.replace(at, 3, "\xef\xbf\xbd");
  return valid;
}

}  // namespace

std::string xml(const std::string& text) {
  std::string result;
  for (const char c : characters_of_xml(text)) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      // XML has no way to write control characters.
      default:
        result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  return result;
}

std::string shell_quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? "'\\''" : std::string(1, c);
  return result + "'";
}

}  // namespace nullmark
