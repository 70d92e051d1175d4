#include "harness/run/replay.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>

#include "estimators/walk/lane_rng.h"
#include "harness/config/config.h"
#include "harness/io/text.h"
#include "harness/model/names.h"
#include "harness/sampling/test_plan.h"

namespace nullmark {
namespace {

/// Steps of a walk that are kept: a walk without an end must not fill the memory.
constexpr std::uint32_t kMostSteps = 1u << 22;

/// One thread's way to a cell's samples.
class Sampler {
 public:
  Sampler(const PreparedCell& cell)
      : cell_(cell),
        kernel_(*cell.kernel),
        workspace_(cell.kernel->workspace()),
        key_(stream_key(*cell.cell, *cell.scene->medium)) {}

  Workspace& workspace() { return *workspace_; }

  void begin_ray(std::size_t ray, std::span<const Real> marks = {}) {
    cell_.scene->context(ray, kernel_, context_);
    if (!marks.empty()) context_.marks = marks;
    kernel_.begin_ray(*workspace_, *cell_.scene->medium->medium, cell_.scene->medium->extrema, context_);
  }

  /// Samples first .. first + count - 1 of the ray that was begun.
  const SampleBlock& draw(std::uint64_t first, std::size_t count, Quantity quantity) {
    counters_ = {};
    kernel_.sample(*workspace_, *cell_.scene->medium->medium, context_, key_, first, count, quantity, block_, counters_);
    if (counters_.overruns > 0)
      throw InputError(fmt::format("{}: ray {}, samples {} to {}: a walk takes more than {} lookups", cell_.cell->name,
                                   context_.index, first, first + count - 1, workspace_->most_lookups));
    return block_;
  }

  /// Random numbers that the last samples took.
  std::uint64_t draws() const { return counters_.draws; }

 private:
  const PreparedCell& cell_;
  const Kernel& kernel_;
  std::unique_ptr<Workspace> workspace_;
  std::uint64_t key_;
  PreparedRay context_;
  SampleBlock block_;
  Counters counters_;
};

struct Suspect {
  Real distance = -1;  ///< from the target; infinite of what is not finite
  std::uint64_t sample = 0;
};

/// The first of the ray's samples that are farthest from their targets.
Suspect farthest(const PreparedCell& cell, Sampler& sampler, std::size_t ray, std::uint64_t samples) {
  constexpr std::uint64_t kBatch = 1u << 14;
  const std::size_t outputs = cell.targets.outputs;
  Suspect result;
  sampler.begin_ray(ray);
  for (std::uint64_t first = 0; first < samples; first += kBatch) {
    const std::vector<Real>& values = sampler.draw(first, std::min(kBatch, samples - first), cell.cell->quantity).values;
    for (std::size_t i = 0; i < values.size(); ++i) {
      Real distance = std::abs(values[i] - cell.targets.mean[ray * outputs + i % outputs]);
      if (!std::isfinite(distance)) distance = kInfinity;
      if (distance > result.distance) result = {distance, first + i / outputs};
    }
  }
  return result;
}

SampleChoice search(const PreparedCell& cell, std::uint64_t samples, const SampleChoice& choice) {
  const std::size_t rays = cell.scene->rays->world.size();
  const std::size_t from = choice.ray.value_or(0), to = choice.ray ? from + 1 : rays;
  std::vector<Suspect> suspects(to - from);
  tbb::enumerable_thread_specific<Sampler> samplers([&] { return Sampler(cell); });
  tbb::parallel_for(from, to, [&](std::size_t ray) { suspects[ray - from] = farthest(cell, samplers.local(), ray, samples); });
  const auto worst = std::max_element(suspects.begin(), suspects.end(),
                                      [](const Suspect& a, const Suspect& b) { return a.distance < b.distance; });
  return {from + static_cast<std::size_t>(worst - suspects.begin()), worst->sample};
}

const CellRecord& record_of(const RunRecord& run, const std::string& file, const std::string& name) {
  std::vector<std::string> names;
  for (const CellRecord& record : run.cells) {
    if (record.cell.name == name) return record;
    names.push_back(record.cell.name);
  }
  const std::string near = nearest(name, names);
  throw InputError(fmt::format(
      "{}: no cell \"{}\"; {}", file, name,
      near.empty() ? fmt::format("expected one of its {} names, as `nullmark export --format csv` lists them", names.size())
                   : fmt::format("did you mean \"{}\"?", near)));
}

/// The cell's place in the plan that its results were made by.
std::size_t place_of(const Plan& plan, const std::string& file, const Cell& cell) {
  for (std::size_t i = 0; i < plan.cells.size(); ++i)
    if (plan.cells[i].name == cell.name && plan.cells[i].id == cell.id) return i;
  throw InputError(fmt::format(
      "{}: the configuration in it no longer gives the cell \"{}\" as it was sampled: it, or the parameters of its tracker, "
      "have changed; run it again",
      file, cell.name));
}

/// As many as its verdict took; none of a cell that was not sampled.
std::uint64_t drawn_per_ray(const CellRecord& record) {
  if (record.rays == 0 || record.samples == 0) return 0;
  return std::max(record.samples / record.rays, record.verdict ? record.verdict->samples_per_ray : 0);
}

/// Of a cell that was not sampled, as many as are planned.
std::uint64_t samples_per_ray(const PreparedCell& cell, const CellRecord& record) {
  const std::uint64_t samples = drawn_per_ray(record), planned = cell.samples_per_ray;
  if (samples == 0) return planned;
  const std::uint64_t allowed = cell.cell->verdict.max_samples_per_ray;
  const std::uint64_t most = allowed == 0 ? kMostSampleFactor * planned : std::max(planned, allowed);
  // How many share lookups equally is not in the configuration.
  if (samples > most && !cell.cell->equal_lookups)
    throw InputError(fmt::format("cell \"{}\": found {} samples a ray; its configuration allows {}: the results were changed",
                                 record.cell.name, samples, most));
  return samples;
}

/// The numbers that a sample drew, from its stream's begin.
std::vector<Real> numbers(const SampleAddress& address, std::uint64_t count, Precision precision) {
  std::vector<Real> result(count);
  if (precision == Precision::float32) {
    using Streams = LaneRng<float, 1>;
    Streams::State state = Streams::seeded(address);
    Streams rng(state, Streams::Mask::first(1));
    for (Real& u : result) {
      float single = 0;
      rng.uniform().store(&single);
      u = static_cast<Real>(single);
    }
  } else {
    Rng rng(address);
    for (Real& u : result) u = rng.uniform();
  }
  return result;
}

Recording::Walk walk_of(const PreparedCell& cell, const SampleChoice& choice) {
  Sampler sampler(cell);
  Recording recording;
  sampler.workspace().recording = &recording;
  sampler.workspace().most_lookups = kMostSteps;
  sampler.begin_ray(*choice.ray);
  sampler.draw(*choice.sample, 1, cell.cell->quantity);
  return recording.walks.at(0);
}

/// The same walk, asked for its profile at its own steps.
std::vector<Real> transmittance_along(const PreparedCell& cell, const SampleChoice& choice, const Recording::Walk& walk) {
  if (walk.steps.empty() || !cell.kernel->answers(Quantity::transmittance_profile)) return {};
  std::vector<Real> marks;
  for (const Recording::Step& step : walk.steps) marks.push_back(step.position);
  Sampler sampler(cell);
  sampler.begin_ray(*choice.ray, marks);
  return sampler.draw(*choice.sample, 1, Quantity::transmittance_profile).values;
}

std::vector<std::string> output_names(const PreparedCell& cell) {
  if (!cell.targets.names.empty()) return cell.targets.names;
  std::vector<std::string> names;
  for (std::size_t c = 0; c < cell.targets.outputs; ++c)
    names.push_back(cell.targets.outputs == 1 ? to_string(cell.cell->quantity)
                                              : fmt::format("{}, channel {}", to_string(cell.cell->quantity), c));
  return names;
}

void expect_same_tracker(const CellRecord& record, const PreparedCell& cell, const std::string& file) {
  const auto identity = cell.source ? cell.source->identity() : std::nullopt;
  if (!identity) return;
  if (!identity->repeatable)
    throw InputError(fmt::format("{}: \"{}\": the tracker {} says that its samples cannot be drawn again", file, record.cell.name,
                                 identity->name));
  if (const std::string hash = hash_text(*identity); hash != record.tracker.hash)
    throw InputError(fmt::format("{}: \"{}\": the tracker's code has changed since (hash {}, now {}); run it again", file,
                                 record.cell.name, record.tracker.hash, hash));
}

}  // namespace

Replay replay_sample(const RunRecord& run, const std::string& file, const std::string& name, const SampleChoice& wanted) {
  const CellRecord& record = record_of(run, file, name);
  if (run.config_text.empty()) throw InputError(file + ": holds no configuration; expected the output of `nullmark run`");
  const Plan plan = read_config(run.config_text, file + "#config");
  const std::size_t place = place_of(plan, file, record.cell);
  CellPreparer preparer(plan);
  const PreparedCell cell = preparer.prepare(place);
  if (!cell.reason.empty()) throw InputError(fmt::format("{}: \"{}\" cannot be sampled: {}", file, name, cell.reason));
  if (const std::string hash = fmt::format("{:016x}", cell.scene->medium->hash); hash != record.medium_hash)
    throw InputError(fmt::format("{}: \"{}\": the medium's data have changed since (hash {}, now {}); run it again", file, name,
                                 record.medium_hash, hash));
  expect_same_tracker(record, cell, file);
  const std::size_t rays = cell.scene->rays->world.size();
  if (wanted.ray && *wanted.ray >= rays)
    throw InputError(fmt::format("--ray: found {}; the rays of \"{}\" are 0 to {}", *wanted.ray, name, rays - 1));

  SampleChoice choice = wanted;
  if (!choice.sample) {
    const std::uint64_t samples = samples_per_ray(cell, record);
    if (constexpr std::uint64_t kMostSearched = 1'000'000'000; samples > kMostSearched)
      throw InputError(
          fmt::format("{}: \"{}\" has {} samples a ray, too many to search; --sample chooses one", file, name, samples));
    choice = search(cell, samples, choice);
  }

  Replay replay;
  replay.cell = name;
  replay.ray = *choice.ray;
  replay.sample = *choice.sample;
  replay.held = drawn_per_ray(record);
  replay.world = cell.scene->rays->world[replay.ray];
  replay.quantity = cell.cell->quantity;
  replay.precision = cell.cell->precision;
  replay.channels = cell.scene->medium->medium->channels();
  replay.outputs = output_names(cell);
  if (replay.precision == Precision::float64) {
    replay.walk = walk_of(cell, choice);
    replay.transmittance = transmittance_along(cell, choice, replay.walk);
  }
  Sampler sampler(cell);
  sampler.begin_ray(replay.ray);
  const SampleBlock& drawn = sampler.draw(replay.sample, 1, replay.quantity);
  replay.draws = numbers({stream_key(*cell.cell, *cell.scene->medium), static_cast<std::uint32_t>(replay.ray), replay.sample},
                         sampler.draws(), replay.precision);
  replay.values = drawn.values;
  replay.lookups = drawn.lookups[0];
  for (std::size_t o = 0; o < replay.values.size(); ++o)
    replay.targets.push_back(cell.targets.known ? std::optional(cell.targets.mean[replay.ray * cell.targets.outputs + o])
                                                : std::nullopt);
  return replay;
}

}  // namespace nullmark
