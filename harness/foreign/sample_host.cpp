#include "harness/foreign/sample_host.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "harness/kernel/majorant_audit.h"
#include "media/base/elementary.h"

namespace nullmark {
namespace {

/// The block must stop; thrown through the harness's own code only.
struct Stop {};
/// The tracker misuses a call; the reason is in `misuse_`.
struct Misuse {};

/// Points that are looked up together, at most.
constexpr std::size_t kTogether = 1024;
constexpr std::size_t kLookupsBetweenStops = 1u << 14;
/// A point this far outside of the medium's box, in its sizes, is on its boundary.
constexpr Real kRounding = 1e-9;

}  // namespace

SampleHost::SampleHost() : x_(kTogether), y_(kTogether), z_(kTogether), ahead_(kTogether), outside_(kTogether) {
  calls_.size = sizeof calls_;
  calls_.self = this;
  calls_.lookup = [](void* self, std::int64_t n, const std::uint32_t* sample, const double* t, double* values) {
    SampleHost& host = *static_cast<SampleHost*>(self);
    return host.answer(n, sample, [&](std::size_t at, std::size_t count) {
      host.look_up(count, sample + at, t + at, values + at * host.channels_);
    });
  };
  calls_.lookup_at = [](void* self, std::int64_t n, const std::uint32_t* sample, const double* points, double* values) {
    SampleHost& host = *static_cast<SampleHost*>(self);
    return host.answer(n, sample, [&](std::size_t at, std::size_t count) {
      host.look_up_at(count, sample + at, points + 3 * at, values + at * host.channels_);
    });
  };
  calls_.uniform = [](void* self, std::int64_t n, const std::uint32_t* sample, double* u) {
    SampleHost& host = *static_cast<SampleHost*>(self);
    return host.answer(n, sample, [&](std::size_t at, std::size_t count) {
      for (std::size_t i = at; i < at + count; ++i) u[i] = host.rng_[sample[i]].uniform();
    });
  };
  calls_.next = [](void* self, std::int64_t n, const std::uint32_t* sample, double* t, double* rate) {
    SampleHost& host = *static_cast<SampleHost*>(self);
    return host.answer(n, sample, [&](std::size_t at, std::size_t count) { host.fly(count, sample + at, t + at, rate + at); });
  };
}

/// Calls `f(first, count)` for parts of the n entries, once their samples are known to exist.  No exception leaves it.
template <class F>
std::int32_t SampleHost::answer(std::int64_t n, const std::uint32_t* sample, F&& f) noexcept {
  if (code_ != NULLMARK_OK) return code_;
  try {
    if (n < 0) refuse(fmt::format("it asks for {} numbers; expected at least 0", n));
    for (std::size_t at = 0, all = static_cast<std::size_t>(n); at < all; at += kTogether) {
      const std::size_t count = std::min(kTogether, all - at);
      // The loops over whole blocks are written so that compilers vectorise them.
      std::uint32_t largest = 0;
      for (std::size_t i = at; i < at + count; ++i) largest = std::max(largest, sample[i]);
      if (largest >= lookups_.size())
        refuse(fmt::format("it names sample {} of a call; expected 0 to {}", largest, lookups_.size() - 1));
      f(at, count);
    }
  } catch (const Stop&) {
    code_ = NULLMARK_STOP;
  } catch (const Misuse&) {
    code_ = NULLMARK_ERROR;
  } catch (const std::exception& error) {
    misuse_ = error.what();
    code_ = NULLMARK_ERROR;
  }
  return code_;
}

void SampleHost::refuse(const std::string& message) {
  misuse_ = message;
  throw Misuse{};
}

void SampleHost::begin_ray(const Medium& medium, const PreparedRay& context) {
  medium_ = &medium;
  context_ = &context;
  channels_ = static_cast<std::size_t>(medium.channels());
  world_to_local_ = medium.world_to_local();
  const Ray& world = context.world;
  rates_.start(world.begin, context.bounds.crossing());
  for (std::vector<double>* list : {&ends_, &rate_, &minimum_, &average_, &maximum_, &albedo_}) list->clear();
  for (const Segment& segment : context.bounds.segments()) {
    rates_.append(segment.end, segment.majorant);
    ends_.push_back(segment.end);
    rate_.push_back(segment.majorant);
    for (std::size_t c = 0; c < channels_; ++c) {
      const auto channel = static_cast<Eigen::Index>(c);
      minimum_.push_back(segment.extinction.minimum[channel]);
      average_.push_back(segment.extinction.average[channel]);
      maximum_.push_back(segment.extinction.maximum[channel]);
    }
  }
  albedo_.assign(channels_, 0);
  for (Eigen::Index c = 0; c < context.albedo.size(); ++c) albedo_[static_cast<std::size_t>(c)] = context.albedo[c];

  ray_.size = sizeof ray_;
  ray_.channels = static_cast<std::int32_t>(channels_);
  ray_.segments = static_cast<std::int32_t>(ends_.size());
  ray_.crossing = context.bounds.crossing() == Crossing::rewind;
  ray_.id = context.index;
  for (int axis = 0; axis < 3; ++axis) {
    ray_.origin[axis] = world.origin[axis];
    ray_.direction[axis] = world.direction[axis];
  }
  ray_.begin = world.begin;
  ray_.end = world.end;
  ray_.segment_end = ends_.data();
  ray_.rate = rate_.data();
  ray_.minimum = minimum_.data();
  ray_.average = average_.data();
  ray_.maximum = maximum_.data();
  ray_.albedo = albedo_.data();
}

void SampleHost::begin_block(Workspace& workspace, std::uint64_t key, std::uint64_t first, std::size_t count,
                             std::span<std::uint32_t> lookups, Counters& counters) {
  workspace_ = &workspace;
  counters_ = &counters;
  lookups_ = lookups;
  code_ = NULLMARK_OK;
  misuse_.clear();
  rng_.resize(count);
  flight_.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    rng_[k] = Rng(SampleAddress{key, context_->index, first + k});
    flight_[k].start(rates_);
  }
  if (!workspace.recording) return;
  recorded_before_ = workspace.recording->walks.size();
  workspace.recording->add(count);
}

void SampleHost::end_block() {
  for (std::size_t k = 0; k < rng_.size(); ++k) {
    counters_->draws += rng_[k].draws();
    counters_->lookups += lookups_[k];
    counters_->null_collisions += lookups_[k];
    if (!workspace_->recording) continue;
    Recording::Walk& walk = workspace_->recording->walks[recorded_before_ + k];
    walk.depth = flight_[k].depth();
    walk.total_depth = rates_.total_depth();
    walk.draws = rng_[k].draws();
    walk.collisions = flight_[k].collisions();
  }
}

void SampleHost::record_end(std::size_t sample, EventKind kind, Real distance) {
  if (!workspace_->recording) return;
  Recording::Walk& walk = workspace_->recording->walks[recorded_before_ + sample];
  walk.end = kind;
  walk.distance = distance;
}

/// Where t is: that of the flight, or, for distances of the tracker's own, searched for.
std::size_t SampleHost::piece_of(std::uint32_t sample, Real t) const {
  if (t == flight_[sample].position()) return flight_[sample].piece();
  const auto at = std::lower_bound(ends_.begin(), ends_.end(), t);
  return std::min(static_cast<std::size_t>(at - ends_.begin()), std::max<std::size_t>(ends_.size(), 1) - 1);
}

void SampleHost::record(std::uint32_t sample, Real t, std::size_t piece, const double* values) {
  Recording& recording = *workspace_->recording;
  Recording::Walk& walk = recording.walks[recorded_before_ + sample];
  const Real begin = piece == 0 ? rates_.begin() : rates_.end(piece - 1), rate = rates_.rate(piece);
  const Real depth = t == flight_[sample].position() ? flight_[sample].depth() : rates_.depth_before(piece) + (t - begin) * rate;
  walk.steps.push_back({t, depth, rate, rng_[sample].draws()});
  walk.extinction.insert(walk.extinction.end(), values, values + channels_);
  if (++recording.steps < Recording::kMostSteps) return;
  ++counters_->overruns;
  throw Stop{};
}

/// A lookup of a sample at distance t, held to the bound of its piece.
void SampleHost::audit(std::uint32_t sample, Real t, const double* values) {
  const std::size_t piece = piece_of(sample, t);
  if (workspace_->recording) [[unlikely]]
    record(sample, t, piece, values);
  audit_majorant(channels_ == 1 ? *values : *std::max_element(values, values + channels_), rates_.rate(piece), *counters_);
}

/// Counts a lookup of each sample.
void SampleHost::count(std::size_t n, const std::uint32_t* sample) {
  const std::uint32_t most = workspace_->most_lookups;
  for (std::size_t i = 0; i < n; ++i) {
    if (++lookups_[sample[i]] < most) [[likely]]
      continue;
    ++counters_->overruns;
    throw Stop{};
  }
}

/// Whether no value exceeds the bound of a ray that has only one.
bool SampleHost::all_bounded(std::size_t n, const double* values) const {
  if (rates_.size() > 1) return false;
  const Real bound = rates_.rate(0);
  int above = 0;
  for (std::size_t i = 0; i < n * channels_; ++i) above |= exceeds(values[i], bound);
  return above == 0;
}

/// Now and then asks whether to stop.
void SampleHost::pause(std::size_t lookups) {
  since_stop_ += lookups;
  if (since_stop_ < kLookupsBetweenStops) return;
  since_stop_ = 0;
  if (workspace_->stop()) throw Stop{};
}

void SampleHost::refuse_outside(std::size_t n, const double* t) {
  const Real begin = context_->world.begin, end = context_->world.end;
  const double first = *std::find_if(t, t + n, [&](double at) { return !(at >= begin && at <= end); });
  refuse(fmt::format("it looks up distance {:.17g} of ray {}; expected {:.17g} to {:.17g}", first, context_->index, begin, end));
}

void SampleHost::look_up(std::size_t n, const std::uint32_t* sample, const double* t, double* values) {
  const Ray& local = context_->local;
  const Vec3 origin = local.origin, direction = local.direction;
  const Real begin = context_->world.begin, end = context_->world.end;
  int outside = 0;
  for (std::size_t i = 0; i < n; ++i) outside |= !(t[i] >= begin) | !(t[i] <= end);
  if (outside) refuse_outside(n, t);
  Real *const x = x_.data(), *const y = y_.data(), *const z = z_.data();
  for (std::size_t i = 0; i < n; ++i) x[i] = origin.x() + t[i] * direction.x();
  for (std::size_t i = 0; i < n; ++i) y[i] = origin.y() + t[i] * direction.y();
  for (std::size_t i = 0; i < n; ++i) z[i] = origin.z() + t[i] * direction.z();
  medium_->extinction({x_.data(), y_.data(), z_.data(), n}, values);
  if (workspace_->recording || !all_bounded(n, values))
    for (std::size_t i = 0; i < n; ++i) audit(sample[i], t[i], values + i * channels_);
  count(n, sample);
  pause(n);
}

Real SampleHost::distance_of(const Vec3& point) const {
  const Ray& world = context_->world;
  return std::clamp(world.direction.dot(point - world.origin), world.begin, world.end);
}

void SampleHost::look_up_at(std::size_t n, const std::uint32_t* sample, const double* points, double* values) {
  const Box box = medium_->bounds();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 world(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    if (!world.allFinite()) refuse(fmt::format("it looks up ({}, {}, {})", world.x(), world.y(), world.z()));
    const Vec3 local = world_to_local_ * world, inside = local.cwiseMax(box.lo).cwiseMin(box.hi);
    outside_[i] = ((local - inside).cwiseAbs().array() > kRounding * box.extent().array()).any();
    x_[i] = inside.x(), y_[i] = inside.y(), z_[i] = inside.z();
  }
  medium_->extinction({x_.data(), y_.data(), z_.data(), n}, values);
  for (std::size_t i = 0; i < n; ++i) {
    if (outside_[i]) std::fill_n(values + i * channels_, channels_, 0.);
    audit(sample[i], distance_of({points[3 * i], points[3 * i + 1], points[3 * i + 2]}), values + i * channels_);
  }
  count(n, sample);
  pause(n);
}

/// Logarithms are taken together, as in the harness's own loop.
void SampleHost::fly(std::size_t n, const std::uint32_t* sample, double* t, double* rate) {
  for (std::size_t i = 0; i < n; ++i) ahead_[i] = rng_[sample[i]].peek();
  negative_logarithms(ahead_.data(), n, ahead_.data());
  for (std::size_t i = 0; i < n; ++i) rng_[sample[i]].make_ready(ahead_[i]);
  for (std::size_t i = 0; i < n; ++i) {
    Flight& flight = flight_[sample[i]];
    const bool inside = flight.next(rng_[sample[i]]);
    t[i] = inside ? flight.position() : kInfinity;
    rate[i] = inside ? flight.rate() : 0;
  }
}

}  // namespace nullmark
