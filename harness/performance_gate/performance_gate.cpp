#include "harness/performance_gate/performance_gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <map>

namespace nullmark {
namespace {

constexpr Real kCountsThreshold = 0, kExpectedThreshold = 0.01;
constexpr Real kLeastInstructions = 0.002, kMostInstructions = 0.01;
constexpr Real kMissesThreshold = 0.05, kStartUpThreshold = 0.01;

constexpr const char* kOneSide = "counted on one side only";

/// Relative differences of computed expectations up to here are quadrature and rounding.
constexpr Real kSameTheory = 1e-6;

constexpr const char* kExact = "exact";

Real relative_change(Real before, Real after) {
  if (before == after) return 0;
  return before == 0 ? kInfinity : after / before - 1;
}

Real per_sample(std::uint64_t count, const CellCounts& cell) {
  return static_cast<Real>(count) / static_cast<Real>(cell.samples);
}

/// Where an exactly known change stands to a threshold.
GateResult judged(Real change, Real threshold) {
  if (change > threshold) return GateResult::regression;
  if (change < -threshold) return GateResult::better;
  return change == 0 ? GateResult::same : GateResult::changed;
}

/// Squared relative standard error of a cell's mean lookups; nothing where it cannot be told.
std::optional<Real> relative_error_squared(const CellCounts& cell) {
  if (!cell.lookups_variance || cell.lookups == 0) return std::nullopt;
  if (*cell.lookups_variance > 0 && cell.samples < kLeastSamples) return std::nullopt;
  const Real mean = per_sample(cell.lookups, cell);
  return *cell.lookups_variance / (static_cast<Real>(cell.samples) * mean * mean);
}

/// Compares the cells of one pair of runs.
class Comparison {
 public:
  Comparison(const Counts& before, const Counts& after, std::optional<Real> threshold) : threshold_(threshold) {
    same_build_ = before.build.known() && before.build == after.build;
    // Three intervals a cell at most: lookups, draws, and the mean against its expectation.
    const auto intervals = static_cast<Real>(3 * std::max<std::size_t>(1, after.cells.size()));
    quantile_ = boost::math::quantile(boost::math::complement(boost::math::normal(), kFalseRegressions / intervals));
    level_ = fmt::format("{:g} over all cells", kFalseRegressions);
  }

  void compare(const CellCounts& before, const CellCounts& after) {
    exact_ = same_build_ && before.id == after.id && before.samples == after.samples;
    counts(before, after);
    expected(before, after);
    instructions(before, after);
    misses(before, after);
  }

  /// A start is no cell: its row has a name of its own.
  void compare_start_up(const Counts& before, const Counts& after) {
    CellCounts start;
    start.name = "start-up of a run";
    if (!before.start_up && !after.start_up) return;
    if (!before.start_up || !after.start_up) return add_not_compared(start.name, Tier::start_up, "instructions", kOneSide);
    if (!same_build_ || before.config_hash != after.config_hash)
      return add_not_compared(start.name, Tier::start_up, "instructions", "another build or configuration");
    GateRow one = row(start, Tier::start_up, "instructions", static_cast<Real>(*before.start_up),
                      static_cast<Real>(*after.start_up), kStartUpThreshold);
    if (one.finding == GateResult::changed) one.finding = GateResult::same;
    rows.push_back(std::move(one));
  }

  void add_not_compared(const std::string& cell, Tier tier, const std::string& metric, const std::string& note) {
    rows.push_back({cell, tier, metric, GateResult::not_compared, {}, {}, {}, {}, {}, 0, "", note});
  }

  std::vector<GateRow> rows;

 private:
  GateRow row(const CellCounts& cell, Tier tier, const char* metric, Real before, Real after, Real own_threshold) const {
    const Real change = relative_change(before, after), threshold = threshold_.value_or(own_threshold);
    return {cell.name, tier, metric, judged(change, threshold), before, after, change, change, change, threshold, kExact, ""};
  }

  /// Gives a row the interval of its change and judges it by that.
  void widen(GateRow& row, Real error_squared) const {
    if (!std::isfinite(*row.change)) return;
    // Of a ratio, on the logarithm: symmetric there, and never below -1.
    const Real half = quantile_ * std::sqrt(error_squared), middle = std::log1p(*row.change);
    if (half == 0) return;
    row.low = std::expm1(middle - half);
    row.high = std::expm1(middle + half);
    row.confidence = level_;
    row.finding = *row.low > row.threshold                                   ? GateResult::regression
                  : *row.high < -row.threshold                               ? GateResult::better
                  : *row.low >= -row.threshold && *row.high <= row.threshold ? GateResult::same
                                                                             : GateResult::undecided;
  }

  void counts(const CellCounts& before, const CellCounts& after) {
    if (!exact_) {
      add_not_compared(after.name, Tier::counts, "counts",
                       same_build_ ? "other seed, samples or settings" : "another build, or one that does not say what it is");
      return;
    }
    const std::size_t first = rows.size();
    const bool same_walks = before.lookups == after.lookups;
    const auto add = [&](const char* metric, std::uint64_t CellCounts::*count) {
      if (before.*count == after.*count) return;
      GateRow one =
          row(after, Tier::counts, metric, per_sample(before.*count, before), per_sample(after.*count, after), kCountsThreshold);
      if (!same_walks) {
        // Other walks are other samples: only what chance cannot do is a regression.  Draws go along with lookups.
        const auto error = relative_error_squared(before), other = relative_error_squared(after);
        if (error && other)
          widen(one, *error + *other);
        else
          one.finding = GateResult::undecided;
        if (one.finding == GateResult::undecided || one.finding == GateResult::same) one.finding = GateResult::changed;
      }
      rows.push_back(std::move(one));
    };
    add("lookups", &CellCounts::lookups);
    add("draws", &CellCounts::draws);
    const auto tell = [&](const char* metric, std::uint64_t CellCounts::*count) {
      if (before.*count == after.*count) return;
      rows.push_back(row(after, Tier::counts, metric, per_sample(before.*count, before), per_sample(after.*count, after), 0));
      rows.back().finding = GateResult::changed;
    };
    tell("null collisions", &CellCounts::null_collisions);
    tell("majorant violations", &CellCounts::majorant_violations);
    if (rows.size() == first)
      rows.push_back(
          row(after, Tier::counts, "lookups", per_sample(before.lookups, before), per_sample(after.lookups, after), 0));
  }

  void expected(const CellCounts& before, const CellCounts& after) {
    if (before.setting != after.setting) {
      add_not_compared(after.name, Tier::expected, "expected lookups", "other rays, medium or parameters under the same name");
      return;
    }
    if (before.lookups_theory && after.lookups_theory) {
      GateRow one =
          row(after, Tier::expected, "expected lookups", *before.lookups_theory, *after.lookups_theory, kExpectedThreshold);
      if (std::abs(*one.change) <= kSameTheory) one.finding = GateResult::same;
      rows.push_back(std::move(one));
    }
    if (exact_ && before.lookups == after.lookups) return;
    measured(before, after);
  }

  /// The mean that was measured now, against what it was expected to be then: by theory, where that was right then, else as
  /// measured then.
  void measured(const CellCounts& before, const CellCounts& after) {
    const Real mean_before = per_sample(before.lookups, before), mean_after = per_sample(after.lookups, after);
    const auto error_before = relative_error_squared(before), error_after = relative_error_squared(after);
    if (before.lookups == 0 || after.lookups == 0) {
      rows.push_back(row(after, Tier::expected, "mean lookups", mean_before, mean_after, kExpectedThreshold));
      return;
    }
    if (!error_before || !error_after) {
      add_not_compared(after.name, Tier::expected, "mean lookups",
                       fmt::format("no variance recorded, or fewer than {} samples", kLeastSamples));
      return;
    }
    const bool theory_held =
        before.lookups_theory && std::abs(mean_before - *before.lookups_theory) <=
                                     quantile_ * std::sqrt(*error_before) * mean_before + kSameTheory * *before.lookups_theory;
    GateRow one = row(after, Tier::expected, "mean lookups", theory_held ? *before.lookups_theory : mean_before, mean_after,
                      kExpectedThreshold);
    widen(one, *error_after + (theory_held ? 0 : *error_before));
    one.note = theory_held ? "against theory" : "";
    rows.push_back(std::move(one));
  }

  void instructions(const CellCounts& before, const CellCounts& after) {
    if (!before.instructions || !after.instructions) {
      if (before.instructions || after.instructions) add_not_compared(after.name, Tier::instructions, "instructions", kOneSide);
      return;
    }
    if (!exact_) {
      add_not_compared(after.name, Tier::instructions, "instructions", "another build, seed or number of samples");
      return;
    }
    GateRow one = row(after, Tier::instructions, "instructions", per_sample(*before.instructions, before),
                      per_sample(*after.instructions, after), instruction_threshold(before.instruction_history));
    if (one.finding == GateResult::changed) one.finding = GateResult::same;
    rows.push_back(std::move(one));
  }

  void misses(const CellCounts& before, const CellCounts& after) {
    constexpr const char* metric = "last-level misses";
    if (!before.misses && !after.misses) return;
    if (!before.misses || !after.misses) return add_not_compared(after.name, Tier::misses, metric, kOneSide);
    if (!exact_) return add_not_compared(after.name, Tier::misses, metric, "another build, seed or number of samples");
    const Real then = per_sample(*before.misses, before), now = per_sample(*after.misses, after);
    GateRow one = row(after, Tier::misses, metric, then, now, kMissesThreshold);
    // Addresses move a few misses about; where a sample has next to none, that is no change.
    if (one.finding == GateResult::changed || std::abs(now - then) < kLeastMisses) one.finding = GateResult::same;
    rows.push_back(std::move(one));
  }

  std::optional<Real> threshold_;
  bool same_build_ = false, exact_ = false;
  Real quantile_ = 0;
  std::string level_;
};

/// Linear between order statistics.
Real quantile_of(const std::vector<Real>& sorted, Real p) {
  const Real at = p * static_cast<Real>(sorted.size() - 1);
  const auto low = static_cast<std::size_t>(at);
  const Real next = sorted[std::min(low + 1, sorted.size() - 1)];
  return sorted[low] + (at - static_cast<Real>(low)) * (next - sorted[low]);
}

}  // namespace

std::string BuildKey::text() const {
  if (!known()) return "a build that its results do not tell";
  return fmt::format("{}, {} ({}{}), {}, {}", compiler, march, simd, cpu.empty() ? "" : ", " + cpu, libc, flags);
}

std::size_t PerformanceReport::count(Tier tier, GateResult finding) const {
  return static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [&](const GateRow& row) { return row.tier == tier && row.finding == finding; }));
}

std::size_t PerformanceReport::count(GateResult finding) const {
  return static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [&](const GateRow& row) { return row.finding == finding; }));
}

ExitCode PerformanceReport::exit() const {
  if (count(GateResult::regression) > 0) return ExitCode::regression;
  return !missing.empty() || count(GateResult::not_compared) == rows.size() ? ExitCode::nothing_ran : ExitCode::ok;
}

bool PerformanceReport::compared(Tier tier) const {
  return std::any_of(rows.begin(), rows.end(),
                     [&](const GateRow& row) { return row.tier == tier && row.finding != GateResult::not_compared; });
}

Real instruction_threshold(std::vector<Real> history) {
  if (history.size() < 4) return kLeastInstructions;
  std::sort(history.begin(), history.end());
  const Real low = quantile_of(history, 0.25), high = quantile_of(history, 0.75);
  return std::clamp(high + 3 * (high - low), kLeastInstructions, kMostInstructions);
}

PerformanceReport compare_counts(const Counts& before, const Counts& after, std::optional<Real> threshold) {
  PerformanceReport report;
  report.name = after.name;
  report.before = before.source;
  report.after = after.source;
  if (!(before.build == after.build))
    report.notes.push_back(fmt::format("{} is of {}; {} is of {}: exact counts and instructions are not compared", before.source,
                                       before.build.text(), after.source, after.build.text()));
  std::map<std::string, const CellCounts*> earlier;
  for (const CellCounts& cell : before.cells) earlier.emplace(cell.name, &cell);
  Comparison comparison(before, after, threshold);
  for (const CellCounts& cell : after.cells) {
    const auto at = earlier.find(cell.name);
    if (at == earlier.end()) {
      comparison.add_not_compared(cell.name, Tier::counts, "counts", "only on the new side; cells are matched by name");
      continue;
    }
    comparison.compare(*at->second, cell);
    earlier.erase(at);
  }
  for (const CellCounts& cell : before.cells)
    if (earlier.count(cell.name) > 0)
      comparison.add_not_compared(cell.name, Tier::counts, "counts", "only on the old side; cells are matched by name");
  comparison.compare_start_up(before, after);
  report.rows = std::move(comparison.rows);
  return report;
}

const char* to_string(Tier tier) {
  switch (tier) {
    case Tier::counts:
      return "exact counts";
    case Tier::expected:
      return "expected counts";
    case Tier::instructions:
      return "instructions";
    case Tier::wall_time:
      return "wall time";
    case Tier::misses:
      return "cache misses";
    case Tier::start_up:
      break;
  }
  return "start-up";
}

const char* to_string(GateResult finding) {
  switch (finding) {
    case GateResult::same:
      return "same";
    case GateResult::changed:
      return "changed";
    case GateResult::better:
      return "better";
    case GateResult::undecided:
      return "undecided";
    case GateResult::regression:
      return "REGRESSION";
    case GateResult::slower:
      return "slower (advisory)";
    case GateResult::noisy:
      return "noisy";
    case GateResult::not_compared:
      break;
  }
  return "not compared";
}

}  // namespace nullmark
