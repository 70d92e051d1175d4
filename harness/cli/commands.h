#pragma once

#include <optional>
#include <string>
#include <vector>

#include "harness/model/exit_code.h"

namespace nullmark {

/// What `nullmark list` lists, and what `nullmark schema` describes.
inline const std::vector<std::string> kLists = {"estimators", "media", "majorants", "rays", "quantities"},
                                      kSchemas = {"config", "results"};

/// `nullmark run`.
struct RunCommand {
  std::vector<std::string> configs;
  std::string output;     ///< empty: from the name of the configuration; "-": standard output
  std::string seed;       ///< empty: that of the configuration; "random"; or a number
  std::string filter;     ///< regular expression on cell names
  bool covering = false;  ///< only the cells that covering_cells selects
  std::string shard;      ///< "K/N", 1 <= K <= N
  std::string builds;     ///< "same" or "any"; empty: same
  int threads = 0;
  std::optional<double> time_budget;
  std::vector<std::string> columns;  ///< of the table; empty: all
  bool resume = false, force = false, dry_run = false, no_timing = false;
  bool allow_foreign = false;  ///< as NULLMARK_ALLOW_FOREIGN=1: configurations may run code from outside
  std::vector<std::string> command_line;
};
ExitCode run_command(const RunCommand& command);

/// `nullmark prove`.
struct ProveCommand {
  std::string estimator;  ///< a name, or an object as in a configuration; empty: ratio, to try a medium with
  std::string medium;     ///< likewise; empty: those of the battery
  std::string output;     ///< results file; empty: none
  int threads = 0;
  bool quick = false, force = false;
  bool allow_foreign = false;
  std::vector<std::string> command_line;
};
ExitCode prove_command(const ProveCommand& command);

/// `nullmark problem`.
struct ProblemCommand {
  std::string config, output;  ///< a configuration file; the folder to write
  int resolution = 64;         ///< voxels across, of media that are no volumes
  bool with_answers = false, force = false;
};
ExitCode problem_command(const ProblemCommand& command);

/// `nullmark judge`.
struct JudgeCommand {
  std::string problem, samples;  ///< folder of `nullmark problem`; an .npy file, or a folder of images
  std::string range = "signed";  ///< of the samples: "signed", "non_negative", "unit" or "binary"
  std::string scene;             ///< id; empty: the only one
  std::string output;            ///< results file; empty: none
  bool correlated = false;       ///< the rays of a row share random numbers
  bool force = false;
  std::vector<std::string> command_line;
};
ExitCode judge_command(const JudgeCommand& command);

/// `nullmark replay`.
struct ReplayCommand {
  std::string results, cell;
  std::string ray, sample;  ///< whole numbers; empty: search
  bool json = false;
  bool allow_foreign = false;
};
ExitCode replay_command(const ReplayCommand& command);

/// `nullmark gate`.
struct GateCommand {
  std::string baseline;              ///< results, a baseline, or a folder of baselines
  std::string results;               ///< of `nullmark run`
  std::optional<double> threshold;   ///< percent; replaces the thresholds of the tiers
  std::vector<std::string> require;  ///< words of required.h; empty: what the baseline holds
  std::string blocks;                ///< folder of interleaved runs; empty: no wall time
  std::string junit, markdown;       ///< files; empty: none
  bool update = false, quiet_machine = false;
};
ExitCode gate_command(const GateCommand& command);

/// `nullmark report`.
struct ReportCommand {
  std::vector<std::string> results;
  std::string output;             ///< the page
  std::string baseline;           ///< tracker to compare the others with; empty: the fastest unbiased one
  std::string figures, markdown;  ///< folder and file; empty: none
};
ExitCode report_command(const ReportCommand& command);

/// `nullmark history`.
struct HistoryCommand {
  std::vector<std::string> results;
  std::string blocks;  ///< folder of interleaved runs of the last two programs; empty: no wall time
  bool json = false;
};
ExitCode history_command(const HistoryCommand& command);

/// `nullmark merge`.
struct MergeCommand {
  std::vector<std::string> parts;
  std::string output, builds;
  bool force = false;
};
ExitCode merge_command(const MergeCommand& command);

/// `nullmark list`.
struct ListCommand {
  std::string what;  ///< "estimators", "media", "majorants", "rays" or "quantities"
  std::string name;  ///< of the one to list; empty: all
  bool json = false;
};
ExitCode list_command(const ListCommand& command);

}  // namespace nullmark
