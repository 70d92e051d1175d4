#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/cost.h"

namespace nullmark {

/// Relative errors for which times are computed.
inline constexpr Real kTargets[] = {0.01, 0.001};

/// A cell in a comparison.
struct RankedCell {
  std::size_t run = 0;  ///< index of the results that hold the cell
  const CellRecord* record = nullptr;
  std::string tracker;  ///< with its parameters; results of the same tracker are no rivals
  std::string label;    ///< the tracker, with whatever distinguishes it from others of the scene
  std::optional<Cost> cost;
  std::vector<std::optional<Interval>> seconds;  ///< to each of kTargets
  std::vector<bool> amortised;                   ///< for each of kTargets: see is_amortised
  /// Relative bias that may be there unseen: what a PASS does not exclude, infinite without one, 0 where a floor is measured.
  Real possible_bias = 0;
  /// 1 + number of other trackers proven faster to the first target in all of their results, that is with a 95 % interval of the
  /// ratio of times above 1.  Equal ranks are ties.  Absent if no time is known or the target is out of reach.
  std::optional<std::size_t> rank;
  bool tied = false;                    ///< a cell of another tracker has the same rank
  bool split = false;                   ///< another result of the same tracker has another rank, or never reaches the target
  bool pareto = false;                  ///< no other tracker has less variance and less time per sample in all of its results
  std::optional<Interval> relative;     ///< seconds to the first target divided by those of the baseline, if of another tracker
  std::optional<BreakEven> break_even;  ///< for cells with a floor, against Comparison::best_unbiased
};

/// Ratio of the mean squared errors of one sample of two trackers on the same random streams.  `ratio` has an interval from a
/// jackknife over 16 paired parts, `unpaired` from the same jackknife of each side alone.
struct Pairing {
  std::size_t ranked = 0, against = 0;
  Interval ratio, unpaired;
  std::uint64_t samples = 0;             ///< per ray in the run
  std::optional<Interval> of_the_means;  ///< the ratio at this many samples, if either has a floor and both costs are known
};

/// A cell without a Pairing with the baseline, and the reason.
struct Unpaired {
  std::size_t ranked = 0;
  std::string reason;
};

/// What the figures of some cells do not tell.
struct Remark {
  /// `equal`: the cells gave the same samples, to the last bit.  `lanes`: the cells ran side by side in registers and were timed;
  /// others of the comparison were timed too, and ran one walk at a time.
  enum class Kind { equal, lanes } kind = Kind::equal;
  std::vector<std::size_t> cells;
};

/// Cells that differ only in the tracker (including its precision and seed), sorted by time to the first target.
struct Comparison {
  std::string name, quantity, medium, majorant, rays, light, measurement;
  std::string build;  ///< of cells that another build made than the others of their results: their times are not comparable
  std::vector<RankedCell> cells;             ///< by rank, then by time; those without a rank last
  std::optional<std::size_t> baseline;       ///< the first that stands as unbiased, or the requested one
  std::optional<std::size_t> best_unbiased;  ///< least variance x time among cells that stand as unbiased and have variance
  std::vector<Pairing> pairings;             ///< of all other cells with the baseline, if they have the same streams
  std::vector<Remark> remarks;
  std::vector<Unpaired> unpaired;  ///< other cells with different streams or unknown errors
};

/// Places of the cells that are fastest to the first target, alone or tied: of all, or of those that stand as unbiased.
std::vector<std::size_t> fastest(const Comparison& comparison, bool unbiased);

/// Whether the tracker is proven to have no bias above this relative error, which the times to it take for granted.
bool is_proven_to_reach(const RankedCell& ranked, Real error);

/// Whether the time of a break-even takes for granted that the best unbiased tracker reaches an error that it is not proven to
/// reach.
bool break_even_is_unproven(const Comparison& comparison, const RankedCell& ranked);

/// What is known of the errors that are not proven to be reachable; empty if there are none.
std::string unproven_note(const Comparison& comparison);

/// All comparisons of some results, in the order of their first cells.  `baseline` is a tracker's type or label, or empty. Throws
/// InputError if the results hold no such tracker.
std::vector<Comparison> comparisons(const std::vector<RunRecord>& runs, const std::string& baseline);

}  // namespace nullmark
