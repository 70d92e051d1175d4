#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/plan.h"

namespace nullmark {

/// `skipped`: the combination does not apply or its data is missing.  `not_run`: never started (time budget, interrupt).
enum class Status { ok, skipped, not_run, error };

/// Statistics of one channel.  Absent: not known or not finite.
struct ChannelRecord {
  std::optional<Real> mean, reference, reference_error;  ///< averages over the rays
  std::optional<Real> bias;                              ///< mean - reference
  std::optional<Real> rmse;                              ///< over the rays' means
  std::optional<Real> rmse_theory;                       ///< sqrt(mean over rays of variance_theory / n + predicted bias^2)
  std::optional<Real> variance;                          ///< per sample, averaged over the rays
  std::optional<Real> variance_theory;
  std::optional<Real> relative_variance;  ///< variance (theory where known) over the mean square of the reference
  std::optional<Real> kurtosis;           ///< of the errors around the reference, pooled
};

/// Error of the mean of n samples, measured over all disjoint groups of n.
struct ConvergenceRecord {
  std::uint64_t samples = 0;
  std::vector<std::optional<Real>> rmse, variance;  ///< per channel
};

struct TimeRecord {
  Real ns_per_sample = 0, ns_per_lookup = 0;
  Real floor_ratio = 0;  ///< ns per lookup over random number + logarithm + advance in the same process
  Real loop_ratio = 0;   ///< ns per lookup over the plain hand-written ratio loop on a constant medium in the same process
  Real mad = 0;          ///< median absolute deviation of ns_per_sample
  int repetitions = 0, threads = 1;
  std::uint64_t samples_per_traversal = 1;
  std::vector<Real> repetition_ns;  ///< ns per sample of each repetition
};

struct CellRecord {
  Cell cell;
  MediumSpec medium;
  Component majorant, ray_set;
  std::string medium_hash;
  std::string claims, range;
  int channels = 1;
  std::vector<std::string> effects{"absorption"};
  Status status = Status::not_run;
  std::string reason;
  std::uint64_t rays = 0, samples = 0;
  std::string reference_method;
  std::string variance_basis;  ///< "analytic" or "sample"
  std::vector<ChannelRecord> channel;
  std::optional<Real> lookups_per_sample, lookups_theory, null_collisions_per_sample, draws_per_sample;
  std::uint64_t lookups = 0, draws = 0;  ///< exact totals
  std::uint64_t majorant_violations = 0, nonfinite = 0;
  std::optional<Real> largest_violation;  ///< max mu / mub seen beyond 1
  std::optional<TimeRecord> time;
  std::vector<ConvergenceRecord> convergence;
  std::map<std::string, std::string> images;  ///< "mean", "variance", "lookups" -> path relative to the results file
};

/// One run: what the results file holds.
struct RunRecord {
  static constexpr int kSchema = 1;
  std::string name;
  std::string config_text;
  std::map<std::string, std::string> provenance;  ///< values are JSON texts
  std::vector<CellRecord> cells;
  std::vector<Table> tables;
};

}  // namespace nullmark
