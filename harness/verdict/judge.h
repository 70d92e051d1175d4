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

/// Whether no ray meets any extinction.  Then any tracker is right.  Light can still meet surfaces.
bool tests_nothing(const PreparedCell& prepared);

/// The tests of a cell; nothing if it claims nothing that can be tested.  If theory states no variance, a pilot is drawn, and
/// some of its samples are kept.
std::optional<TestPlan> tests_of(const PreparedCell& prepared, const TestLevels& levels, std::vector<KeptSamples>& kept,
                                 const std::function<bool()>& stop);

/// Judges the evidence of the first samples, and draws more while the verdict is open.  Nothing if interrupted.
std::optional<VerdictRecord> judge(const PreparedCell& prepared, const TestPlan& plan, const Sampled& sampled,
                                   std::span<const KeptSamples> kept, const ErrorRates& levels, const Families& families,
                                   Effort& effort, const std::function<bool()>& stop,
                                   const std::function<void(double)>& progress);

}  // namespace nullmark
