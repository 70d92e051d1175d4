#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "harness/model/record.h"
#include "harness/performance_gate/wall_time.h"

namespace nullmark {

/// What can change in a cell from one result to the next.
enum class Change {
  verdict,
  slower,
  faster,
  more_instructions,
  fewer_instructions,
  more_misses,
  fewer_misses,
  more_lookups,
  fewer_lookups,
  more_draws,
  fewer_draws,
  larger_error,
  smaller_error,
  other_walks,    ///< other counts of the same seed, samples and build; none is proven larger
  other_setting,  ///< other rays, medium or parameters under the same name
  came,
  went,
};
const char* to_string(Change change);

struct CellChange {
  std::string cell;
  Change change = Change::verdict;
  std::string before, after;  ///< words or numbers; empty where there is none
  std::string note;           ///< how much, or why
};

/// One of the results, with the verdicts derived again.
struct HistoryResult {
  std::string file;
  std::string date;    ///< of the start: "2026-11-20", with the time where two results share a day
  std::string commit;  ///< seven digits, "changed" behind them if the source was not that of the commit; empty: unknown
  std::string cpu, build;
  bool partial = false;  ///< may lack cells that the configuration has: not selected, of a missing shard, or never started
  RunRecord run;
};

/// What changed in a result, since an earlier one.
struct HistoryStep {
  std::size_t since = 0;                ///< index of the earlier result
  std::size_t cells = 0, compared = 0;  ///< of either side; sampled on both
  std::size_t changed = 0;              ///< cells with a change
  /// Cells that are sampled on both sides, by the numbers of samples a ray before and after, where they differ.
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::size_t> other_samples;
  std::vector<CellChange> changes;    ///< proven
  std::vector<CellChange> undecided;  ///< may be chance
  std::vector<std::string> notes;     ///< what was not compared, and why
  std::string time;                   ///< why times have no verdict, or what the verdict rests on
};

/// Results of one configuration in the order of their dates.
struct History {
  std::vector<HistoryResult> results;
  std::vector<HistoryStep> steps;     ///< one fewer: steps[i] leads to results[i + 1]
  std::vector<std::string> warnings;  ///< of copies that were left out
};

/// Chance that a comparison of two results of the same program shows even one change of an error, at most.  The gate holds the
/// same for lookups, and each run for a false FAIL.
inline constexpr Real kFalseErrorChanges = 1e-4;

/// Judges lookups, draws, instructions and misses as the performance gate does.  The errors of samples are judged by the rank sum
/// of their sixteen parts.  A result is compared with the one before it.  Where that holds a part of the cells, it is compared
/// with the latest that has the most cells in common, back to the first that is no part.  Times are judged by `blocks` alone,
/// which compare the programs of the last step; there are none where it is empty.  Throws InputError where results are of
/// different configurations or do not tell their dates, and where `blocks` hold other programs.
History history_of(std::vector<RunRecord> runs, const std::vector<std::string>& files,
                   const std::vector<TimedBlock>& blocks = {});

/// How many cells changed in each way: "1 verdict, 2 slower".
std::string changes_counted(const HistoryStep& step);

/// Whether no cell could be compared, so that nothing is known of changes.
bool compares_nothing(const HistoryStep& step);

}  // namespace nullmark
