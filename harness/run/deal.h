#pragma once

#include <cstddef>
#include <vector>

#include "harness/run/run.h"

namespace nullmark {

/// The work of a configuration, dealt to shards.
struct Deal {
  /// By cell of the plan and part of it: the shard.  One part: the cell is whole; none: the cell is not wanted.
  std::vector<std::vector<std::size_t>> shard_of;
  std::vector<double> loads;  ///< by shard, forecast cost; the unit is about a nanosecond

  std::vector<bool> cells_of(std::size_t shard) const;
  /// By cell of the plan, what the shard draws of it.
  std::vector<CellShare> shares_of(std::size_t shard) const;
  std::size_t split_cells() const;
};

/// Deals the wanted cells of a plan by what they are forecast to cost.  A cell that is more than a small part of a shard's load
/// is split into parts.  The forecast counts samples, lookups and points of theory and reads no clock, so all shards deal alike.
/// Throws ParameterError for specifications that do not fit their media.
Deal deal(const Plan& plan, const std::vector<bool>& wanted, std::size_t shards);

/// What one cell is forecast to cost.
struct CellCost {
  double spread = 0;         ///< samples that parts share
  double each = 0;           ///< what every part does: pilot and theory that its tests need
  double once = 0;           ///< what the first part does
  std::size_t portions = 1;  ///< at most so many parts
};

/// Deals cells of known costs, by cell of the plan; cells without any cost are not wanted.
Deal deal_costs(const std::vector<std::optional<CellCost>>& costs, std::size_t shards);

}  // namespace nullmark
