#pragma once

#include <map>
#include <optional>
#include <string>

#include "harness/io/json_input.h"
#include "harness/model/plan.h"

namespace nullmark {

/// Texts of a plan's cells in a configuration: canonical, one line each.  Cells share most of their parts, and a shared part
/// becomes text once.
class CellTexts {
 public:
  explicit CellTexts(const Plan& plan) : plan_(plan) {}

  /// Hash of everything that determines a cell's statistics, as 16 hexadecimal digits.
  std::string id(const Cell& cell);

  /// The cell with all its keys.
  std::string applied(const Cell& cell);

 private:
  /// The text of a value, made again where the value differs from that of the cell before.
  template <class Value>
  class Latest {
   public:
    const std::string& text(const Value& value, auto&& to_json) {
      if (!value_ || !(*value_ == value)) {
        text_ = to_json(value).dump();
        value_ = value;
      }
      return text_;
    }

   private:
    std::optional<Value> value_;
    std::string text_;
  };

  template <class Part>
  const std::string& shared(const Part& part, Json (*to_json)(const Part&));
  const std::string& component(const Component& part);
  /// The keys that decide the statistics, without the closing brace.
  std::string deciding(const Cell& cell, const std::string& medium);

  const Plan& plan_;
  std::map<const void*, std::string> shared_;  // by address: the plan keeps its parts
  Latest<Measurement> measurement_;
  Latest<TransportSpec> transport_;
  Latest<VerdictSpec> verdict_;
  Latest<GivenReference> reference_;
};

}  // namespace nullmark
