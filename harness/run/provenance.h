#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "harness/model/plan.h"
#include "harness/model/record.h"
#include "harness/run/run.h"

namespace nullmark {

/// Provenance of a run: source, plug-in, compiler, machine, libraries, command; values are JSON texts.  No host name.
struct RunContext {
  std::vector<std::string> command_line;
  int threads = 0;            ///< cores used
  std::string filter, shard;  ///< as given; empty: all cells
  bool covering = false;      ///< see covering.h
  std::size_t selected =
      0;  ///< cells that the filter and the covering subset select, over all shards, and cells that were there before
  /// Time of the verdicts' evidence, and of all statistics, divided by that of the sampling.
  std::optional<double> verdict_share, statistics_share;
  std::vector<Phase> phases;
  std::vector<std::uint64_t> seeds;
  std::chrono::system_clock::time_point start = std::chrono::system_clock::now();
};
std::map<std::string, std::string> make_provenance(const RunContext& context, std::chrono::system_clock::time_point end);

/// A run that ends now: cells of a plan, with its configuration, tables and claims.
RunRecord make_run_record(const Plan& plan, std::vector<CellRecord> cells, const RunContext& context);

/// "nullmark 0.1.0 (commit 0123abcd, dirty; Release)"
std::string version_line();

/// ISO 8601 in UTC, to the second.
std::string iso_time(std::chrono::system_clock::time_point time);

}  // namespace nullmark
