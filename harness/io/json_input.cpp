#include "harness/io/json_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>

#include "harness/io/text.h"

template class nlohmann::basic_json<nlohmann::ordered_map>;

namespace nullmark {
namespace {

/// Reads a text and tells how far the parser has come, which its callback does not.
class Cursor {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  Cursor(const char* at, const char** seen) : at_(at), seen_(seen) {}
  reference operator*() const { return *at_; }
  Cursor& operator++() {
    *seen_ = ++at_;
    return *this;
  }
  Cursor operator++(int) {
    Cursor old = *this;
    ++*this;
    return old;
  }
  bool operator==(const Cursor& other) const { return at_ == other.at_; }
  bool operator!=(const Cursor& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const char** seen_;
};

/// "file:line:column" of a byte.
std::string position(const std::string& file, std::string_view text, std::size_t offset) {
  const std::string_view before = text.substr(0, offset);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t start = before.rfind('\n');
  return fmt::format("{}:{}:{}", file, line, offset - (start == std::string_view::npos ? 0 : start + 1) + 1);
}

/// The library's message without its number and its own account of the place.
std::string bare_message(const std::string& what) {
  for (const std::string_view marker : {"syntax error ", "number overflow "})
    if (const std::size_t at = what.find(marker); at != std::string::npos) return what.substr(at);
  return what;
}

/// What to do about the two slips that other formats allow: a comment, or a comma after the last entry.
std::string remedy(std::string_view text, std::size_t at) {
  if (at == 0) return "";
  const std::size_t before = text.find_last_not_of(" \t\r\n", at - 1);
  if (before == std::string_view::npos) return "";
  if (text[at] == '/' || text[before] == '/') return "; JSON has no comments";
  return text[before] == ',' && (text[at] == '}' || text[at] == ']') ? "; remove the comma before it" : "";
}

/// Where the string begins whose closing quote stands at `end`.
std::size_t opening_quote(std::string_view text, std::size_t end) {
  for (std::size_t at = end; at-- > 0;) {
    if (text[at] != '"') continue;
    std::size_t slashes = 0;
    while (slashes < at && text[at - 1 - slashes] == '\\') ++slashes;
    if (slashes % 2 == 0) return at;
  }
  return 0;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// How an error shows a value: short, on one line.
std::string shown(const Json& value) {
  if (value.is_object()) return "an object";
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  constexpr std::size_t kLongest = 60;
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  return text;
}

std::string escaped(std::string key) {
  for (std::size_t i = 0; i < key.size(); ++i)
    if (key[i] == '~')
      key.replace(i++, 1, "~0");
    else if (key[i] == '/')
      key.replace(i++, 1, "~1");
  return key;
}

}  // namespace

Json parse_json(const std::string& text, const std::string& file) {
  // To the parser it is the end of the text.
  if (const std::size_t zero = text.find('\0'); zero != std::string::npos)
    throw InputError(position(file, text, zero) + ": a byte of value 0; expected the text of a JSON file");
  const char* const begin = text.data();
  const char* seen = begin;
  const auto offset = [&] { return static_cast<std::size_t>(seen - begin); };
  // What writes and shows values calls itself for each level.
  constexpr int kDeepest = 100;
  std::vector<std::set<std::string>> keys;
  const auto callback = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (depth > kDeepest)
      throw InputError(fmt::format("{}: lists and objects are nested more than {} deep",
                                   position(file, text, std::max<std::size_t>(offset(), 1) - 1), kDeepest));
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second) {
      const std::string at = position(file, text, opening_quote(text, offset() - 1));
      throw InputError(fmt::format("{}: key {} occurs twice in this object", at, parsed.dump()));
    }
    return true;
  };
  try {
    return Json::parse(Cursor(begin, &seen), Cursor(begin + text.size(), &seen), callback);
  } catch (const Json::parse_error& error) {
    // The parser has then read past the last byte.
    if (error.byte > text.size())
      throw InputError(position(file, text, text.size()) +
                       (text.empty() ? ": is empty; expected JSON" : ": ends in the middle; expected the whole of a JSON file"));
    const std::size_t at = std::min(text.size() - 1, std::max<std::size_t>(error.byte, 1) - 1);
    throw InputError(position(file, text, at) + ": " + bare_message(error.what()) + remedy(text, at));
  } catch (const Json::out_of_range& error) {
    throw InputError(position(file, text, std::max<std::size_t>(offset(), 1) - 1) + ": " + bare_message(error.what()));
  }
}

InputError::InputError(const std::string& message) : std::runtime_error(one_line(message)) {}

Json number_or_null(Real x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }
Json number_or_null(const std::optional<Real>& x) { return x ? number_or_null(*x) : Json(nullptr); }

Json known_json(const std::string& text) { return Json::parse(text, nullptr, false); }

std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates)
    if (const std::size_t distance = edit_distance(word, candidate); distance < least && distance < candidate.size()) {
      least = distance;
      best = candidate;
    }
  return best;
}

JsonNode JsonNode::operator[](const std::string& key) const {
  const auto at = value_->find(key);
  if (at == value_->end()) fail(fmt::format("\"{}\" is missing", key));
  return {*at, file_, pointer_ + "/" + escaped(key)};
}

JsonNode JsonNode::operator[](std::size_t index) const {
  return {(*value_)[index], file_, fmt::format("{}/{}", pointer_, index)};
}

std::vector<JsonNode> JsonNode::elements() const {
  if (!value_->is_array()) expected("a list");
  std::vector<JsonNode> result;
  for (std::size_t i = 0; i < value_->size(); ++i) result.push_back((*this)[i]);
  return result;
}

std::vector<JsonNode> JsonNode::elements_or_self() const {
  return value_->is_array() ? elements() : std::vector<JsonNode>{*this};
}

void JsonNode::expect_object() const {
  if (!value_->is_object()) expected("an object");
}

void JsonNode::expect_keys(const std::vector<std::string>& allowed) const {
  expect_object();
  for (const auto& [key, value] : value_->items())
    if (key.rfind("x-", 0) != 0 && std::find(allowed.begin(), allowed.end(), key) == allowed.end())
      (*this)[key].unknown("key", key, allowed);
}

bool JsonNode::boolean() const {
  if (!value_->is_boolean()) expected("true or false");
  return value_->get<bool>();
}

std::string JsonNode::string() const {
  if (!value_->is_string()) expected("a string");
  return value_->get<std::string>();
}

std::string JsonNode::one_of(const std::vector<std::string>& names, const char* what) const {
  if (!value_->is_string()) expected(fmt::format("one of \"{}\"", fmt::join(names, "\", \"")));
  std::string name = value_->get<std::string>();
  if (std::find(names.begin(), names.end(), name) == names.end()) unknown(what, name, names);
  return name;
}

Real JsonNode::number() const {
  if (!value_->is_number()) expected("a number");
  return value_->get<Real>();
}

Real JsonNode::positive() const {
  const Real value = number();
  if (!(value > 0) || !std::isfinite(value)) expected("a finite number > 0");
  return value;
}

std::uint64_t JsonNode::unsigned_integer(std::uint64_t low, std::uint64_t high) const {
  const std::string expectation = high == std::numeric_limits<std::uint64_t>::max()
                                      ? fmt::format("a whole number >= {}", low)
                                      : fmt::format("a whole number from {} to {}", low, high);
  std::uint64_t result = 0;
  if (value_->is_number_unsigned()) {
    result = value_->get<std::uint64_t>();
  } else if (value_->is_number_float()) {
    const Real real = value_->get<Real>();
    if (!(real >= 0 && real < 0x1p63 && real == std::floor(real))) expected(expectation);
    result = static_cast<std::uint64_t>(real);
  } else {
    expected(expectation);
  }
  if (result < low || result > high) expected(expectation);
  return result;
}

std::int64_t JsonNode::integer(std::int64_t low, std::int64_t high) const {
  const std::string expectation = fmt::format("a whole number from {} to {}", low, high);
  if (!value_->is_number()) expected(expectation);
  const Real real = value_->get<Real>();
  if (!(real >= static_cast<Real>(low) && real <= static_cast<Real>(high) && real == std::floor(real))) expected(expectation);
  return static_cast<std::int64_t>(real);
}

void JsonNode::fail(const std::string& message) const { throw InputError(where() + ": " + message); }

void JsonNode::expected(const std::string& expectation) const {
  fail(fmt::format("found {}; expected {}", shown(*value_), expectation));
}

void JsonNode::unknown(const std::string& what, const std::string& name, const std::vector<std::string>& known) const {
  const std::string near = nearest(name, known);
  fail(fmt::format("unknown {} \"{}\"; {}", what, name,
                   near.empty() ? fmt::format("expected one of \"{}\"", fmt::join(known, "\", \""))
                                : fmt::format("did you mean \"{}\"?", near)));
}

}  // namespace nullmark
