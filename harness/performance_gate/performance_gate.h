#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/exit_code.h"
#include "media/base/types.h"

namespace nullmark {

/// What decides a program's exact counts beside its source and its configuration.  Counts of equal builds can be compared
/// exactly.
struct BuildKey {
  std::string compiler;           ///< name and major version: "gcc 12"
  std::string flags;              ///< of the compiler
  std::string march, simd, libc;  ///< "x86-64-v3", "AVX2", "glibc 2.36"
  std::string cpu;                ///< model, where `march` is "native" and so says nothing; else empty

  bool operator==(const BuildKey&) const = default;
  /// Results of old programs do not say all of it; such builds equal nothing.
  bool known() const { return !compiler.empty() && !march.empty() && !simd.empty() && !libc.empty(); }
  std::string text() const;
};

/// What one cell cost, in events.
struct CellCounts {
  std::string name, id;
  std::string setting;  ///< hash of the cell without its seed and samples: equal settings have equal expected counts
  std::uint64_t samples = 0, lookups = 0, draws = 0, null_collisions = 0, majorant_violations = 0;
  std::optional<Real> lookups_variance, lookups_theory;  ///< of one sample
  std::optional<std::uint64_t> instructions;             ///< of all samples
  std::optional<std::uint64_t> misses;                   ///< of all samples: data that a simulated last-level cache does not hold
  /// |relative change| of the instructions whenever a baseline was refreshed without a change of the code beyond its threshold.
  std::vector<Real> instruction_history;
};

/// What a run, or a baseline, says of its cells.
struct Counts {
  std::string source;       ///< file, as messages call it
  std::string name;         ///< of the configuration
  std::string config_hash;  ///< of the configuration without its seed
  BuildKey build;
  bool baseline = false;                  ///< a baseline, not results
  bool partial = false;                   ///< a selection of cells was asked for, so that the others are not missed
  std::optional<std::uint64_t> start_up;  ///< instructions of a run that has no cell to draw
  std::vector<CellCounts> cells;
};

/// See performance_gate.md for what each tier proves.
enum class Tier { counts = 1, expected = 2, instructions = 3, wall_time = 4, misses = 5, start_up = 6 };

inline constexpr Tier kTiers[] = {Tier::counts,    Tier::expected, Tier::instructions,
                                  Tier::wall_time, Tier::misses,   Tier::start_up};

enum class GateResult {
  same,          ///< equal counts, or no difference beyond the threshold, which is proven
  changed,       ///< other counts than exactly those; no regression beyond the threshold is proven
  better,        ///< an improvement beyond the threshold is proven
  undecided,     ///< the interval reaches beyond the threshold, but not all of it
  regression,    ///< more than the threshold is proven
  slower,        ///< the same of wall time where that is advisory
  noisy,         ///< wall time, but the machine tells a program from itself
  not_compared,  ///< one side is missing, or the sides are no measurements of the same thing
};

/// One comparison of one cell.  Changes are relative: after / before - 1.
struct GateRow {
  std::string cell;
  Tier tier = Tier::counts;
  std::string metric;  ///< what was compared, per sample
  GateResult finding = GateResult::same;
  std::optional<Real> before, after;
  std::optional<Real> change, low, high;  ///< low to high: interval of the change; low = high where it is exact
  Real threshold = 0;
  std::string confidence;  ///< "exact", or the level of the interval
  std::string note;
};

struct PerformanceReport {
  std::string name, before, after;  ///< configuration and the two sides, as messages call them
  std::vector<GateRow> rows;
  std::vector<std::string> notes;
  std::vector<std::string> missing;  ///< what had to be compared and could not be, one sentence each

  std::size_t count(Tier tier, GateResult finding) const;
  std::size_t count(GateResult finding) const;
  bool compared(Tier tier) const;
  /// 4 where a regression is proven, else 5 where something is missing or nothing could be compared, else 0.
  ExitCode exit() const;
};

/// Chance of even one false regression among all intervals of one comparison of counts, at most.
inline constexpr Real kFalseRegressions = 1e-4;

/// Least samples of a cell for intervals of its mean lookups: below, the normal law of means is not relied upon.
inline constexpr std::uint64_t kLeastSamples = 1000;

/// Change that a cell's instruction counts must exceed: Q3 + 3 IQR of the changes in its history, not below .2 % and, so that no
/// history can hide a regression of 1 %, not above that.  Fewer than four changes have no quartiles.
Real instruction_threshold(std::vector<Real> history);

/// Least change of the misses of a sample that is told at all: fewer cost less than a few nanoseconds.
inline constexpr Real kLeastMisses = 0.05;

/// All tiers but wall time, cell by cell; cells are the same where their names are.  `threshold` (relative) takes the place of
/// the tiers' own: 0, 1 %, `instruction_threshold`, 5 % of misses and 1 % of a start.
PerformanceReport compare_counts(const Counts& before, const Counts& after, std::optional<Real> threshold = {});

const char* to_string(Tier tier);
const char* to_string(GateResult finding);

}  // namespace nullmark
