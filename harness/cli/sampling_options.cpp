#include "harness/cli/sampling_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>

#include "harness/report/results_tables.h"

namespace nullmark {
namespace {

/// For commands that draw samples.  Those that read results start nothing, whatever the results say.
void add_consent(CLI::App& command, bool& allow) {
  command.add_flag(
      "--allow-foreign", allow,
      "Let the configuration run trackers from outside of nullmark, with all your rights; as NULLMARK_ALLOW_FOREIGN=1");
}

}  // namespace

void declare_run(CLI::App& command, RunCommand& asked) {
  command.add_option("CONFIG", asked.configs, "Configuration files, folders of configurations, or - for standard input")
      ->required();
  command.add_option("-o,--output", asked.output,
                     "Results file (default: stem of CONFIG + .results.json); - for standard output");
  command.add_option("--threads", asked.threads, "Number of threads; 0: all cores.  Results do not depend on it")
      ->check(CLI::Range(0, 4096));
  command.add_option("--seed", asked.seed, "Seed that replaces that of the configuration, or \"random\"");
  command.add_option("--filter", asked.filter, "Run only cells whose name matches this regular expression");
  command.add_flag("--covering", asked.covering,
                   "Run a subset in which every pair of estimator, medium, depth and majorant occurs");
  command.add_option("--shard", asked.shard, "Run only part K of N: K/N, or auto for the task of a scheduler");
  command.add_flag("--resume", asked.resume, "Continue from the existing results and journal");
  command.add_option("--builds", asked.builds, kBuilds)->needs("--resume");
  command.add_flag("--force", asked.force, "Replace existing results")->excludes("--resume");
  command.add_flag("--dry-run", asked.dry_run,
                   "Print cells, predicted samples, lookups and time; draw only a few samples, to see what they cost");
  command.add_option("--time-budget", asked.time_budget, "End sampling and timing after this many seconds")
      ->check(CLI::Validator(
          [](const std::string& text) {
            double seconds = -1;
            const bool number = CLI::detail::lexical_cast(text, seconds) && std::isfinite(seconds) && seconds >= 0;
            return number ? std::string() : fmt::format("found \"{}\"; expected seconds >= 0", text);
          },
          "SECONDS"));
  add_consent(command, asked.allow_foreign);
  command
      .add_option("--columns", asked.columns,
                  fmt::format("Columns of the table, with commas: {}", fmt::join(results_columns(), ",")))
      ->delimiter(',')
      ->allow_extra_args(false);
  command.add_flag("--no-timing", asked.no_timing, "Skip timing; statistics only");
}

void declare_prove(CLI::App& command, ProveCommand& asked) {
  command.add_option("ESTIMATOR", asked.estimator, "Name of an estimator, or an object as in a configuration");
  command.add_option("--medium", asked.medium, "Name of a medium, or an object: tests its promises, and the tracker on it alone");
  add_consent(command, asked.allow_foreign);
  command.add_flag("--quick", asked.quick, "An eighth of the samples and fewer media");
  command.add_option("--threads", asked.threads, "Number of threads; 0: all cores")->check(CLI::Range(0, 4096));
  command.add_option("-o,--output", asked.output, "Also write the results, for check and replay");
  command.add_flag("--force", asked.force, "Replace existing results");
}

void declare_problem(CLI::App& command, ProblemCommand& asked) {
  command.add_option("CONFIG", asked.config, "Configuration file, or - for standard input")->required();
  command.add_option("-o,--output", asked.output, "Folder to write")->required();
  command.add_flag("--with-answers", asked.with_answers, "Write the exact values as well");
  command.add_option("--resolution", asked.resolution, "Voxels across, of media that are no volumes")->check(CLI::Range(2, 400));
  command.add_flag("--force", asked.force, "Write into a folder that is not empty");
}

void declare_judge(CLI::App& command, JudgeCommand& asked) {
  command.add_option("DIR", asked.problem, "Folder that `problem` wrote")->required();
  command.add_option("SAMPLES", asked.samples, "An .npy file of shape (samples, rays[, channels]), or a folder of EXR images")
      ->required();
  command.add_option("--range", asked.range, "Of every sample: unit, non_negative, signed (default) or binary");
  command.add_flag("--correlated", asked.correlated,
                   "The rays of one row share random numbers: judge means over rays, as of images");
  command.add_option("--scene", asked.scene, "Id of the scene; may be left out if there is one");
  command.add_option("-o,--output", asked.output, "Also write the results, for check and report");
  command.add_flag("--force", asked.force, "Replace existing results");
}

void declare_replay(CLI::App& command, ReplayCommand& asked) {
  command.add_option("RESULTS", asked.results, "Results file")->required();
  command.add_option("CELL", asked.cell, "Name of a cell in the results")->required();
  CLI::Option* ray = command.add_option("--ray", asked.ray, "Ray, from 0 (default: that of the sample farthest from its target)");
  command.add_option("--sample", asked.sample, "Sample of the ray, from 0 (default: the one farthest from its target)")
      ->needs(ray);
  add_consent(command, asked.allow_foreign);
  command.add_flag("--json", asked.json, "Print JSON, with all digits");
}

}  // namespace nullmark
