#pragma once

#include "estimators/estimator.h"
#include "estimators/theory/survival.h"

namespace nullmark {

/// Delta tracking, 1 where the walk escapes [Woodcock et al. 1965; Coleman 1968].  Needs mub >= mu.  Binary, Var = T (1 - T),
/// lookups int mub(x) T(0,x) dx.  On chromatic media the channels either share one walk at the largest channel's majorant, each
/// comparing the same random number, until all are dead; or every channel walks for itself at its own majorant.
template <class Value>
struct DeltaTracking {
  static constexpr const char* kName = "delta";
  static constexpr const char* kSummary = "delta (Woodcock) tracking: 1 where the walk escapes, else 0";
  static constexpr const char* kSource = "Woodcock et al. 1965; Coleman 1968";
  static constexpr SampleRange kRange = SampleRange::binary;
  static constexpr bool kNeedsBound = true;
  static constexpr bool kLanes = true;

  static constexpr bool kChromatic = kIsChromatic<OneSample<Value>>;
  /// Whether each channel can walk for itself.
  static constexpr bool kSeparable = kIsChromatic<Value>;

  std::string walks = "shared";

  void parameters(ParameterVisitor& visit) {
    visit.choice(
        "walks", walks, {"shared", "separate"},
        "on chromatic media: one walk shared by the channels, or one walk per channel at its own majorant, without lanes");
  }

  Guarantee claim(Quantity) const { return Guarantee::unbiased; }

  bool flies_once(int channels) const { return walks == "shared" || channels == 1; }

  struct RayData : MediumRay<Value> {
    std::vector<Rates> per_channel;  ///< empty where the channels share one walk
  };

  void prepare(RayData& ray) const {
    ray.per_channel.clear();
    if (walks == "shared" || ray.channels == 1) return;
    ray.per_channel.resize(static_cast<std::size_t>(ray.channels));
    for (int c = 0; c < ray.channels; ++c) {
      Rates& rates = ray.per_channel[static_cast<std::size_t>(c)];
      rates.start(ray.begin, ray.bounds.crossing());
      for (const Segment& segment : ray.bounds.segments()) {
        const Real most = segment.extinction.maximum.maxCoeff();
        rates.append(segment.end, most > 0 ? segment.majorant * (segment.extinction.maximum[c] / most) : segment.majorant);
      }
    }
  }

  struct Grey {
    Truth<Value> done;
  };
  struct Shared {
    Value transmittance;
    Truth<Value> done;
  };
  struct Separable : Shared {
    int walking;  ///< the channel that walks, where each walks for itself
  };
  using Walk = std::conditional_t<kSeparable, Separable, std::conditional_t<kChromatic, Shared, Grey>>;

  void init(Walk& walk, const auto& ray, auto& flight, auto&) const {
    walk.done = false;
    if constexpr (kChromatic) walk.transmittance = ray.value(1);
    if constexpr (kSeparable) walk.walking = 0;
    if (!ray.per_channel.empty()) flight.start(ray.per_channel[0]);
  }

  auto propose(Walk& walk, const auto& ray, auto& flight, auto& rng) const {
    if constexpr (kSeparable) {
      while (!ray.per_channel.empty()) {
        if (flight.next(rng, !walk.done)) return true;
        walk.done = false;
        if (++walk.walking == ray.channels) return false;
        flight.start(ray.per_channel[static_cast<std::size_t>(walk.walking)]);
      }
    }
    return flight.next(rng, !walk.done);
  }

  void consume(Walk& walk, const auto& ray, const auto& at, const Value& extinction, auto& rng) const {
    const Distance<Value> threshold = rng.uniform() * at.rate();
    if constexpr (kSeparable) {
      if (!ray.per_channel.empty()) {
        walk.done = threshold < extinction[walk.walking];
        if (walk.done) walk.transmittance[walk.walking] = 0;
        return;
      }
    }
    if constexpr (kChromatic) {
      walk.transmittance = select(extinction > threshold, ray.value(0), walk.transmittance);
      walk.done = vanished(walk.transmittance);
    } else {
      walk.done = extinction > threshold;
    }
  }

  Value result(const Walk& walk, const auto& ray) const {
    if constexpr (kChromatic)
      return walk.transmittance;
    else
      return select(walk.done, Value(ray.value(0)), Value(ray.value(1)));
  }

  Value transmittance_at(const Walk& walk, const RayData& ray, Real) const { return result(walk, ray); }

  /// Channels that share a walk end apart.
  bool samples_events(int channels) const { return channels == 1; }

  Event<Value> event(const Walk& walk, const RayData& ray, const Flight& at) const {
    return {walk.done ? EventKind::collision : EventKind::escape, at.position(), ray.value(1)};
  }

  auto real_collisions(const Walk& walk, const auto& ray) const {
    if constexpr (kSeparable)
      return static_cast<int>(ray.per_channel.empty() ? walk.done : (walk.transmittance == 0).count());
    else
      return walk.done;
  }

  /// Where the majorant is violated every collision is accepted: the walk sees min(mu, mub).
  Theory theory(const RayData& ray, const RayProfile& profile, int c, Quantity) const {
    const auto rate = [&](int k, const RayProfile::Node& at) {
      return ray.per_channel.empty() ? ray.majorant.rate(at.piece) : ray.per_channel[static_cast<std::size_t>(k)].rate(at.piece);
    };
    const auto killed = [&](int k, const RayProfile::Node& at) { return std::min(at.extinction, rate(k, at)); };
    const Real depth = profile.integrate(c, [&](const RayProfile::Node& at) { return killed(c, at); });
    Theory theory{.variance = std::exp(-depth) * -std::expm1(-depth)};
    if (depth < profile.optical_depth(c)) theory.mean = std::exp(-depth);
    if (ray.per_channel.empty()) {
      state_lookups_until_killed(theory, profile, killed, [&](const RayProfile::Node& at) { return rate(0, at); });
      return theory;
    }
    Real lookups = 0;
    for (int k = 0; k < ray.channels; ++k) {
      const auto dead = profile.running(k, [&](const RayProfile::Node& at) { return killed(k, at); });
      std::size_t j = 0;
      lookups += profile.integrate(k, [&](const RayProfile::Node& at) { return rate(k, at) * std::exp(-dead[j++]); });
    }
    theory.lookups = lookups;
    return theory;
  }
};

}  // namespace nullmark
