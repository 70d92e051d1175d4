#pragma once

#include <algorithm>
#include <concepts>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/io/json_input.h"
#include "harness/model/names.h"

/// How a member of a struct looks in JSON: `json()`, its inverse `read(node)`, its JSON Schema `schema()`, and `empty()` where a
/// member may be left out.  A number, flag, text, enumeration, or an optional or list of such is a `PlainField`; the others have
/// a range, or words.
namespace nullmark {

/// The names of an enumeration, in its order, and what an error calls a name.
struct EnumWords {
  const std::vector<std::string>& names;
  const char* what;
};
inline EnumWords words_of(Quantity) { return {quantity_names(), "quantity"}; }
inline EnumWords words_of(Precision) { return {precision_names(), "precision"}; }
inline EnumWords words_of(Status) { return {status_names(), "status"}; }
inline EnumWords words_of(LawPolicy) { return {law_policies(), "policy"}; }
inline EnumWords words_of(Tolerate) { return {tolerances(), "bias to tolerate"}; }
inline EnumWords words_of(TestBasis) { return {test_bases(), "basis"}; }
inline EnumWords words_of(Outcome) { return {outcome_names(), "verdict"}; }

inline Json described(Json json, const std::string& text) {
  if (!text.empty()) json["description"] = text;
  return json;
}

inline Json whole_schema(std::uint64_t low) { return {{"type", "integer"}, {"minimum", low}}; }
inline Json positive_schema() { return {{"type", "number"}, {"exclusiveMinimum", 0}}; }
inline Json list_schema(Json item) { return {{"type", "array"}, {"items", std::move(item)}}; }
inline Json one_or_list_schema(const Json& item) {
  Json list = list_schema(item);
  list["minItems"] = 1;
  return {{"anyOf", {item, std::move(list)}}};
}

/// A member as it is.  Numbers that are not finite, optionals without value and Outcome::none are null.
template <class T>
class PlainField {
 public:
  explicit PlainField(T& value) : value_(value) {}

  bool empty() const { return value_ == T{}; }

  Json json() const {
    if constexpr (std::same_as<T, Outcome>) {
      return value_ == Outcome::none ? Json(nullptr) : Json(to_string(value_));
    } else if constexpr (std::is_enum_v<T>) {
      return words_of(value_).names[static_cast<std::size_t>(value_)];
    } else if constexpr (std::same_as<T, Real> || std::same_as<T, std::optional<Real>>) {
      return number_or_null(value_);
    } else if constexpr (std::same_as<T, std::vector<Real>>) {
      Json list = Json::array();
      for (const Real x : value_) list.push_back(number_or_null(x));
      return list;
    } else if constexpr (std::same_as<T, std::optional<std::uint64_t>>) {
      return value_ ? Json(*value_) : Json(nullptr);
    } else {
      return value_;
    }
  }

  void read(const JsonNode& node) const {
    constexpr Real kNotANumber = std::numeric_limits<Real>::quiet_NaN();
    const bool null = node.json().is_null();
    if constexpr (std::same_as<T, bool>) {
      value_ = node.boolean();
    } else if constexpr (std::same_as<T, std::uint64_t>) {
      value_ = node.unsigned_integer(0);
    } else if constexpr (std::same_as<T, int>) {
      value_ = static_cast<int>(node.integer(0, std::numeric_limits<int>::max()));
    } else if constexpr (std::same_as<T, Real>) {
      value_ = null ? kNotANumber : node.number();
    } else if constexpr (std::same_as<T, std::optional<Real>>) {
      value_ = null ? std::nullopt : std::optional(node.number());
    } else if constexpr (std::same_as<T, std::optional<std::uint64_t>>) {
      value_ = null ? std::nullopt : std::optional(node.unsigned_integer(0));
    } else if constexpr (std::same_as<T, std::string>) {
      value_ = null ? "" : node.string();
    } else if constexpr (std::is_enum_v<T>) {
      const auto [names, what] = words_of(value_);
      if (std::same_as<T, Outcome> && null)
        value_ = T{};
      else
        value_ = static_cast<T>(std::find(names.begin(), names.end(), node.one_of(names, what)) - names.begin());
    } else if constexpr (std::same_as<T, std::vector<Real>>) {
      value_.clear();
      for (const JsonNode& element : node.elements()) value_.push_back(element.json().is_null() ? kNotANumber : element.number());
    } else if constexpr (std::same_as<T, std::vector<std::string>>) {
      value_.clear();
      for (const JsonNode& element : node.elements()) value_.push_back(element.string());
    } else {
      static_assert(std::same_as<T, std::map<std::string, std::string>>, "a field of its own is needed for this type");
      node.expect_object();
      for (const auto& [key, json] : node.json().items()) value_[key] = node[key].string();
    }
  }

  Json schema() const {
    if constexpr (std::same_as<T, bool>) return {{"type", "boolean"}};
    if constexpr (std::same_as<T, std::uint64_t> || std::same_as<T, int>) return whole_schema(0);
    if constexpr (std::same_as<T, std::string>) return {{"type", "string"}};
    if constexpr (std::same_as<T, Outcome>) return {{"enum", {nullptr, "PASS", "FAIL", "INCONCLUSIVE", "VIOLATED"}}};
    if constexpr (std::is_enum_v<T>) return {{"enum", words_of(value_).names}};
    if constexpr (std::same_as<T, std::vector<Real>>) return list_schema({{"type", {"number", "null"}}});
    if constexpr (std::same_as<T, std::vector<std::string>>) return list_schema({{"type", "string"}});
    if constexpr (std::same_as<T, std::map<std::string, std::string>>)
      return {{"type", "object"}, {"additionalProperties", {{"type", "string"}}}};
    if constexpr (std::same_as<T, std::optional<std::uint64_t>>) return {{"type", {"integer", "null"}}, {"minimum", 0}};
    return {{"type", {"number", "null"}}};
  }

 private:
  T& value_;
};

template <class T>
concept FieldLike = requires(const T& field) {
  field.schema();
};

template <class T>
auto as_field(T& member) {
  if constexpr (FieldLike<T>)
    return member;
  else
    return PlainField<T>(member);
}

/// A whole number from `low` to `high`.
template <class T>
struct WithinField {
  T& value;
  std::int64_t low, high;

  bool empty() const { return value == T{}; }
  Json json() const { return value; }
  void read(const JsonNode& node) const {
    if constexpr (std::same_as<T, std::uint64_t>)
      value = node.unsigned_integer(static_cast<std::uint64_t>(low), static_cast<std::uint64_t>(high));
    else
      value = static_cast<T>(node.integer(low, high));
  }
  Json schema() const { return {{"type", "integer"}, {"minimum", low}, {"maximum", high}}; }
};
template <class T>
WithinField(T&, std::int64_t, std::int64_t) -> WithinField<T>;

/// A whole number of at least `low`.
struct AtLeastField {
  std::uint64_t& value;
  std::uint64_t low;

  Json json() const { return value; }
  void read(const JsonNode& node) const { value = node.unsigned_integer(low); }
  Json schema() const { return whole_schema(low); }
};

/// A finite number above 0, or nothing where the member is an optional.
template <class T>
struct PositiveField {
  T& value;

  bool empty() const { return value == T{}; }
  Json json() const { return number_or_null(value); }
  void read(const JsonNode& node) const { value = node.positive(); }
  Json schema() const { return positive_schema(); }
};
template <class T>
PositiveField(T&) -> PositiveField<T>;

/// A number above 0 and below 1, or nothing where the member is an optional.
template <class T>
struct LevelField {
  T& value;

  bool empty() const { return value == T{}; }
  Json json() const { return number_or_null(value); }
  void read(const JsonNode& node) const {
    const Real number = node.number();
    if (!(number > 0 && number < 1)) node.expected("a number above 0 and below 1");
    value = number;
  }
  Json schema() const { return {{"type", "number"}, {"exclusiveMinimum", 0}, {"exclusiveMaximum", 1}}; }
};
template <class T>
LevelField(T&) -> LevelField<T>;

/// One of a list of words.
struct WordField {
  std::string& value;
  const std::vector<std::string>& words;
  const char* what;

  Json json() const { return value; }
  void read(const JsonNode& node) const { value = node.one_of(words, what); }
  Json schema() const { return {{"enum", words}}; }
};

/// A flag that is written as one of two words, the first for false.
struct FlagWordField {
  bool& value;
  const std::vector<std::string>& words;
  const char* what;

  bool empty() const { return !value; }
  Json json() const { return words[value]; }
  void read(const JsonNode& node) const { value = node.one_of(words, what) == words[1]; }
  Json schema() const { return {{"enum", words}}; }
};

/// A number for which null stands for a value that is not finite.
struct NullMeansField {
  Real& value;
  Real instead;

  bool empty() const { return value == instead; }
  Json json() const { return number_or_null(value); }
  void read(const JsonNode& node) const { value = node.json().is_null() ? instead : node.number(); }
  Json schema() const { return {{"type", {"number", "null"}}}; }
};

}  // namespace nullmark
