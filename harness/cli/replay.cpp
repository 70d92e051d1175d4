#include "harness/run/replay.h"

#include <fmt/format.h>

#include <charconv>

#include "harness/cli/commands.h"
#include "harness/cli/process.h"
#include "harness/foreign/consent.h"
#include "harness/io/notice.h"
#include "harness/io/results_json.h"

namespace nullmark {
namespace {

/// Empty where nothing is asked for.
std::optional<std::uint64_t> index_of(const std::string& text, const char* option) {
  if (text.empty()) return {};
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw InputError(fmt::format("{}: found \"{}\"; expected a whole number from 0", option, text));
  return value;
}

}  // namespace

ExitCode replay_command(const ReplayCommand& command) {
  take_consent(command.allow_foreign);
  const SampleChoice choice{index_of(command.ray, "--ray"), index_of(command.sample, "--sample")};
  expect_threads(0);
  const RunRecord run = read_results_file(command.results);
  const Replay replay = replay_sample(run, command.results, command.cell, choice);
  if (command.json)
    fmt::print("{}\n", replay_json(replay).dump(2));
  else
    tell("{}", replay_text(replay));
  // Streams are addressed, so any sample can be drawn; but it is none of those that were judged.
  if (choice.sample && replay.sample >= replay.held)
    notice("nullmark: warning: --sample: found {}; the results hold {} of each ray, and not this one\n", replay.sample,
           replay.held == 0 ? "no samples" : fmt::format("samples 0 to {}", replay.held - 1));
  return ExitCode::ok;
}

}  // namespace nullmark
