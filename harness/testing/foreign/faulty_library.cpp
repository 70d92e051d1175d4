// Trackers behind nullmark_tracker.h, right ones and wrong ones, for the tests of harness/foreign/.

#include <unistd.h>

#include <cfenv>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "harness/foreign/nullmark_tracker.h"

namespace {

struct State {
  std::string fault;
  std::vector<double> t, rate, extinction, points, u;
  std::vector<std::uint32_t> alive;
};

std::int32_t create(const char* parameters, void** state, char* error, std::int64_t error_size) {
  auto* made = new State;
  const std::string text = parameters;
  if (const auto at = text.find("\"fault\":\""); at != std::string::npos)
    made->fault = text.substr(at + 9, text.find('"', at + 9) - at - 9);
  if (made->fault == "create") {
    delete made;
    std::strncpy(error, "no licence\nfor this machine", static_cast<std::size_t>(error_size));
    return NULLMARK_ERROR;
  }
  *state = made;
  return NULLMARK_OK;
}

void destroy(void* state) { delete static_cast<State*>(state); }

std::int32_t describe(void* state, std::int32_t, std::int32_t, nullmark_description* out) {
  out->guarantee = NULLMARK_UNBIASED;
  out->range = NULLMARK_UNIT;
  if (static_cast<State*>(state)->fault == "describe") out->range = 9;
  if (static_cast<State*>(state)->fault == "binary") out->range = NULLMARK_BINARY;
  return NULLMARK_OK;
}

void misbehave(const std::string& fault, const nullmark_ray& ray, const nullmark_harness& harness) {
  double values[16];
  const std::uint32_t far = 1u << 20, first = 0;
  const double outside = ray.end + 1;
  if (fault == "throws") throw std::runtime_error("as C++ does");
  if (fault == "crashes") *static_cast<volatile int*>(nullptr) = 1;
  if (fault == "rounds") std::fesetround(FE_UPWARD);
  if (fault == "sleeps") ::sleep(1000);
  if (fault == "index") harness.lookup(harness.self, 1, &far, &ray.begin, values);
  if (fault == "outside") harness.lookup(harness.self, 1, &first, &outside, values);
  if (fault == "negative") harness.uniform(harness.self, -1, &first, values);
  if (fault == "endless")
    while (harness.lookup(harness.self, 1, &first, &ray.begin, values) == NULLMARK_OK) {
    }
  if (fault == "prints") {
    std::fputs("between frames\n", stdout);
    std::fflush(stdout);
  }
}

/// Ratio tracking that looks up points instead of distances if asked to.
std::int32_t walk(State& state, const nullmark_ray& ray, const nullmark_harness& harness, std::int64_t count, double* value,
                  bool by_points) {
  const auto channels = static_cast<std::size_t>(ray.channels), n = static_cast<std::size_t>(count);
  state.t.resize(n);
  state.rate.resize(n);
  state.extinction.resize(n * channels);
  state.points.resize(3 * n);
  state.alive.resize(n);
  for (std::size_t i = 0; i < n * channels; ++i) value[i] = 1;
  for (std::size_t k = 0; k < n; ++k) state.alive[k] = static_cast<std::uint32_t>(k);
  for (std::size_t left = n; left > 0;) {
    std::int32_t code =
        harness.next(harness.self, static_cast<std::int64_t>(left), state.alive.data(), state.t.data(), state.rate.data());
    if (code != NULLMARK_OK) return code;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < left; ++i) {
      if (std::isinf(state.t[i])) continue;
      state.alive[kept] = state.alive[i];
      state.t[kept] = state.t[i];
      state.rate[kept] = state.rate[i];
      for (int axis = 0; axis < 3; ++axis)
        state.points[3 * kept + static_cast<std::size_t>(axis)] = ray.origin[axis] + state.t[kept] * ray.direction[axis];
      ++kept;
    }
    left = kept;
    const auto asked = static_cast<std::int64_t>(left);
    code = by_points ? harness.lookup_at(harness.self, asked, state.alive.data(), state.points.data(), state.extinction.data())
                     : harness.lookup(harness.self, asked, state.alive.data(), state.t.data(), state.extinction.data());
    if (code != NULLMARK_OK) return code;
    const double slip = state.fault == "slip" ? 1.01 : 1;
    for (std::size_t i = 0; i < left; ++i)
      for (std::size_t c = 0; c < channels; ++c)
        value[state.alive[i] * channels + c] *= (state.rate[i] - slip * state.extinction[i * channels + c]) * (1 / state.rate[i]);
  }
  return NULLMARK_OK;
}

std::int32_t sample_ratio(void* self, const nullmark_ray* ray, const nullmark_harness* harness, std::uint64_t,
                          std::uint64_t first, std::int64_t count, std::int32_t, nullmark_result* result, char* error,
                          std::int64_t error_size) {
  State& state = *static_cast<State*>(self);
  misbehave(state.fault, *ray, *harness);
  if (state.fault == "stops") return NULLMARK_STOP;
  if (state.fault == "unset") return NULLMARK_OK;
  if (state.fault == "fails") {
    std::strncpy(error, "out of luck", static_cast<std::size_t>(error_size));
    return NULLMARK_ERROR;
  }
  const std::int32_t code = walk(state, *ray, *harness, count, result->value, state.fault == "points");
  if (state.fault == "range") result->value[0] = 2;
  if (state.fault == "nan") result->value[0] = std::numeric_limits<double>::quiet_NaN();
  if (state.fault == "remembers") {
    static std::uint64_t calls = 0;
    result->value[0] *= ++calls % 2 ? 1 : 1 - 1e-12;
  }
  (void)first;
  return code;
}

/// Ratio tracking on a homogeneous medium, with its moments.
std::int32_t theory(void*, const nullmark_ray* ray, std::int32_t, std::int32_t channel, double out[4]) {
  double begin = ray->begin, depth = 0, spread = 0, collisions = 0;
  for (std::int32_t s = 0; s < ray->segments; ++s) {
    const double length = ray->segment_end[s] - begin, mu = ray->average[s * ray->channels + channel];
    depth += mu * length;
    spread += mu * mu / ray->rate[s] * length;
    collisions += ray->rate[s] * length;
    begin = ray->segment_end[s];
  }
  out[1] = std::exp(-2 * depth) * std::expm1(spread);
  out[2] = out[3] = collisions;
  return NULLMARK_OK;
}

std::int32_t describe_delta(void*, std::int32_t, std::int32_t, nullmark_description* out) {
  out->guarantee = NULLMARK_UNBIASED;
  out->range = NULLMARK_BINARY;
  out->needs_bound = 1;
  return NULLMARK_OK;
}

/// Delta tracking: transmittance and free paths of grey media.
std::int32_t sample_delta(void* self, const nullmark_ray* ray, const nullmark_harness* harness, std::uint64_t, std::uint64_t,
                          std::int64_t count, std::int32_t quantity, nullmark_result* result, char*, std::int64_t) {
  State& state = *static_cast<State*>(self);
  for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(count); ++k) {
    double t = 0, rate = 0, extinction = 0, u = 0;
    bool collided = false;
    for (;;) {
      std::int32_t code = harness->next(harness->self, 1, &k, &t, &rate);
      if (code != NULLMARK_OK) return code;
      if (std::isinf(t)) break;
      code = harness->lookup(harness->self, 1, &k, &t, &extinction);
      if (code == NULLMARK_OK) code = harness->uniform(harness->self, 1, &k, &u);
      if (code != NULLMARK_OK) return code;
      if ((collided = u * rate < extinction)) break;
    }
    if (quantity == NULLMARK_FREE_PATH) {
      result->distance[k] = collided ? t : ray->end;
      result->event[k] = static_cast<std::uint8_t>(!collided ? NULLMARK_ESCAPED : state.fault == "event" ? 9 : NULLMARK_COLLIDED);
      result->weight[k] = 1;
    } else {
      result->value[k] = collided ? 0 : 1;
    }
  }
  return NULLMARK_OK;
}

std::int32_t describe_own(void*, std::int32_t, std::int32_t, nullmark_description* out) {
  out->guarantee = NULLMARK_UNBIASED;
  out->range = NULLMARK_BINARY;
  out->own_medium = 1;
  out->streams = NULLMARK_STREAMS_OF_KEY;
  return NULLMARK_OK;
}

/// A renderer with its own homogeneous medium of extinction 1 and its own random numbers.
std::int32_t sample_own(void*, const nullmark_ray* ray, const nullmark_harness*, std::uint64_t key, std::uint64_t first,
                        std::int64_t count, std::int32_t, nullmark_result* result, char*, std::int64_t) {
  for (std::int64_t k = 0; k < count; ++k) {
    // SplitMix64 [Steele, Lea, Flood 2014].
    std::uint64_t x = key ^ (ray->id * 0xd1342543de82ef95u) ^ ((first + static_cast<std::uint64_t>(k)) * 0x9e3779b97f4a7c15u);
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    const double u = static_cast<double>(x >> 11) * 0x1p-53;
    result->value[k] = -std::log1p(-u) >= ray->end - ray->begin;
    result->lookups[k] = 3;
  }
  return NULLMARK_OK;
}

nullmark_tracker tracker(const char* name, std::uint32_t quantities, decltype(nullmark_tracker::describe) described,
                         decltype(nullmark_tracker::sample) sampled, decltype(nullmark_tracker::theory) told = nullptr) {
  nullmark_tracker made = {};
  made.size = sizeof made;
  made.abi = NULLMARK_ABI;
  made.name = name;
  made.summary = "for tests";
  made.version = "7";
  made.quantities = quantities;
  made.create = create;
  made.destroy = destroy;
  made.describe = described;
  made.sample = sampled;
  made.theory = told;
  return made;
}

}  // namespace

const nullmark_tracker* nullmark_get_tracker(std::int32_t, std::int32_t index) {
  static const nullmark_tracker trackers[] = {
      tracker("ratio", NULLMARK_TRANSMITTANCE, describe, sample_ratio),
      tracker("ratio_with_theory", NULLMARK_TRANSMITTANCE, describe, sample_ratio, theory),
      tracker("delta", NULLMARK_TRANSMITTANCE | NULLMARK_FREE_PATH, describe_delta, sample_delta),
      tracker("own", NULLMARK_TRANSMITTANCE, describe_own, sample_own)};
  return index < 4 ? &trackers[index] : nullptr;
}
