#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/plan.h"
#include "harness/statistics/test_basis.h"
#include "media/majorants/majorant.h"

namespace nullmark {

/// `skipped`: the combination does not apply or its data is missing.  `not_run`: never started (time budget, interrupt).
enum class Status { ok, skipped, not_run, error };

/// Statistics of one channel, or of one output of a quantity with several.  Absent: not known or not finite.
struct ChannelRecord {
  std::optional<Real> mean, reference, reference_error;  ///< averages over the rays
  std::optional<Real> bias;                              ///< mean - reference
  std::optional<Real> bias_theory;                       ///< mean that the estimator predicts - reference
  std::optional<Real> rmse;                              ///< over the rays' means
  std::optional<Real> rmse_theory;                       ///< sqrt(mean over rays of variance_theory / n + predicted bias^2)
  std::optional<Real> variance;                          ///< per sample, averaged over the rays
  std::optional<Real> variance_theory;
  std::optional<Real> relative_variance;  ///< variance (theory where known) over the mean square of the reference
  std::optional<Real> kurtosis;           ///< of the errors around the reference, pooled
  std::optional<Real> reference_rms;      ///< root mean square over the rays
};

/// Error of the mean of n samples, measured over all disjoint groups of n.
struct ConvergenceRecord {
  struct Error {
    std::optional<Real> rmse, variance;
  };
  std::uint64_t samples = 0;
  std::vector<Error> channel;
};

/// Cost of a sample if this many samples share a walk through the majorant structure.
struct BatchTime {
  std::uint64_t samples_per_traversal = 1;
  Real ns_per_sample = 0, mad = 0;
};

struct TimeRecord {
  Real ns_per_sample = 0, ns_per_lookup = 0;
  Real floor_ratio = 0;  ///< ns per lookup over random number + logarithm + advance in registers of the cell's precision
  Real loop_ratio = 0;   ///< ns per lookup over the plain hand-written ratio loop on a constant medium in the same process
  Real mad = 0;          ///< median absolute deviation of ns_per_sample
  int repetitions = 0, threads = 1;
  std::uint64_t samples_per_traversal = 1;
  std::vector<Real> repetition_ns;   ///< ns per sample of each repetition
  Real majorant_build_seconds = 0;   ///< wall time of building the majorant structure, on all threads
  std::vector<BatchTime> batches{};  ///< ascending; the last has ns_per_sample; empty if there is only one
  Real memory_ratio = 0;             ///< of volumes: ns per lookup over one read of a random cache line of as many bytes; else 0
  Real seam_ns_per_sample = 0;       ///< part of ns_per_sample that exchanges with the tracker's process cost; 0: no process
  std::optional<Real> waiting{};     ///< share of the wall time in which the timed thread did not run, median over repetitions
};

/// PASS: |bias| < epsilon is proven.  FAIL: a bias is proven (or one beyond epsilon, by `Tolerate`).  INCONCLUSIVE: neither is
/// proven; the reason says why.  VIOLATED: the estimator needs a true majorant and did not have one.  None: nothing is claimed,
/// or nothing was tested.
enum class Outcome : std::uint8_t { none, pass, fail, inconclusive, violated };

/// Evidence of a contradiction that no chance explains.
inline constexpr Real kCertain = 1e6;

/// Evidence of one test, from which `check` derives its outcome.
struct TestRecord {
  int channel = 0;  ///< -1: lookups
  int group = -1;   ///< -1: all rays
  std::uint64_t samples = 0;
  Real epsilon = 0, reference_error = 0;  ///< absolute
  Real reference = 0;                     ///< expected mean, averaged over the rays of the test
  Real mean_error = 0;                    ///< mean of the samples minus the reference
  Real variance = 0;                      ///< the variance that the bets were planned with
  /// Against "mean error 0", "at most -epsilon", "at least epsilon", "within epsilon".
  Real log_e_fail = 0, log_e_low = 0, log_e_high = 0, log_e_beyond = 0;
  Real largest_error = 0, rounding = 0;  ///< of single samples; deterministic tests
  std::uint64_t planned = 0;             ///< samples per ray
  std::vector<Real> rates;               ///< of the bets against "mean error 0"; of a group of rays they are not kept
  Outcome outcome = Outcome::none;
  TestBasis basis = TestBasis::none;

  bool deterministic() const { return basis == TestBasis::deterministic; }
  /// Largest error of a right sample.
  Real allowed_error() const { return rounding + reference_error; }
  /// Of a deterministic test: every sample is the reference but for rounding.
  bool right() const { return largest_error <= allowed_error(); }
  bool takes_variance() const { return basis == TestBasis::catoni || basis == TestBasis::both; }
};

/// Evidence against a law that walks must follow, from which `check` derives its outcome.
struct LawRecord {
  std::string name;
  Real log_e = 0;             ///< evidence against it: log of an e-value, or -log of a probability
  std::uint64_t samples = 0;  ///< observations
  Outcome outcome = Outcome::none;
};

struct VerdictRecord {
  /// Outcome for the mean: `unbiased` against the reference, for estimators that claim to be unbiased; `own_mean` against the
  /// mean that the estimator predicts for itself, which proves nothing about T.
  Outcome unbiased = Outcome::none, own_mean = Outcome::none;
  Outcome lookups = Outcome::none;
  std::string reason;  ///< why it is INCONCLUSIVE, or what fails
  std::string proves;  ///< what a PASS proves: "|bias| < 0.37 % of the mean"
  Tolerate tolerate = Tolerate::nothing;
  bool within = false, beyond = false, biased = false;  ///< what is proven of the mean error: see verdict.h
  /// "reference"; "own mean" of an estimator that predicts its bias; "difference" of two trackers, which is 0.
  std::string against;
  std::string variance_basis;                 ///< "analytic", "pilot" or "none"
  bool planned_undecidable = false;           ///< the plan found that no affordable number of samples decides
  bool violated = false;                      ///< needs a true majorant, and the extinction was seen above it
  bool bound_unproven = false;                ///< the majorant is not known to bound, and nothing was seen above it
  std::uint64_t counted_walks = 0;            ///< walks whose lookups were checked to be their collisions, one by one
  std::uint64_t nonfinite = 0;                ///< number among the samples beyond samples_per_ray of the cell
  std::uint64_t out_of_range = 0;             ///< samples outside the range the estimator declares
  std::uint64_t samples_per_ray = 0;          ///< drawn in total
  std::uint64_t planned = 0, affordable = 0;  ///< samples per ray
  std::uint64_t family = 1, lookups_family = 1;
  Real alpha = 1e-4, alpha_pass = 1e-3;
  std::vector<TestRecord> tests;
  std::uint64_t laws_family = 1;
  std::vector<LawRecord> laws;        ///< properties of samples and walks other than the mean: see walk_laws.h
  std::vector<std::string> untested;  ///< assumptions that no law tests, with the reason
  Outcome lawful = Outcome::none;     ///< PASS: no law is broken
};

/// A tracker from outside of nullmark, as it was when the cell was sampled.
struct TrackerRecord {
  std::string name, version;  ///< as it says
  std::string hash;           ///< of its code, 16 hexadecimal digits; empty: no tracker from outside
  bool lookups_told = false;  ///< lookups are those that it tells of a medium of its own, not counted by the harness
  bool unrepeatable = false;  ///< its samples cannot be drawn again
};

struct CellRecord {
  Cell cell;
  Shared<MediumSpec> medium;
  Shared<Component> majorant, ray_set;
  std::string medium_hash;
  std::optional<StructureSize> structure;  ///< of the majorant; absent if it was not built
  std::string claims, range;               ///< empty of a tracker from outside that was not opened
  TrackerRecord tracker;
  bool given_depth = false;      ///< the estimator is handed the exact optical depth
  std::optional<Real> reliance;  ///< if given_depth: share of its answer that follows that depth, 1: all; see reliance.h
  std::optional<Real> order;     ///< order in the step of a consistent estimator's bias
  bool in_lanes = false;         ///< walks ran side by side in registers
  int channels = 1;
  std::vector<std::string> outputs;  ///< for quantities with several numbers per channel: the names of the entries of `channel`
  std::vector<std::string> effects{"absorption"};
  Status status = Status::not_run;
  std::string reason;
  std::string build;  ///< compiler, C library and instruction set that made the cell, where not those of the results' provenance
  std::uint64_t rays = 0, samples = 0;
  std::string reference_method;
  std::string variance_basis;  ///< "analytic" or "sample"
  std::vector<ChannelRecord> channel;
  std::optional<Real> lookups_per_sample, lookups_theory, null_collisions_per_sample, draws_per_sample;
  std::uint64_t lookups = 0, draws = 0;  ///< exact totals
  /// Variance of the lookups of one sample, averaged over the rays.  If every ray has one sample: variance over all rays, which
  /// is larger.
  std::optional<Real> lookups_variance;
  std::optional<std::uint64_t> instructions;       ///< of drawing the samples, counted in a simulator; see performance_gate.md
  std::optional<std::uint64_t> last_level_misses;  ///< of the data, in the same simulator's caches
  std::uint64_t majorant_violations = 0, nonfinite = 0;
  std::optional<Real> largest_violation;  ///< largest mu / mub above 1
  std::optional<Real> largest_sample;     ///< max |X| of the finite samples, all outputs together
  std::optional<TimeRecord> time;
  std::optional<VerdictRecord> verdict;
  std::vector<ConvergenceRecord> convergence;
  /// Mean squared errors of disjoint parts of the samples (BlockErrors), averaged over channels.  Estimators with the same
  /// streams have the same parts.  Empty if there are too few samples, and for quantities with several numbers per channel.
  std::vector<Real> squared_error_blocks;
  /// Of a cell that shards share and that is not judged yet: which part of its samples is drawn, "2/4", or empty where parts are
  /// joined; and what was drawn, as text (harness/run/cell_draws.h).
  std::string part;
  std::vector<std::string> drawn_parts;
  std::map<std::string, std::string> images;  ///< "mean", "variance", "lookups" -> path relative to the results file
};

/// One run: what the results file holds.
struct RunRecord {
  static constexpr const char* kVersion = "results/2";
  std::string name;
  std::string config_text;
  std::map<std::string, std::string> provenance;  ///< values are JSON texts
  std::vector<CellRecord> cells;
  std::vector<Table> tables;
  std::vector<PublishedClaim> claims;
};

}  // namespace nullmark
