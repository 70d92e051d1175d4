#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "harness/config/experiment.h"
#include "harness/io/cell_reader.h"

namespace nullmark {

/// Cells that tables and claims of a configuration refer to: by a pattern, {"experiment": ..., "estimator": ...}, or by name,
/// {"cell": name}.
class CellPatterns : public CellReader {
 public:
  /// `cells` are the cells of one configuration file; in the plan they begin at `first`.  `experiments` are the file's own names.
  CellPatterns(const Plan& plan, std::size_t first, std::span<const ConfiguredCell> cells, std::vector<std::string> experiments);

  std::string one(const JsonNode& node) const override;

  std::vector<std::string> all(const JsonNode& node) const override;

  /// For each cell that `of` finds: the cell that matches the pattern `node` and agrees with it on all axes that the pattern does
  /// not name (the experiment counts as an axis).  Of several, the one whose estimator differs only in named parameters.  Throws
  /// InputError if there is not exactly one.
  std::vector<std::string> counterparts(const JsonNode& of, const JsonNode& node) const override;

  bool is_judged(const std::string& name) const override;

 private:
  [[noreturn]] void matches_none(const JsonNode& node, const char* expected) const;
  std::vector<std::size_t> matching(const JsonNode& node) const;
  std::string named(const JsonNode& node) const;
  std::string described(std::size_t configured) const;
  const std::string& name(std::size_t configured) const { return plan_->cells[first_ + configured].name; }

  const Plan* plan_;
  std::size_t first_;
  std::span<const ConfiguredCell> cells_;
  std::vector<std::string> experiments_;
  std::map<std::string, bool> judged_;  ///< by cell name: whether it gets a verdict
};

}  // namespace nullmark
