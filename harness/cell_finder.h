#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "harness/draft.h"
#include "harness/json_input.h"

namespace nullmark {

/// Cells that tables and claims of a configuration refer to: by a pattern, {"experiment": ..., "estimator": ...}, or by name,
/// {"cell": name}.
class CellFinder {
 public:
  /// Of results, which name cells: names are taken as they are.
  CellFinder() = default;

  /// Of a configuration file: `drafts` are its cells, which in the plan begin at `first`; `experiments` are the file's own names.
  CellFinder(const Plan& plan, std::size_t first, std::span<const Draft> drafts, std::vector<std::string> experiments);

  /// Throws InputError where not exactly one fits.
  std::string one(const Place& place) const;

  /// All that fit, in the order of the configuration; of a list of patterns one after the other.  Throws InputError for none.
  std::vector<std::string> all(const Place& place) const;

  /// For each cell that `of` finds, the one that fits the pattern `place` and agrees with it on all axes that the pattern does
  /// not name (experiments count as one); of several, the one whose estimator differs in no parameter but those named.  Throws
  /// InputError where there is not exactly one.
  std::vector<std::string> counterparts(const Place& of, const Place& place) const;

  /// Whether the cell of a name gets a verdict; true where only results know.
  bool is_judged(const std::string& name) const;

 private:
  [[noreturn]] void matches_none(const Place& place, const char* expected) const;
  std::vector<std::size_t> matching(const Place& place) const;
  std::string named(const Place& place) const;
  std::string described(std::size_t draft) const;
  const std::string& name(std::size_t draft) const { return plan_->cells[first_ + draft].name; }

  const Plan* plan_ = nullptr;
  std::size_t first_ = 0;
  std::span<const Draft> drafts_;
  std::vector<std::string> experiments_;
  std::map<std::string, bool> judged_;  ///< whether the plan's cell of a name has its gate on
};

}  // namespace nullmark
