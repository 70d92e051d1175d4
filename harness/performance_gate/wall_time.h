#pragma once

#include <array>
#include <string>
#include <vector>

#include "harness/model/record.h"
#include "harness/performance_gate/performance_gate.h"

namespace nullmark {

/// Whole runs of two programs that took turns, and of the first once more under another name, as the A/A control:
/// old new control control new old.  The mean place in the block is the same for all three, so that a drift of the machine
/// which is linear over a block cancels.
struct TimedBlock {
  std::array<RunRecord, 2> before, after, control;
};

/// Least blocks that are compared.
inline constexpr std::size_t kLeastBlocks = 10;

/// NN.old.1.json, NN.new.1.json, NN.control.1.json and the same with .2 in a folder, as scripts/compare-builds leaves them.
/// Throws InputError where blocks are incomplete or fewer than kLeastBlocks.
std::vector<TimedBlock> read_blocks(const std::string& folder);

/// Tier 4.  Of each block and cell the log ratio of the time per sample, over the floor loop's in the same process; Student's t
/// over the blocks against the threshold (relative; 5 % where left out), Benjamini-Hochberg over cells and directions at a false
/// discovery rate of 5 %, and the 95 % interval must lie beyond the threshold as well.  Where the control is told from itself
/// under the same rules, all findings are `noisy`.  `quiet`: the machine is declared quiet, so that slower cells are regressions.
std::vector<GateRow> compare_wall_time(const std::vector<TimedBlock>& blocks, std::optional<Real> threshold, bool quiet);

}  // namespace nullmark
