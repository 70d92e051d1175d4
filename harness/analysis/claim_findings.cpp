#include "harness/analysis/claim_findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

#include "harness/analysis/scaling.h"
#include "harness/analysis/table_values.h"
#include "harness/model/cost.h"
#include "harness/model/metrics.h"
#include "harness/verdict/cell_word.h"

namespace nullmark {
namespace {

constexpr Real kLargestRelativeError = 0.25;

Interval scaled(const Interval& b, Real factor) {
  const auto [low, high] = std::minmax({factor * b.low, factor * b.high});
  return {factor * b.value, low, high};
}

/// Compares over the cells of one run.
class Comparer {
 public:
  Comparer(const RunRecord& run, Real deviations) : cells_(cells_by_name(run)), deviations_(deviations) {}

  PartFinding operator()(const ClaimPart& part) const {
    PartFinding result;
    result.part = &part;
    if (part.slope_against.empty())
      for (std::size_t i = 0; i < part.cells.size(); ++i) result.compared.push_back(compare_cell(part, i));
    else
      result.compared.push_back(compare_slope(part));
    result.outcome = joint(result.compared);
    return result;
  }

  template <class Items>
  static ClaimOutcome joint(const Items& items) {
    const auto is = [](ClaimOutcome word) { return [word](const auto& item) { return item.outcome == word; }; };
    if (std::any_of(items.begin(), items.end(), is(ClaimOutcome::refuted))) return ClaimOutcome::refuted;
    return std::all_of(items.begin(), items.end(), is(ClaimOutcome::reproduced)) ? ClaimOutcome::reproduced
                                                                                 : ClaimOutcome::cannot_tell;
  }

 private:
  const CellRecord* find(const std::string& name, std::string& reason) const {
    const auto at = cells_.find(name);
    if (at == cells_.end()) {
      reason = "the cell was not run";
      return nullptr;
    }
    if (at->second->status == Status::ok) return at->second;
    reason = fmt::format("{}", at->second->reason.empty() ? "the cell was not run" : at->second->reason);
    return nullptr;
  }

  std::optional<Interval> measured(const std::string& name, const std::string& of, std::string& reason) const {
    const CellRecord* record = find(name, reason);
    if (!record) return std::nullopt;
    const std::optional<Real> value = metric(*record, of), error = standard_error(*record, of);
    if (!value || !error) {
      reason = fmt::format("{} is not known", value ? "the error of " + of : of);
      return std::nullopt;
    }
    if (is_rounding(*record, of, *value)) return exactly(*value);
    if (const std::string tail = tail_of(of); !tail.empty()) {
      const Real spread = std::abs(metric(*record, tail).value_or(0)), its_error = standard_error(*record, tail).value_or(0);
      if (its_error > kLargestRelativeError * spread && !is_rounding(*record, tail, spread)) {
        reason = fmt::format("heavy tails: the error of the sample {} is {:.0f} % of it", tail, 100 * its_error / spread);
        return std::nullopt;
      }
    }
    return Interval{*value, *value - deviations_ * *error, *value + deviations_ * *error};
  }

  /// The variance, if any, that must be known for a metric to be known.
  static std::string tail_of(const std::string& of) {
    if (of == "weighted_cost") return "weight_variance";
    return of.find("variance") == std::string::npos ? "" : of;
  }

  /// The kurtosis of what rounding leaves of a variance says nothing.
  static bool is_rounding(const CellRecord& record, const std::string& of, Real value) {
    if (of == "weight_variance") return value <= kRounding * kRounding;  // the mean weight is about 1
    const Real rounding = kRounding * (record.channel.empty() ? 0 : record.channel[0].reference_rms.value_or(0));
    return (of == "variance" || of == "variance_x_lookups") && value <= rounding * rounding;
  }

  std::optional<Interval> theory(const std::string& name, const std::string& of, std::string& reason) const {
    const CellRecord* record = find(name, reason);
    if (!record) return std::nullopt;
    const std::optional<Real> value = metric_theory(*record, of);
    if (!value) reason = fmt::format("no theory states {}", of);
    return value ? std::optional(exactly(*value)) : std::nullopt;
  }

  ComparedCell compare_cell(const ClaimPart& part, std::size_t i) const {
    ComparedCell result;
    result.cell = part.cells[i];
    if (part.relation == Relation::unbiased) {
      if (const CellRecord* record = find(part.cells[i], result.reason)) result.outcome = of_verdict(*record, result.reason);
      return result;
    }
    result.measured = measured(part.cells[i], part.metric, result.reason);
    if (part.theory)
      result.expected = theory(part.cells[i], part.metric, result.reason);
    else if (!part.others.empty())
      result.expected = measured(result.with = part.others[i], part.metric, result.reason);
    else
      result.expected = exactly(part.numbers[part.numbers.size() == 1 ? 0 : i]);
    return decided(part, std::move(result));
  }

  static ClaimOutcome of_verdict(const CellRecord& record, std::string& reason) {
    const Kind kind = kind_of(record);
    // A mean that a tracker predicts of itself may be as far from the reference as it says.
    if (kind == Kind::pass && record.verdict->against == "reference") return ClaimOutcome::reproduced;
    reason = fmt::format("{}: {}", marked_word(record), finding_of(record));
    return kind == Kind::fail ? ClaimOutcome::refuted : ClaimOutcome::cannot_tell;
  }

  /// Its interval is that of the points' scatter around the line, widened to the level of the others.
  ComparedCell compare_slope(const ClaimPart& part) const {
    ComparedCell result;
    std::vector<std::pair<Real, Real>> points;
    for (const std::string& cell : part.cells) {
      const std::optional<Interval> of = measured(cell, part.metric, result.reason),
                                    against = measured(cell, part.slope_against, result.reason);
      if (!of || !against) return result;
      if (!(of->value > 0) || !(against->value > 0)) {
        result.reason = fmt::format("{} has no logarithm in {}", of->value > 0 ? part.slope_against : part.metric, cell);
        return result;
      }
      points.emplace_back(against->value, of->value);
    }
    const std::optional<Interval> slope = power_law(points);
    if (!slope) {
      result.reason = "a slope needs three cells that differ";
      return result;
    }
    const Real half = (slope->high - slope->value) * deviations_ / kNormal975;
    result.measured = Interval{slope->value, slope->value - half, slope->value + half};
    result.expected = exactly(part.numbers.front());
    return decided(part, std::move(result));
  }

  static ComparedCell decided(const ClaimPart& part, ComparedCell result) {
    if (!result.measured || !result.expected) return result;
    result.expected = scaled(*result.expected, part.factor);
    const Interval &a = *result.measured, &b = *result.expected;
    Real surely = 0, barely = 0;  // distance beyond what is allowed, at most and at least
    if (part.relation == Relation::at_most) {
      surely = a.high - b.low;
      barely = a.low - b.high;
    } else if (part.relation == Relation::at_least) {
      surely = b.high - a.low;
      barely = b.low - a.high;
    } else {
      const Real room = part.tolerance * std::abs(b.value);
      surely = std::max(a.high - b.low, b.high - a.low) - room;
      barely = std::max(a.low - b.high, b.low - a.high) - room;
    }
    result.outcome = surely <= 0 ? ClaimOutcome::reproduced : barely > 0 ? ClaimOutcome::refuted : ClaimOutcome::cannot_tell;
    if (result.outcome == ClaimOutcome::cannot_tell) result.reason = "the samples do not decide";
    return result;
  }

  CellsByName cells_;
  Real deviations_;
};

}  // namespace

const char* to_string(ClaimOutcome outcome) {
  switch (outcome) {
    case ClaimOutcome::reproduced:
      return "reproduced";
    case ClaimOutcome::refuted:
      return "refuted";
    case ClaimOutcome::cannot_tell:
      break;
  }
  return "cannot tell";
}

std::vector<ClaimFinding> findings(const RunRecord& run) {
  std::size_t comparisons = 1;
  for (const PublishedClaim& claim : run.claims)
    for (const ClaimPart& part : claim.parts) comparisons += part.cells.size() + part.others.size();
  const Real deviations =
      boost::math::quantile(complement(boost::math::normal(), kFindingsLevel / (2 * static_cast<Real>(comparisons))));
  const Comparer compare(run, deviations);
  std::vector<ClaimFinding> all;
  for (const PublishedClaim& claim : run.claims) {
    ClaimFinding finding;
    finding.claim = &claim;
    for (const ClaimPart& part : claim.parts) finding.parts.push_back(compare(part));
    finding.outcome = Comparer::joint(finding.parts);
    all.push_back(std::move(finding));
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const ClaimFinding& a, const ClaimFinding& b) { return a.claim->id < b.claim->id; });
  return all;
}

}  // namespace nullmark
