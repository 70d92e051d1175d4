#include "harness/io/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "harness/io/json_input.h"

namespace nullmark {

std::optional<std::uint64_t> whole_number(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

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

namespace {

/// Characters that a terminal shows nothing of, though it obeys them: U+200E, U+202E and their kin, and the breaks of lines and
/// paragraphs.
bool directs(unsigned character) {
  return character == 0x061c || character == 0x200e || character == 0x200f || (character >= 0x2028 && character <= 0x202e) ||
         (character >= 0x2066 && character <= 0x2069);
}

bool continues_character(char byte) { return (static_cast<unsigned char>(byte) & 0xc0) == 0x80; }

std::string without_controls(std::string_view text, std::string_view kept) {
  const auto byte_at = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const unsigned byte = byte_at(i);
    // Of UTF-8 with two bytes and with three.
    const unsigned of_two = (byte & 0x1f) << 6 | (byte_at(i + 1) & 0x3f),
                   of_three = (byte & 0x0f) << 12 | (byte_at(i + 1) & 0x3f) << 6 | (byte_at(i + 2) & 0x3f);
    if ((byte < 0x20 && kept.find(text[i]) == std::string_view::npos) || byte == 0x7f) {
      result += fmt::format("\\x{:02x}", byte);
    } else if (byte == 0xc2 && of_two >= 0x80 && of_two <= 0x9f) {
      result += fmt::format("\\x{:02x}", of_two);
      i += 1;
    } else if (byte == 0xd8 && directs(of_two)) {
      result += fmt::format("\\u{:04x}", of_two);
      i += 1;
    } else if (byte == 0xe2 && directs(of_three)) {
      result += fmt::format("\\u{:04x}", of_three);
      i += 2;
    } else {
      result += text[i];
    }
  }
  return result;
}

}  // namespace

std::string plain_text(std::string_view text) { return without_controls(text, "\n\t"); }

std::string printable(std::string_view text) { return without_controls(text, ""); }

std::string one_line(std::string_view text) {
  constexpr std::size_t kLongest = 2000, kEnd = 600;
  constexpr std::string_view kLeftOut = " ... ";
  std::string line = plain_text(text);
  std::replace(line.begin(), line.end(), '\n', ' ');
  if (line.size() <= kLongest) return line;
  // No character is cut.
  std::size_t begin = kLongest - kEnd - kLeftOut.size(), end = line.size() - kEnd;
  while (continues_character(line[begin])) --begin;
  while (end < line.size() && continues_character(line[end])) ++end;
  return line.substr(0, begin).append(kLeftOut).append(line, end);
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

std::string latex(const std::string& text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (text.compare(i, 2, "±") == 0) {
      result += "$\\pm$";
      ++i;
    } else if (std::string_view("#$%&_{}").find(c) != std::string_view::npos) {
      result += {'\\', c};
    } else if (c == '\\' || c == '~' || c == '^') {
      result += c == '\\' ? "\\textbackslash{}" : c == '~' ? "\\textasciitilde{}" : "\\textasciicircum{}";
    } else if (c == '<' || c == '>' || c == '|') {
      result += fmt::format("${}$", c);
    } else if (static_cast<unsigned char>(c) < 0x80) {
      result += c;
    } else if ((static_cast<unsigned char>(c) & 0xc0) != 0x80) {
      result += '?';
    }
  }
  return result;
}

std::string latex_table(const std::vector<std::vector<std::string>>& lines, std::size_t left, const std::string& caption) {
  const std::size_t columns = lines.at(0).size();
  // As wide as the text, whatever the columns need.
  std::string text = fmt::format(
      "\\begin{{table}}\n\\centering\n\\caption{{{}}}\n\\resizebox{{\\linewidth}}{{!}}{{%\n\\begin{{tabular}}{{{}{}}}"
      "\n\\toprule\n",
      latex(caption), std::string(std::min(left, columns), 'l'), std::string(columns - std::min(left, columns), 'r'));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t c = 0; c < lines[i].size(); ++c) text += (c > 0 ? " & " : "") + latex(lines[i][c]);
    text += i == 0 ? " \\\\\n\\midrule\n" : " \\\\\n";
  }
  return text + "\\bottomrule\n\\end{tabular}}\n\\end{table}\n";
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
  for (const char c : characters_of_xml(plain_text(text))) switch (c) {
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
