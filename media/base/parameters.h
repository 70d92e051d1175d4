#pragma once

#include <algorithm>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "media/base/types.h"

namespace nullmark {

/// Closed or half-open range of a numeric parameter; `exclusive` leaves out the lower end.
struct Range {
  Real low = -kInfinity;
  Real high = kInfinity;
  bool exclusive = false;

  static constexpr Range any() { return {}; }
  static constexpr Range positive() { return {0, kInfinity, true}; }
  static constexpr Range non_negative() { return {0, kInfinity, false}; }
  static constexpr Range between(Real low, Real high) { return {low, high, false}; }
  bool contains(Real x) const { return (exclusive ? x > low : x >= low) && x <= high; }
};

/// Thrown by a constructor or a preparation step whose parameters fit the schema but not each other; becomes exit code 2.
/// `where` names the parameter (may be empty), the message says what was found, what was expected and the remedy.
struct ParameterError : std::runtime_error {
  ParameterError(std::string where, const std::string& message) : std::runtime_error(message), parameter(std::move(where)) {}
  std::string parameter;
};

/// What estimators, media, majorants and ray sets tell about their fields: name, default (the field's value), range, unit ("" for
/// none, "1/length", "length") and one line of text.  The configuration reader, the schema writer and `nullmark list` are
/// visitors; what they visit knows nothing of JSON.
class ParameterVisitor {
 public:
  virtual ~ParameterVisitor() = default;
  virtual void number(const char* name, Real& value, Range range, const char* unit, const char* text) = 0;
  virtual void integer(const char* name, int& value, int low, int high, const char* text) = 0;
  virtual void flag(const char* name, bool& value, const char* text) = 0;
  virtual void choice(const char* name, std::string& value, std::initializer_list<const char*> allowed, const char* text) = 0;
  /// The same of an enumeration, whose values are the indices of the words: for what is asked along every leg of a path.
  template <class Enumeration>
  requires std::is_enum_v<Enumeration>
  void choice(const char* name, Enumeration& value, std::initializer_list<const char*> allowed, const char* text) {
    std::string word = allowed.begin()[static_cast<std::size_t>(value)];
    choice(name, word, allowed, text);
    const auto at = std::find(allowed.begin(), allowed.end(), word);
    if (at == allowed.end()) throw ParameterError(name, "\"" + word + "\" is none of its words");
    value = static_cast<Enumeration>(at - allowed.begin());
  }
  virtual void text(const char* name, std::string& value, const char* text) = 0;
  virtual void numbers(const char* name, std::vector<Real>& value, int least, int most, Range range, const char* unit,
                       const char* text) = 0;
  /// Words in order, such as those of a command.
  virtual void texts(const char* name, std::vector<std::string>& value, const char* text) = 0;
  /// A JSON object, as text.
  virtual void object(const char* name, std::string& value, const char* text) = 0;
  virtual void point(const char* name, Vec3& value, const char* unit, const char* text) = 0;
};

}  // namespace nullmark
