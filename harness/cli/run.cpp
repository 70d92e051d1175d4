#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <regex>
#include <set>
#include <thread>

#include "harness/cli/commands.h"
#include "harness/cli/process.h"
#include "harness/cli/shard.h"
#include "harness/cli/signals.h"
#include "harness/cli/watched_run.h"
#include "harness/config/config.h"
#include "harness/foreign/consent.h"
#include "harness/io/file_io.h"
#include "harness/io/fitted.h"
#include "harness/io/notice.h"
#include "harness/io/outputs.h"
#include "harness/io/results_json.h"
#include "harness/io/spec_json.h"
#include "harness/io/text.h"
#include "harness/registry/environment_variables.h"
#include "harness/report/results_tables.h"
#include "harness/report/warnings.h"
#include "harness/run/covering.h"
#include "harness/run/deal.h"
#include "harness/run/journal.h"
#include "harness/run/predict.h"
#include "harness/run/progress.h"
#include "harness/run/provenance.h"
#include "harness/run/resume.h"

namespace nullmark {
namespace {

std::optional<std::uint64_t> requested_seed(const std::string& text) {
  if (text.empty()) return std::nullopt;
  if (text == "random") {
    std::random_device device;
    const std::uint64_t seed = (std::uint64_t{device()} << 32) | device();
    notice("nullmark: seed {}\n", seed);
    return seed;
  }
  const auto seed = whole_number(text);
  if (!seed) throw InputError(fmt::format("--seed: found \"{}\"; expected a whole number >= 0 or \"random\"", text));
  return seed;
}

/// The cells of a plan that `--filter` and `--covering` pick.
std::vector<bool> filtered(const Plan& plan, const RunCommand& command) {
  // Beyond that std::regex runs out of stack.
  constexpr std::size_t kLongest = 1000;
  if (command.filter.size() > kLongest)
    throw InputError(fmt::format("--filter: found {} characters; expected at most {}", command.filter.size(), kLongest));
  std::regex pattern;
  try {
    pattern = std::regex(command.filter);
  } catch (const std::regex_error& error) {
    throw InputError(fmt::format("--filter: found \"{}\"; expected a regular expression: {}", command.filter, error.what()));
  }
  std::vector<bool> wanted = command.covering ? covering_cells(plan) : std::vector<bool>(plan.cells.size(), true);
  for (std::size_t i = 0; i < plan.cells.size(); ++i)
    wanted[i] = wanted[i] && (command.filter.empty() || std::regex_search(plan.cells[i].name, pattern));
  return wanted;
}

/// Tasks of a scheduler run in one folder, so a shard's results are named after it: "c.2-of-4.results.json".
std::string default_output(const std::string& config, const Shard& shard) {
  std::filesystem::path path(config == "-" ? "stdin" : config);
  if (!path.has_filename()) path = path.parent_path();
  const bool file = path.extension() == ".json";
  const std::string part = shard.count > 1 ? fmt::format(".{}-of-{}", shard.index + 1, shard.count) : "";
  return (file ? path.stem() : path.filename()).string() + part + ".results.json";
}

std::string percent(double fraction) { return fmt::format("{:.2g} %", 100 * fraction); }

/// What each cell would cost and how small a bias its samples would show.
ExitCode dry_run(const Plan& plan, const std::vector<bool>& selected, bool timing, const Shard& shard, const Deal& dealt) {
  // A pooled bias of five standard errors is hardly chance, whatever the number of cells.
  constexpr double kStandardErrors = 5;
  const Forecast run = forecast(plan, selected);
  std::vector<std::vector<std::string>> lines = {
      {"cell", "rays", "samples/ray", "lookups/sample", "CPU seconds", "bias shown from", "planned/ray", "verdict", "status"}};
  double samples = 0, seconds = 0;
  bool any = false;
  for (const Prediction& prediction : run.cells) {
    const double drawn = static_cast<double>(prediction.rays) * static_cast<double>(prediction.samples_per_ray);
    std::optional<double> shown;
    if (prediction.relative_variance && drawn > 0) shown = kStandardErrors * std::sqrt(*prediction.relative_variance / drawn);
    lines.push_back({plan.cells[prediction.cell].name, fmt::to_string(prediction.rays),
                     fmt::to_string(prediction.samples_per_ray), short_number(prediction.lookups_per_sample),
                     fmt::format("{:.2g}", prediction.seconds), shown ? percent(*shown) : "-",
                     short_number(static_cast<Real>(prediction.planned)), prediction.verdict, prediction.status});
    if (prediction.status != "ok") continue;
    any = true;
    samples += drawn;
    seconds += prediction.seconds;
  }
  tell("{}\n", aligned(lines, 1));
  if (run.cells.size() < run.selected) tell("{} of the cells stand for all; ", run.cells.size());
  tell("{} cell{}: about {:.3g} samples before those that verdicts add, {:.3g} s of CPU{}\n", run.selected,
       run.selected == 1 ? "" : "s", samples * run.weight(), seconds * run.weight(),
       timing && plan.timing.enabled ? fmt::format(" and {:.3g} s of timing", run.timing_seconds) : "");
  if (shard.count > 1) {
    const double mean = std::accumulate(dealt.loads.begin(), dealt.loads.end(), 0.) / static_cast<double>(shard.count);
    tell("shard {}: {:.3f} of the mean load, the largest has {:.3f}; {} cells are split, and shown whole here\n", shard.text(),
         dealt.loads[shard.index] / mean, *std::max_element(dealt.loads.begin(), dealt.loads.end()) / mean, dealt.split_cells());
  }
  if (any) return ExitCode::ok;
  notice("nullmark: nothing would run: all cells are skipped\n");
  return ExitCode::nothing_ran;
}

/// Files that the run reads: configurations and the volumes of its media.
std::vector<std::string> inputs_of(const std::vector<ConfigSource>& sources, const Plan& plan) {
  std::vector<std::string> files;
  files.reserve(sources.size());
  for (const ConfigSource& source : sources) files.push_back(source.file);
  const std::function<void(const MediumSpec&)> add = [&](const MediumSpec& medium) {
    if (const auto file = medium.field.values.find("file"); file != medium.field.values.end())
      if (const auto* path = std::get_if<std::string>(&file->second)) try {
          files.push_back(with_variables(*path));
        } catch (const MissingData&) {
          // Then there is no file to protect.
        }
    for (const auto* others : {&medium.per_channel, &medium.emission_field, &medium.albedo_field})
      for (const MediumSpec& other : *others) add(other);
  };
  for (const Shared<MediumSpec>& medium : plan.media) add(*medium);
  return files;
}

ExitCode outcome(const std::vector<CellRecord>& cells) {
  if (received_signal != 0) return received_signal == SIGINT ? ExitCode::interrupted : ExitCode::terminated;
  bool any_ok = false;
  for (const CellRecord& cell : cells) {
    if (cell.status == Status::error) return ExitCode::internal_error;
    any_ok |= cell.status == Status::ok || !cell.drawn_parts.empty();
  }
  if (any_ok) return ExitCode::ok;
  notice("nullmark: nothing ran: all cells were skipped or not started\n");
  return ExitCode::nothing_ran;
}

void warn_of_own_seeds(const Plan& plan, std::uint64_t seed) {
  const auto own = std::find_if(plan.cells.begin(), plan.cells.end(), [&](const Cell& cell) { return cell.seed != seed; });
  if (own != plan.cells.end())
    notice("nullmark: warning: experiment \"{}\" names its seeds itself; --seed does not change them\n", own->experiment);
}

/// A uniform next event under a mean cosine of g has the second moment (1 + g^2)/(1 - g^2)^2 at each scattering: at .999 rare
/// samples carry the mean, and an estimate without them is too small.
void warn_of_narrow_phases(const Plan& plan, const std::vector<bool>& selected) {
  constexpr Real kMost = 10;
  for (std::size_t i = 0; i < plan.cells.size(); ++i) {
    const Cell& cell = plan.cells[i];
    if (!selected[i] || cell.transport.next_event != "uniform") continue;
    const Real g = plan.media[cell.medium]->anisotropy, second = (1 + g * g) / ((1 - g * g) * (1 - g * g));
    if (second <= kMost) continue;
    notice(
        "nullmark: warning: experiment \"{}\" draws next events uniformly under a mean cosine of {:g}: each scattering "
        "multiplies "
        "the second moment by {:.3g}; take \"next_event\": \"mis\"\n",
        cell.experiment, g, second);
    return;
  }
}

/// Throws InputError where the output may not be written, or is there and neither to be completed nor replaced.
std::unique_ptr<Journal> open_journal(const RunCommand& command, const std::vector<ConfigSource>& sources, const Plan& plan,
                                      const std::string& output) {
  refuse_overwriting(inputs_of(sources, plan), {output, Journal::path_for(output)});
  if (std::error_code error; std::filesystem::is_directory(output, error))
    throw InputError(output + ": is a folder; expected the path of a results file");
  if (command.force) expect_new(output, true, kResultsBeginning);
  using Mode = Journal::Mode;
  auto journal = std::make_unique<Journal>(output, config_hash(plan.config_text),
                                           command.resume  ? Mode::resume
                                           : command.force ? Mode::overwrite
                                                           : Mode::fresh,
                                           this_build(), builds_of(command.builds));
  if (!command.resume && !command.force && std::filesystem::exists(output))
    throw InputError(output + ": exists; --resume completes it, --force replaces it");
  return journal;
}

RunContext context_of(const RunCommand& command, const Plan& plan, const Shard& shard) {
  RunContext context;
  context.command_line = command.command_line;
  context.filter = command.filter;
  context.covering = command.covering;
  if (!command.shard.empty()) context.shard = shard.text();
  context.threads = command.threads > 0 ? command.threads : static_cast<int>(std::thread::hardware_concurrency());
  std::set<std::uint64_t> seeds;
  for (const Cell& cell : plan.cells) seeds.insert(cell.seed);
  context.seeds.assign(seeds.begin(), seeds.end());
  return context;
}

/// `output` is empty where results go to standard output, and pictures nowhere.
RunOptions options_of(const RunCommand& command, const std::string& output) {
  RunOptions options;
  options.threads = command.threads;
  options.time_budget = command.time_budget;
  options.timing = !command.no_timing;
  options.interrupted = &received_signal;
  if (!output.empty()) {
    const std::filesystem::path images = std::filesystem::path(output).replace_extension(".images");
    options.image_directory = images.string();
    options.image_prefix = images.filename().string();
  }
  return options;
}

/// Tells the journal, the progress line and the provenance of what a run does.
RunObserver observer_of(Journal* journal, Progress& progress, RunContext& context) {
  RunObserver observer;
  observer.cell_done = [&progress, journal](const SharedRecord& record, std::size_t done, std::size_t total) {
    if (journal && has_samples(*record)) journal->append(*record);
    progress.cell_done(*record, done, total);
  };
  observer.progress = [&progress](const CellRecord& record, double fraction) { progress.cell_progress(record, fraction); };
  observer.timing = [&progress](double fraction, std::size_t cells) { progress.timing(fraction, cells); };
  observer.cell_timed = [journal](const SharedRecord& record) {
    if (journal) journal->append(*record);
  };
  observer.settled = [journal] {
    if (journal) journal->settle();
  };
  observer.verdict_share = [&context](double share) { context.verdict_share = share; };
  observer.statistics_share = [&context](double share) { context.statistics_share = share; };
  observer.phase = [&context](const Phase& phase) { context.phases.push_back(phase); };
  observer.warning = [&progress](const std::string& message) { progress.warning(message); };
  return observer;
}

void tell_results(const RunRecord& run, const std::string& output, const std::vector<std::string>& columns) {
  const std::size_t width = terminal_width();
  tell("{}", wrapped(results_tables(run, {width, columns}), width));
  notice("results: {}\n", output);
  for (const auto& remark : {single_bound_remark(run), busy_remark(run)})
    if (remark) notice("nullmark: warning: {}\n", *remark);
}

/// To the file, whose journal is done with then, or to standard output where there is no journal.
ExitCode conclude_run(const Plan& plan, Earlier cells, const RunContext& context, const std::string& output, Journal* journal,
                      const std::vector<std::string>& columns) {
  std::vector<CellRecord> records;
  records.reserve(cells.size());
  while (!cells.empty()) records.push_back(std::move(cells.extract(cells.begin()).mapped()));
  const RunRecord run = make_run_record(plan, std::move(records), context);
  if (journal) {
    write_results(run, output);
    journal->remove();
    tell_results(run, output, columns);
  } else {
    write_results(run, [](std::string_view part) { fmt::print("{}", part); });
  }
  return outcome(run.cells);
}

}  // namespace

ExitCode run_command(const RunCommand& command) {
  expect_columns(command.columns, results_columns());
  take_consent(command.allow_foreign);
  const std::vector<ConfigSource> sources = load_configs(command.configs);
  const std::optional<std::uint64_t> seed = requested_seed(command.seed);
  const Plan plan = read_configs(sources, seed);
  const Shard shard = requested_shard(command.shard);
  const std::vector<bool> wanted = filtered(plan, command);
  const Deal dealt = shard.count > 1 ? deal(plan, wanted, shard.count) : Deal();
  const std::vector<bool> selected = shard.count > 1 ? dealt.cells_of(shard.index) : wanted;
  const auto count = static_cast<std::size_t>(std::count(selected.begin(), selected.end(), true));
  if (count == 0) {
    notice("nullmark: nothing selected: none of {} cells passes --filter, --covering and --shard\n", plan.cells.size());
    return ExitCode::nothing_ran;
  }
  if (seed) warn_of_own_seeds(plan, *seed);
  warn_of_narrow_phases(plan, selected);
  expect_threads(command.threads);
  if (command.dry_run) return dry_run(plan, selected, !command.no_timing, shard, dealt);

  const bool to_stdout = command.output == "-";
  const std::string output = command.output.empty() ? default_output(command.configs.front(), shard) : command.output;
  std::unique_ptr<Journal> journal;
  Earlier earlier;
  if (!to_stdout) {
    journal = open_journal(command, sources, plan, output);
    if (command.resume) earlier = earlier_results(plan, output, *journal, builds_of(command.builds));
  }
  RunContext context = context_of(command, plan, shard);
  RunOptions options = options_of(command, to_stdout ? "" : output);
  if (shard.count > 1) options.shares = dealt.shares_of(shard.index);

  // What was there before was selected then.
  for (std::size_t i = 0; i < plan.cells.size(); ++i) context.selected += wanted[i] || earlier.contains(i);

  std::vector<CellRecord> finished;
  for (const auto& [place, record] : earlier)
    if (selected[place] && is_kept(record, options.shares.empty() ? CellShare() : options.shares[place]))
      finished.push_back(placed(record, plan.cells[place]));

  catch_signals();
  std::optional<Progress> progress(count - finished.size());
  const auto conclude = [&](std::vector<CellRecord> records) {
    progress.reset();
    for (std::size_t i = 0, next = 0; i < plan.cells.size(); ++i)
      if (selected[i] && next < records.size()) earlier[i] = placed(std::move(records[next++]), plan.cells[i]);
    std::vector<CellRecord>().swap(records);
    return conclude_run(plan, std::move(earlier), context, output, journal.get(), command.columns);
  };
  return watched_run(plan, selected, finished, options, observer_of(journal.get(), *progress, context), conclude);
}

}  // namespace nullmark
