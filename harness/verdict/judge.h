#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/model/record.h"
#include "harness/sampling/cell_preparation.h"
#include "harness/sampling/sampling.h"

namespace nullmark {

/// Time of verdicts and of all statistics beside the sampling, and the number of walks that did not end.
struct Effort {
  double judging = 0, statistics = 0, working = 0;
  std::uint64_t overruns = 0;
  Effort& operator+=(const Sampled& sampled) {
    overruns += sampled.counters.overruns;
    judging += sampled.judging_seconds;
    statistics += sampled.statistics_seconds;
    working += sampled.working_seconds;
    return *this;
  }
  Effort& operator+=(const Effort& other) {
    overruns += other.overruns;
    judging += other.judging;
    statistics += other.statistics;
    working += other.working;
    return *this;
  }
};

/// Sizes of the families over which the levels of a verdict are divided.
struct Families {
  std::uint64_t means = 1, lookups = 1, laws = 1;
};

/// Why a cell has no verdict; empty if it has one.
std::string why_not_judged(const PreparedCell& prepared);

/// Whether theory decides how a cell is sampled: its number of samples or its tests.
bool needs_theory(const PreparedCell& prepared);

/// Whether no ray meets any extinction.  Then any tracker is right.  Light can still meet surfaces.
bool tests_nothing(const PreparedCell& prepared);

/// What is drawn before the tests of a cell are planned, with streams of its own.
struct DrawnPilot {
  std::optional<Pilot> pilot;
  std::optional<KeptSamples> kept;  ///< of the pilot, for the law of replays
  std::vector<Real> size;           ///< [ray * outputs + o], means of the tracker that a difference subtracts
};

/// Draws variances where theory states none, and the means that margins of a difference are relative to.
DrawnPilot draw_pilot(const PreparedCell& prepared, const std::function<bool()>& stop);
/// The samples of the pilot's variances.
SampleSpan pilot_span(const PreparedCell& prepared);

/// The tests of a cell; nothing if it claims nothing that can be tested.
std::optional<TestPlan> tests_of(const PreparedCell& prepared, const TestLevels& levels, const DrawnPilot& drawn);

/// The samples of every ray that an open verdict asks for after `drawn` ones; none where no more are allowed.
SampleSpan next_span(const TestPlan& plan, std::uint64_t drawn);

/// Samples per ray after which the verdict of an unbiased cell is expected.
std::uint64_t expected_samples(const PreparedCell& prepared, const TestPlan& plan);

/// What a verdict draws with streams of its own, whatever the samples are.
struct WalkLaws {
  std::vector<LawRecord> laws;        ///< of walks and free paths
  std::vector<std::string> untested;  ///< with the reason
  std::uint64_t counted_walks = 0;    ///< see VerdictRecord
};
/// `lookups_of_a_sample` is used where theory does not state them.
WalkLaws draw_walk_laws(const PreparedCell& prepared, const TestPlan& plan, Real lookups_of_a_sample, Real alpha,
                        const std::function<bool()>& stop);

/// Draws a span of the cell, or takes it from where it is stored.  Nothing if that is not possible.
using DrawSpan = std::function<std::optional<Sampled>(const SampleSpan&)>;

/// Judges the evidence of the first samples, and asks `draw` for more while the verdict is open.  Nothing if they are not drawn.
std::optional<VerdictRecord> judge(const PreparedCell& prepared, const TestPlan& plan, const Sampled& sampled,
                                   std::span<const KeptSamples> kept, WalkLaws laws, const ErrorRates& levels,
                                   const Families& families, Effort& effort, const DrawSpan& draw,
                                   const std::function<bool()>& stop);

}  // namespace nullmark
