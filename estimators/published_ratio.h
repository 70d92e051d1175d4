#pragma once

#include <cmath>

#include "estimators/estimator.h"

namespace nullmark {

/// Ratio tracking as the program behind Kozelj's comparison ran it: its random numbers are a hash of position, collision count
/// and frame time, in single precision,
///   p = frac(10.31 (x + i + time)),  p += dot(p, p.zyx + 31.32),  u = frac((p.x + p.y) p.z 20),
/// with x the ray's entry less one half, i from 0, and frame k (one sample) at time 1 + .31 k (the frame times were not
/// recorded).  Biased by the hash; registered to show what that does to the published table.
template <class Value>
struct PublishedRatioTracking {
  static constexpr const char* kName = "ratio_published_hash";
  static constexpr const char* kSummary = "ratio tracking with the hash generator of a published comparison (biased)";
  static constexpr const char* kSource = "Kozelj, Comparison of transmittance and distance estimators: program";
  static constexpr bool kOwnFlights = true;
  static constexpr SampleRange kRange = SampleRange::unit;
  static constexpr bool kNeedsBound = false;
  static constexpr bool kGreyOnly = true;

  Guarantee claim(Quantity) const { return Guarantee::biased; }

  struct Walk {
    Value weight;
    float frame_time = 0;
    int count = 0;
  };

  void init(Walk& walk, const MediumRay<Value>& ray, Flight&, auto& rng) const {
    walk = {ray.value(1), 1.f + 0.31f * static_cast<float>(rng.sample()), 0};
  }

  static float hash(const Vec3& entry, float shift) {
    const auto fraction = [](float x) { return x - std::floor(x); };
    float p[3];
    for (int k = 0; k < 3; ++k) p[k] = fraction(10.31f * (static_cast<float>(entry[k]) - 0.5f + shift));
    const float dot = p[0] * (p[2] + 31.32f) + p[1] * (p[1] + 31.32f) + p[2] * (p[0] + 31.32f);
    for (float& x : p) x += dot;
    return fraction((p[0] + p[1]) * p[2] * 20.f);
  }

  bool propose(Walk& walk, const MediumRay<Value>& ray, Flight& flight, auto&) const {
    const float u = hash(ray.entry, static_cast<float>(walk.count++) + walk.frame_time);
    return flight.advance_to(flight.depth() - std::log(1 - static_cast<Real>(u)));
  }

  void consume(Walk& walk, const MediumRay<Value>&, const Flight& at, const Value& extinction, auto&) const {
    walk.weight *= null_ratio(at, extinction);
  }

  Value result(const Walk& walk, const MediumRay<Value>&) const { return walk.weight; }
};

}  // namespace nullmark
