#pragma once

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "media/base/types.h"

// json_input.cpp holds the members of this class, or every file that uses JSON would compile its parser and its printer anew.
extern template class nlohmann::basic_json<nlohmann::ordered_map>;

namespace nullmark {

/// Keeps the order of keys.
using Json = nlohmann::ordered_json;

/// Input from the user cannot be used: configuration, results file, journal, output path.  One line; exit code 2.
struct InputError : std::runtime_error {
  explicit InputError(const std::string& message);
};

/// Strict JSON.  Throws InputError "file:line:column: ..." for syntax errors and for keys that occur twice.
Json parse_json(const std::string& text, const std::string& file);

/// JSON has no infinities and no NaN: null instead.
Json number_or_null(Real x);
Json number_or_null(const std::optional<Real>& x);

/// Parses JSON that the program wrote itself; `is_discarded()` if it is not JSON.
Json known_json(const std::string& text);

/// The candidate with the fewest edits from a misspelt word; empty if none is near.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// A value in a JSON document and its location.  Its getters throw InputError with file and JSON pointer if the value has another
/// type or range.
class JsonNode {
 public:
  JsonNode(const Json& value, std::string file, std::string pointer = "")
      : value_(&value), file_(std::move(file)), pointer_(std::move(pointer)) {}

  const Json& json() const { return *value_; }
  const std::string& file() const { return file_; }
  std::string pointer() const { return pointer_.empty() ? "/" : pointer_; }
  /// "file: /pointer", the location in error messages.
  std::string where() const { return file_ + ": " + pointer(); }

  bool has(const char* key) const { return value_->contains(key); }
  JsonNode operator[](const std::string& key) const;
  JsonNode operator[](std::size_t index) const;
  /// The elements of a list.
  std::vector<JsonNode> elements() const;
  /// The elements of a list, or the value itself if it is not a list.
  std::vector<JsonNode> elements_or_self() const;

  void expect_object() const;
  /// Refuses every key that is not allowed and does not begin with "x-".
  void expect_keys(const std::vector<std::string>& allowed) const;

  bool boolean() const;
  std::string string() const;
  /// A string from a list of names; errors call it `what`: "unknown quantity".
  std::string one_of(const std::vector<std::string>& names, const char* what) const;
  Real number() const;
  /// A finite number above 0.
  Real positive() const;
  /// A whole number; 1e3 counts as one.
  std::uint64_t unsigned_integer(std::uint64_t low, std::uint64_t high = std::numeric_limits<std::uint64_t>::max()) const;
  std::int64_t integer(std::int64_t low, std::int64_t high) const;

  /// "file: /pointer: message"
  [[noreturn]] void fail(const std::string& message) const;
  /// "file: /pointer: found ...; expected ..."
  [[noreturn]] void expected(const std::string& expectation) const;
  /// "file: /pointer: unknown <what> "name"; did you mean "..."?"
  [[noreturn]] void unknown(const std::string& what, const std::string& name, const std::vector<std::string>& known) const;

 private:
  const Json* value_;
  std::string file_, pointer_;
};

}  // namespace nullmark
