#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <string_view>

#include "harness/analysis/check.h"
#include "harness/cli/commands.h"
#include "harness/cli/process.h"
#include "harness/cli/signals.h"
#include "harness/cli/watched_run.h"
#include "harness/foreign/content_hash.h"
#include "harness/foreign/sample_file.h"
#include "harness/io/file_io.h"
#include "harness/io/json_input.h"
#include "harness/io/notice.h"
#include "harness/io/outputs.h"
#include "harness/io/results_json.h"
#include "harness/registry/components.h"
#include "harness/report/check_text.h"
#include "harness/run/judge_images.h"
#include "harness/run/problem.h"
#include "harness/run/provenance.h"

namespace nullmark {
namespace {

/// Fewer make no pilot and no verdict.
constexpr std::uint64_t kFewest = 4;

std::string estimator_json(const JudgeCommand& command) {
  std::filesystem::path samples(command.samples);
  if (!samples.has_filename()) samples = samples.parent_path();
  return Json{{"type", kSamplesType}, {"file", samples.filename().string()}, {"range", command.range}}.dump();
}

/// Throws InputError where there are no samples, and tells where they may be.
void expect_samples(const JudgeCommand& command) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::status(command.samples, error).type() != fs::file_type::not_found) return;
  const std::string missing = command.samples + ": no such file; ";
  constexpr std::string_view kPrefix = "file:";
  if (command.samples.starts_with(kPrefix)) throw InputError(fmt::format("{}leave out \"{}\"", missing, kPrefix));
  const fs::path name = fs::path(command.samples).filename();
  for (const fs::path& elsewhere : {fs::path(command.problem) / name, name})
    if (!name.empty() && fs::exists(elsewhere, error))
      throw InputError(fmt::format("{}{} is there", missing, elsewhere.string()));
  throw InputError(missing + "expected an .npy file, or a folder of .exr images");
}

/// What more samples, or more knowledge of them, would do for a verdict that is open.
std::string advice(const JudgeCommand& command, const char* samples) {
  const std::string range = command.range == "signed"
                                ? "; state their --range if they have one, without it only a pilot of more than 100 is trusted"
                                : "";
  return fmt::format("undecided: hand in more {}{}", samples, range);
}

ExitCode tell_verdict(const JudgeCommand& command, const Plan& plan, std::vector<CellRecord> cells, const char* samples) {
  RunContext context;
  context.command_line = command.command_line;
  context.selected = 1;
  RunRecord run = make_run_record(plan, std::move(cells), context);
  const Summary summary = summarise(run);
  tell("{}", judgement_text(run, summary));
  if (summary.exit == ExitCode::inconclusive) tell("{}\n", advice(command, samples));
  if (!command.output.empty()) write_results(run, command.output);
  return summary.exit;
}

void expect_rays(const JudgeCommand& command, const ProblemScene& scene, const Plan& plan, const SampleShape& shape) {
  const std::size_t rays = make_ray_set(*plan.ray_sets[plan.cells[0].rays])->count();
  if (shape.rays != rays)
    throw InputError(fmt::format("{}: found samples of {} rays; scene {} has {}", command.samples, shape.rays, scene.id(), rays));
}

/// Bets on rays that share random numbers would prove biases that there are not.
void warn_of_shared_numbers(const JudgeCommand& command, const SampleShape& shape) {
  // Of independent rays the ratio is off by sqrt(2 / samples) or so.
  constexpr Real kDeviations = 10;
  const Real ratio = shared_variance(command.samples);
  if (ratio < std::max<Real>(2, 1 + kDeviations * std::sqrt(2 / static_cast<Real>(shape.samples)))) return;
  notice(
      "nullmark: warning: {}: the sums of its rows vary {:.3g} times as much as those of independent rays; give --correlated if "
      "rays share random numbers\n",
      command.samples, ratio);
}

ExitCode judge_file(const JudgeCommand& command, const ProblemScene& scene) {
  const SampleShape shape = read_sample_shape(command.samples);
  if (shape.samples < kFewest)
    throw InputError(
        fmt::format("{}: found {} samples of each ray; expected at least {}", command.samples, shape.samples, kFewest));
  const Plan plan = scene.plan(estimator_json(command), split_samples(shape.samples).judged, command.samples);
  expect_rays(command, scene, plan, shape);
  warn_of_shared_numbers(command, shape);
  RunOptions options;
  options.timing = false;
  options.interrupted = &received_signal;
  return watched_run(plan, {true}, {}, options, {},
                     [&](std::vector<CellRecord> records) { return tell_verdict(command, plan, std::move(records), "samples"); });
}

/// Adds the rows of a file, as if each were a picture.
AddPictures rows_of(const std::string& file) {
  return [file](const BuiltRays& rays, int channels, PixelGroups& pictures, std::vector<std::string>&) {
    const std::shared_ptr<const GivenSamples> samples = read_samples(file);
    if (samples->channels() != static_cast<std::size_t>(channels))
      throw InputError(fmt::format("{}: found {} channels; the scene has {}", file, samples->channels(), channels));
    std::vector<Real> row(rays.world.size() * samples->channels());
    for (std::uint64_t sample = 0; sample < samples->samples(); ++sample) {
      samples->copy_row(sample, row.data());
      pictures.add(row);
    }
    return content_hash(file);
  };
}

ExitCode judge_as_pictures(const JudgeCommand& command, const ProblemScene& scene, bool images) {
  if (!images) expect_rays(command, scene, scene.plan(), read_sample_shape(command.samples));
  const auto judged =
      judge_images(scene, command.samples, estimator_json(command), range_named(command.range),
                   images ? images_in(command.samples) : rows_of(command.samples), [] { return received_signal != 0; });
  if (!judged) return received_signal == SIGINT ? ExitCode::interrupted : ExitCode::terminated;
  for (const std::string& warning : judged->warnings) notice("nullmark: warning: {}\n", warning);
  return tell_verdict(command, judged->plan, {judged->record}, images ? "images" : "rows");
}

}  // namespace

ExitCode judge_command(const JudgeCommand& command) {
  refuse_overwriting({command.samples}, {command.output});
  expect_new(command.output, command.force, kResultsBeginning);
  expect_threads(0);
  const ProblemScene scene = ProblemScene::read(command.problem, command.scene);
  expect_samples(command);
  catch_signals();
  std::error_code error;
  const bool images = std::filesystem::is_directory(command.samples, error);
  return images || command.correlated ? judge_as_pictures(command, scene, images) : judge_file(command, scene);
}

}  // namespace nullmark
