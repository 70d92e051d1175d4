#include "harness/foreign/foreign_kernel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/foreign/sample_host.h"
#include "harness/kernel/free_path_scores.h"

namespace nullmark {
namespace {

/// What the tracker answers for a block.
struct BlockResult {
  std::vector<double> value, distance, weight;
  std::vector<std::uint8_t> event;
  std::vector<std::uint64_t> lookups;

  /// Entries that the tracker leaves alone are not finite, and make the cell an error.
  nullmark_result clear(std::size_t count, std::size_t channels, bool free_path, bool own_medium) {
    constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
    nullmark_result result = {};
    result.size = sizeof result;
    if (free_path) {
      distance.assign(count, kMissing);
      weight.assign(count * channels, kMissing);
      event.assign(count, NULLMARK_ESCAPED);
      result.distance = distance.data();
      result.weight = weight.data();
      result.event = event.data();
    } else {
      value.assign(count * channels, kMissing);
      result.value = value.data();
    }
    if (!own_medium) return result;
    lookups.assign(count, 0);
    result.lookups = lookups.data();
    return result;
  }
};

struct State final : Workspace {
  std::unique_ptr<TrackerSession> session;
  SampleHost host;
  BlockResult result;
};

class ForeignKernel final : public Kernel {
 public:
  ForeignKernel(std::shared_ptr<const ForeignTracker> tracker, int channels)
      : tracker_(std::move(tracker)), channels_(channels) {}

  bool needs_optical_depth() const override { return false; }
  bool needs_knots() const override { return false; }
  bool states_theory() const override { return tracker_->states_theory; }
  bool answers(Quantity quantity) const override { return tracker_->answers(quantity); }
  bool flies() const override { return false; }

  std::size_t outputs(Quantity quantity, const PreparedRay& context) const override {
    const auto channels = static_cast<std::size_t>(channels_);
    return quantity == Quantity::free_path ? free_path_outputs(context.albedo, channels) : channels;
  }

  std::unique_ptr<Workspace> workspace() const override {
    auto state = std::make_unique<State>();
    state->session = tracker_->session();
    return state;
  }

  void begin_ray(Workspace& workspace, const Medium& medium, const Extrema&, const PreparedRay& context) const override {
    State& state = static_cast<State&>(workspace);
    state.host.begin_ray(medium, context);
    state.session->begin_ray(state.host.ray());
  }

  void sample(Workspace& workspace, const Medium&, const PreparedRay& context, std::uint64_t key, std::uint64_t first,
              std::size_t count, Quantity quantity, SampleBlock& out, Counters& counters) const override {
    State& state = static_cast<State&>(workspace);
    const std::size_t outputs = this->outputs(quantity, context);
    out.values.resize(count * outputs);
    out.lookups.assign(count, 0);
    counters.samples += count;
    const TrackerDescription told = tracker_->describe(bit_of(quantity), channels_);
    for (std::size_t done = 0; done < count; done += tracker_->block) {
      const std::size_t n = std::min(tracker_->block, count - done);
      const std::span<std::uint32_t> lookups(&out.lookups[done], n);
      if (!draw(state, key, first + done, quantity, told, lookups, counters)) return;
      if (told.range == SampleRange::binary) expect_binary(state.result.value);
      score(state, context, quantity, {&out.values[done * outputs], n * outputs}, outputs);
    }
  }

  Real seam_seconds(const Workspace& workspace) const override {
    return static_cast<const State&>(workspace).session->seam_seconds();
  }

  std::vector<Theory> theory(const Workspace& workspace, const RayProfile&, Quantity quantity) const override {
    const State& state = static_cast<const State&>(workspace);
    std::vector<Theory> result(static_cast<std::size_t>(channels_));
    const auto known = [](double x) { return std::isnan(x) ? std::nullopt : std::optional<Real>(x); };
    for (int c = 0; c < channels_; ++c) {
      double told[4];
      std::fill(std::begin(told), std::end(told), std::numeric_limits<double>::quiet_NaN());
      if (!state.session->theory(state.host.ray(), bit_of(quantity), c, told)) continue;
      result[static_cast<std::size_t>(c)] = {known(told[0]), known(told[1]), known(told[2]), known(told[3])};
    }
    return result;
  }

 private:
  /// False where the block was told to stop.
  bool draw(State& state, std::uint64_t key, std::uint64_t first, Quantity quantity, const TrackerDescription& told,
            std::span<std::uint32_t> lookups, Counters& counters) const {
    nullmark_result result =
        state.result.clear(lookups.size(), static_cast<std::size_t>(channels_), quantity == Quantity::free_path, told.own_medium);
    state.host.begin_block(state, key, first, lookups.size(), lookups, counters);
    const std::int32_t code = state.session->sample(state.host.ray(), state.host.calls(), key, first,
                                                    static_cast<std::int64_t>(lookups.size()), bit_of(quantity), result);
    if (!state.host.misuse().empty()) throw TrackerFailure("the tracker misuses the interface: " + state.host.misuse());
    if (state.host.stopped()) return false;
    if (code != NULLMARK_OK) throw TrackerFailure(fmt::format("the tracker ends with {} though nothing told it to stop", code));
    for (std::size_t k = 0; k < lookups.size() && told.own_medium; ++k)
      lookups[k] = static_cast<std::uint32_t>(std::min<std::uint64_t>(state.result.lookups[k], state.most_lookups));
    state.host.end_block();
    return true;
  }

  /// Bets on coins rest on it.
  static void expect_binary(const std::vector<double>& values) {
    for (const double value : values)
      if (std::isfinite(value) && value != 0 && value != 1)
        throw TrackerFailure(fmt::format("the tracker states that its samples are 0 or 1, and one is {}", value));
  }

  void score(State& state, const PreparedRay& context, Quantity quantity, std::span<Real> values, std::size_t outputs) const {
    const BlockResult& result = state.result;
    if (quantity != Quantity::free_path) {
      std::copy_n(result.value.begin(), values.size(), values.begin());
      return;
    }
    const auto channels = static_cast<std::size_t>(channels_);
    for (std::size_t k = 0; k * outputs < values.size(); ++k) {
      Event<Spectrum> event;
      event.kind = kind_of(result.event[k]);
      event.distance = event.kind == EventKind::escape ? context.world.end : result.distance[k];
      event.weight = Eigen::Map<const Spectrum>(&result.weight[k * channels], channels_);
      if (!(event.distance >= context.world.begin && event.distance <= context.world.end))
        throw TrackerFailure(fmt::format("the tracker ends a flight at distance {:.17g} of ray {}; expected {:.17g} to {:.17g}",
                                         event.distance, context.index, context.world.begin, context.world.end));
      state.host.record_end(k, event.kind, event.distance);
      score_free_path(
          event, context, channels, [&](Real) { return state.host.rng(k).uniform() < context.albedo[0]; }, &values[k * outputs]);
    }
  }

  static EventKind kind_of(std::uint8_t event) {
    switch (event) {
      case NULLMARK_ESCAPED:
        return EventKind::escape;
      case NULLMARK_ABSORBED:
        return EventKind::absorb;
      case NULLMARK_SCATTERED:
        return EventKind::scatter;
      case NULLMARK_COLLIDED:
        return EventKind::collision;
      default:
        throw TrackerFailure(fmt::format("the tracker ends a flight with event {}; expected 0 to 3", event));
    }
  }

  std::shared_ptr<const ForeignTracker> tracker_;
  int channels_;
};

}  // namespace

std::unique_ptr<const Kernel> make_foreign_kernel(std::shared_ptr<const ForeignTracker> tracker, int channels) {
  return std::make_unique<ForeignKernel>(std::move(tracker), channels);
}

}  // namespace nullmark
