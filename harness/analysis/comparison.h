#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/cost.h"

namespace nullmark {

/// Relative errors that times are told for.
inline constexpr Real kTargets[] = {0.01, 0.001};

/// A cell among those it is compared with.
struct RankedCell {
  std::size_t run = 0;  ///< of the results, and the cell's place in them
  const CellRecord* record = nullptr;
  std::string label;  ///< the tracker, with what else tells it from others of the scene
  std::optional<Cost> cost;
  std::vector<std::optional<Interval>> seconds;  ///< to each of kTargets
  std::vector<bool> amortised;                   ///< the same: see is_amortised
  /// 1 + those proven faster to the first target: the 95 % interval of the ratio of times lies above 1.  Equal ranks are ties.
  /// Absent where no time is known or the target is out of reach.
  std::optional<std::size_t> rank;
  bool tied = false;                    ///< another one has the same rank
  bool pareto = false;                  ///< none has less variance and less time a sample
  std::optional<Interval> relative;     ///< seconds to the first target over those of the baseline
  std::optional<BreakEven> break_even;  ///< of those with a floor, against Scene::best_unbiased
};

/// Mean squared errors of one sample of two trackers on the same random streams: the ratio's interval by a jackknife over the 16
/// parts that go together, and by the same jackknife of either side alone.
struct Pairing {
  std::size_t ranked = 0, against = 0;
  Interval ratio, unpaired;
  std::uint64_t samples = 0;             ///< of a ray in the run
  std::optional<Interval> of_the_means;  ///< the ratio at so many samples, where either has a floor and both costs are known
};

/// A ranked that has no Pairing with the baseline, and why.
struct Unpaired {
  std::size_t ranked = 0;
  std::string reason;
};

/// Cells that differ in nothing but the tracker (its precision and seed included), by time to the first target.
struct Comparison {
  std::string name, quantity, medium, majorant, rays, light, measurement;
  std::vector<RankedCell> cells;             ///< by rank, then by time; those without a rank last
  std::optional<std::size_t> baseline;       ///< the first that is unbiased, or the one asked for
  std::optional<std::size_t> best_unbiased;  ///< least variance x time among those that claim to be unbiased and vary
  std::vector<Pairing> pairings;             ///< of all others with the baseline, where their streams are the same
  std::vector<Unpaired> unpaired;            ///< those others whose streams are not, or whose errors are not known
};

/// All comparisons of some results, in the order of their first cells.  `baseline` is a tracker's type or label, or empty. Throws
/// InputError when it names none of the results.
std::vector<Comparison> comparisons(const std::vector<RunRecord>& runs, const std::string& baseline);

}  // namespace nullmark
