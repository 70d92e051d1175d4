#pragma once

#include <string>
#include <vector>

#include "harness/io/json_input.h"

namespace nullmark {

/// Cells that tables and claims refer to.  Results name them, {"cell": name}, and names are taken as they are; a configuration
/// may give patterns instead (CellPatterns).
class CellReader {
 public:
  virtual ~CellReader() = default;

  /// Throws InputError where not exactly one fits.
  virtual std::string one(const JsonNode& node) const;

  /// All that fit, in the order of the configuration; of a list of references one after the other.  Throws InputError for none.
  virtual std::vector<std::string> all(const JsonNode& node) const;

  /// For each cell that `of` refers to, the one that `node` pairs with it.  Throws InputError where there is not exactly one.
  virtual std::vector<std::string> counterparts(const JsonNode& of, const JsonNode& node) const;

  /// Whether the cell of a name gets a verdict; true where only results know.
  virtual bool is_judged(const std::string& name) const;
};

}  // namespace nullmark
