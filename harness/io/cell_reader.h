#pragma once

#include <string>
#include <vector>

#include "harness/io/json_input.h"

namespace nullmark {

/// Resolves the cells that tables and claims refer to.  Results refer to them by name, {"cell": name}; a configuration may also
/// use patterns (CellPatterns).
class CellReader {
 public:
  virtual ~CellReader() = default;

  /// The one cell that matches.  Throws InputError if not exactly one does.
  virtual std::string one(const JsonNode& node) const;

  /// All cells that match, in the order of the configuration; for a list of references one after the other.  Throws InputError if
  /// none does.
  virtual std::vector<std::string> all(const JsonNode& node) const;

  /// For each cell that `of` refers to, the cell that `node` pairs with it.  Throws InputError if there is not exactly one.
  virtual std::vector<std::string> counterparts(const JsonNode& of, const JsonNode& node) const;

  /// Whether the named cell gets a verdict; true when reading results.
  virtual bool is_judged(const std::string& name) const;
};

}  // namespace nullmark
